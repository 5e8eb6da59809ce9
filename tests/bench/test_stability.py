"""Numerical stability that is shown: forward errors of auto in units of what rounding the data may cause."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.linalg import hilbert

from lcpcli import Problem
from lcpcli.bench import accuracy_tables, report_tables
from lcpcli.bench.record import BenchRecord
from lcpcli.bench.suites import EXTREME, STIFF, Case, case, prepare
from lcpcli.bench.timing import run_method
from lcpcli.bench.verdicts import Checker
from lcpcli.verify.digits import sensitivity

from .bench_problems import MACHINE, SETTINGS, measurement

CASES = [each for each in (*STIFF, *EXTREME) if each.n <= 100]


@pytest.mark.slow("the whole table of stability")
@pytest.mark.parametrize("each", CASES, ids=lambda each: each.name)
def test_auto_is_right_to_a_hundred_times_the_condition(each: Case) -> None:
    problem = prepare(each)
    answer = run_method("auto", problem, 1e-10, 20.0, with_curve=False)
    check = Checker(problem, 1e-6).check(answer)
    assert (check["success"], check["false_success"]) == (True, False)
    assert (check.get("forward_error") or 0) <= 100


def test_sensitivity_of_a_diagonal_problem_is_its_two_roundings() -> None:
    M = np.diag([1e-100, 1.0, 1e100])
    z = np.ones(3)
    assert sensitivity(Problem(M, -M @ z), z) == pytest.approx(2.0)
    assert sensitivity(Problem(sparse.csr_array(M), -M @ z), z) == pytest.approx(2.0)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_sensitivity_is_what_perturbed_data_show(seed: int) -> None:
    """The worst signs of the changes attain it, to first order."""
    random = np.random.default_rng(seed)
    n = 4
    A = random.standard_normal((n, n))
    M, z = A @ A.T + 0.1 * np.eye(n), random.uniform(0.5, 2, n)
    q = -M @ z
    predicted = sensitivity(Problem(M, q), z)
    assert predicted is not None
    inverse = np.linalg.inv(M)
    size = 1e-7 / predicted
    largest = 0.0
    for row in range(n):
        signs = np.sign(inverse[row])
        moved = np.linalg.solve(M - size * signs[:, np.newaxis] * np.abs(M), -q + size * signs * np.abs(q))
        largest = max(largest, float(np.abs(moved - z).max()))
    assert largest == pytest.approx(size * predicted, rel=1e-3)


def test_inverse_is_exact_where_doubles_are_not_enough() -> None:
    M = hilbert(14)
    found = sensitivity(Problem(M, -M @ np.ones(14)), np.ones(14))
    assert found is not None
    assert found > 1e17


def test_a_singular_basis_and_an_inverse_beyond_the_range_of_doubles_have_no_sensitivity() -> None:
    assert sensitivity(Problem(np.ones((2, 2)), [-1.0, -1.0]), np.array([0.5, 0.5])) is None
    problem = Problem([[1e-320]], [-1e-320], solutions=[[1.0]])
    assert sensitivity(problem, np.ones(1)) is None
    assert Checker(problem, 1e-6).check(run_method("auto", problem, 1e-10, 5.0, with_curve=False))["success"]


def test_zero_solution_has_no_sensitivity_to_speak_of() -> None:
    assert sensitivity(Problem(np.eye(2), [1.0, 2.0]), np.zeros(2)) == 0.0


def record(*successes: bool) -> BenchRecord:
    cases = [case("diagonal", 10, decades=decades) for decades in (1, 2, 4)]
    rows = []
    for i, (each, good) in enumerate(zip(cases, successes, strict=True)):
        own = {"family": each.family, "parameters": each.parameters, "condition": 10.0 * i, "forward_error": 0.5 * i}
        rows.append(measurement(each.name, "auto", 10, good, **own))
    return BenchRecord(["stiff"], cases, ["auto"], [], [], SETTINGS, MACHINE, {}, rows)


@pytest.mark.parametrize(
    ("successes", "cells"),
    [
        ((True, True, True), ["4", "1.0e+00", "2.0e+01", "all"]),
        ((True, True, False), ["2", "5.0e-01", "1.0e+01", "4: iteration limit"]),
        ((True, False, True), ["1", "0", "0", "2: iteration limit"]),
        ((False, True, True), ["-", "", "", "1: iteration limit"]),
    ],
)
def test_ladder_is_climbed_up_to_the_first_failure(successes: tuple[bool, ...], cells: list[str]) -> None:
    held = record(*successes)
    ((row,),) = accuracy_tables.stability(held).tables[0].groups
    assert row == ["diagonal", "decades", "auto", *cells]
    held.suite = ["quick"]  # not in order of stiffness
    assert not any(accuracy_tables.stability(held).tables[0].groups)


def test_the_figure_of_a_suite_in_order_of_stiffness_has_error_and_time_over_the_condition() -> None:
    held = record(True, True, False)
    (auto,) = report_tables.stiffness_of(held)
    assert (auto.label, list(auto.conditions), list(auto.seconds)) == ("auto", [0.0, 10.0], [1.0, 1.0])
    assert auto.errors == pytest.approx([0.0, 5 * 2.0**-52])
    pytest.importorskip("matplotlib")
    from lcpcli.report.figures import run_figures, style

    with style.context():
        figure = run_figures.draw_bench([], [], [], [auto])
    assert [axes.get_xlabel() for axes in figure.axes] == ["condition of the solution"] * 2
    assert [axes.get_ylabel()[:5] for axes in figure.axes] == ["error", "run t"]
