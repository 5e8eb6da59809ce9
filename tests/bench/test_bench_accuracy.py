"""The accuracy of answers that a bench shows: residuals and gaps of programs, times to an error, and forward errors
in units of what rounding the data may cause."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli import Problem, from_qp, read, run
from lcpcli.bench import record as records
from lcpcli.bench import report
from lcpcli.bench.record import BenchRecord, Measurement
from lcpcli.bench.statistics import shifted_geometric_mean
from lcpcli.bench.suites import EXTREME, STIFF, Case, cases_of, prepare
from lcpcli.bench.timing import ABSOLUTE, NATURAL, RELATIVE, Checker, optimality, run_method
from lcpcli.files import contents
from lcpcli.report import wording
from lcpcli.solving.answer import Minimum

from ..benchmarks import accuracy
from ..benchmarks.accuracy import sensitivity
from .bench_problems import MACHINE, SETTINGS, measurement

FOLDER = Path(contents.shipped_path("programs/portfolio.json")).parent
OPTIMA = {  # Hock and Schittkowski 1981, Dantzig 1963, Klee and Minty 1972; of the portfolio, computed in fractions
    "hs21": -99.96,
    "hs35": 1 / 9,
    "hs53": 176 / 43,
    "hs76": -4.681818181818182,
    "klee-minty": 1e8,
    "portfolio": 1091 / 99_200,
    "transport": 153.675,
}
HALF_SQUARE = from_qp(Q=[[1]], c=[0], A=[[1]], row_lower=[1], lower=[-np.inf])  # min x^2 / 2, x >= 1: x = y = 1
STEEP = from_qp(Q=[[1e4]], c=[-2e4], upper=[1])  # x = 1
RANGE = from_qp(Q=[[1]], c=[-4], A=[[2]], row_lower=[0], row_upper=[4], upper=[9])  # x = 2, y = -1, s = 4


@pytest.mark.parametrize(
    ("problem", "z", "absolute", "relative"),
    [
        (HALF_SQUARE, (1.0, 1.0), 0.0, 0.0),
        (HALF_SQUARE, (1.1, 0.9), 1.21 - 0.9, (1.21 - 0.9) / 1.21),  # the gap
        (HALF_SQUARE, (0.9, 0.9), 0.1, 0.1),  # x is too small by 0.1, which y multiplies
        (HALF_SQUARE, (1.0, -0.5), 1.5, 1.5),  # x - y is 1.5, and so is the gap
        (STEEP, (1 + 2.0**-10,), 1e4 * (1 - 2.0**-10) * 2.0**-10, 2.0**-10 / (1 + 2.0**-10)),  # of terms of size 1
        (RANGE, (2.0, -1.0, 4.0), 0.0, 0.0),
        (RANGE, (2.5, -0.75, 4.0), 1.0, 1.0 / 9.0),  # 2 x is too large by 1, of terms that are at most 5 + 4
    ],
)
def test_residuals_and_gap_are_those_of_the_program(
    problem: Problem, z: tuple[float, ...], absolute: float, relative: float
) -> None:
    found = optimality(problem, np.array(z))
    assert found is not None
    assert found[ABSOLUTE] == pytest.approx(absolute)
    assert found[RELATIVE] == pytest.approx(relative)


def test_a_multiplier_is_not_given_to_a_bound_that_is_far() -> None:
    """w = -1e-9 inside a large box is a residual of 1e-9, not a gap of 1."""
    problem = from_qp(Q=[[1]], c=[-1], upper=[1e9])
    found = optimality(problem, np.array([1 - 1e-9]))
    assert found is not None
    assert found[ABSOLUTE] == pytest.approx(1e-9)


def test_other_problems_and_answers_out_of_range_are_not_measured() -> None:
    assert optimality(Problem([[1.0]], [-1.0]), np.ones(1)) is None
    assert optimality(HALF_SQUARE, None) == {}
    assert optimality(HALF_SQUARE, np.array([np.nan, 1.0])) == {}
    assert optimality(HALF_SQUARE, np.array([np.inf, 1.0])) == {}
    assert optimality(from_qp(Q=[[1e305]], c=[1]), np.array([-1e305])) == {}


@pytest.mark.parametrize("size", [1e-150, 1.0, 1e150, 1e305])
def test_terms_that_are_0_do_not_magnify_rounding(size: float) -> None:
    """No objective: multipliers are 0, and the gap is the product of two roundings."""
    problem = from_qp(Q=[[0, 0], [0, 0]], c=[0, 0], A=[[0.1 * size, 0.7 * size]], row_lower=[size], row_upper=[size])
    found = optimality(problem, np.array([3.0, 1.0, 2e-25]))
    assert found is not None
    assert max(found[RELATIVE], found[NATURAL]) < 1e-15


def test_a_point_that_moves_no_term_is_measured_by_its_bounds() -> None:
    found = optimality(from_qp(Q=[[1.0]], c=[0.0], lower=[5.0]), np.zeros(1))
    assert found == {ABSOLUTE: 5.0, RELATIVE: 1.0, NATURAL: 1.0}


@pytest.mark.parametrize("name", OPTIMA)
def test_each_shipped_program_has_a_source_and_is_solved_to_its_known_optimal_value(name: str) -> None:
    file = str(FOLDER / f"{name}.json")
    answer = run(read(file)).answer
    (problem,) = map(prepare, cases_of([file]))
    assert (problem.name, problem.source == "") == (name, False)
    assert isinstance(answer, Minimum)
    assert answer.objective == pytest.approx(OPTIMA[name], rel=1e-12)
    found = optimality(problem, run(problem).z)
    assert found is not None
    assert max(found.values()) < 1e-9


def test_these_programs_ship_and_are_measured_and_a_folder_stands_for_its_files() -> None:
    files = [f"{name}.json" for name in sorted(OPTIMA)]
    assert sorted(path.name for path in FOLDER.glob("*.json")) == files
    assert [Path(case.file).name for case in cases_of(["programs"]) if case.file] == files
    assert [case.name for case in cases_of([str(FOLDER)])] == files


def test_the_table_counts_what_is_claimed_and_accurate() -> None:
    def row(problem: str, solver: str, size: float | None, claimed: bool = True) -> Measurement:
        found = None if size is None else {ABSOLUTE: 100 * size, RELATIVE: size, NATURAL: size}
        return measurement(problem, solver, success=claimed, seconds=[0.5], optimality=found)

    rows = [row("a", "auto", 1e-12), row("a", "shi", 1e-8), row("b", "auto", 1e-7), row("b", "shi", 1e-12, False)]
    rows += [row("lcp", "auto", None), row("lcp", "shi", None)]
    record = BenchRecord(["x"], [], ["auto", "shi"], [], [], SETTINGS, MACHINE, {}, rows)
    (group,) = report.optimality(record).tables[0].groups
    mean = wording.digits(1e3 * shifted_geometric_mean([0.5, 10.0], report.PROGRAM_SHIFT))
    assert group == [
        ["auto", "2", "2", "1", "1", "1", "1", "500"],
        ["shi", "2", "1", "0", "1", "0", "0", mean],
    ]
    assert not any(report.optimality(replace(record, methods=["auto"], measurements=rows[4:5])).tables[0].groups)


CASES = [each for each in (*STIFF, *EXTREME) if each.n <= 100]


@pytest.mark.slow("the whole table of stability")
@pytest.mark.parametrize("each", CASES, ids=lambda each: each.name)
def test_auto_is_right_to_a_hundred_times_the_condition(each: Case) -> None:
    problem = prepare(each)
    answer = run_method("auto", problem, 1e-10, 20.0, with_curve=False)
    check = Checker(problem, 1e-6).check(answer)
    assert (check["success"], check["false_success"]) == (True, False)
    assert (accuracy.forward_error(problem, check.get("error")) or 0) <= 100


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


def test_a_singular_basis_and_an_inverse_beyond_the_range_of_doubles_have_no_sensitivity() -> None:
    assert sensitivity(Problem(np.ones((2, 2)), [-1.0, -1.0]), np.array([0.5, 0.5])) is None
    problem = Problem([[1e-320]], [-1e-320], solutions=[[1.0]])
    assert sensitivity(problem, np.ones(1)) is None
    assert Checker(problem, 1e-6).check(run_method("auto", problem, 1e-10, 5.0, with_curve=False))["success"]


FILES = [contents.shipped_path(name) for name in contents.PAPER_EXAMPLES]
Lcp = Callable[..., Any]


@pytest.fixture
def record(lcp: Lcp, tmp_path: Path) -> BenchRecord:
    file = str(tmp_path / "r.json")
    assert (
        lcp("bench", *FILES, "--budget", "0", "--method", "fixed-point", "--method", "shi", "-q", "-o", file).code == 0
    )
    return records.read(file)


def test_records_with_fields_of_earlier_versions_are_read(record: BenchRecord) -> None:
    text = json.loads(report.render(record, "json", None, False))
    for row in text["measurements"]:
        row["rate"] = {"measured": 0.5, "bound": 0.6}
    assert records.parse(json.dumps(text)) == record
