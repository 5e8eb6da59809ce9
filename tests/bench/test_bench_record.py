"""The record of a bench: what it holds, refuses and checks, of nonlinear problems too,
and that JSON gives it back."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli import Problem
from lcpcli.bench import record as records
from lcpcli.bench.suites import (
    ALL,
    SUITES,
    cases_of,
    prepare,
)
from lcpcli.bench.timing import checked, run_method
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.peers.registry import Claim

from .. import literature
from ..benchmarks import accuracy
from ..benchmarks.accuracy import sensitivity
from ..cli.conftest import assert_refused
from ..cli.models import MARKET
from .bench_problems import install, liar, measured, measurement, write


@pytest.mark.parametrize(
    "text",
    [
        measured(),
        measured() + "\n",
        measured() + '\n{"problem": "a',
    ],
)
def test_a_record_is_read_up_to_a_last_line_that_was_cut_off(text, tmp_path):
    path = tmp_path / "r.json"
    path.write_text(text)
    assert records.read(str(path)).measurements == [measurement("a.json", "auto")]


def answer(z, solved=True, status=""):
    return Claim(
        None if z is None else np.array(z, dtype=float), solved, 1.0, "", status
    )


NONE = {"solved": False, "status": "unsolvable"}
SOLVABLE = Problem([[2, 1], [1, 2]], [-5, -6], solutions=[[4 / 3, 7 / 3]])
UNKNOWN = Problem([[2, 1], [1, 2]], [-5, -6])
INFEASIBLE = Problem([[0, -1], [1, 0]], [-1, -1], verdict="infeasible")
SOLVED_ALL_THE_SAME = Problem([[2]], [-1], verdict="infeasible")
# Whose second row is nothing to a tolerance for all rows.
DIAGONAL = Problem([[1e6, 0], [0, 1]], [-1e6, -1])
SOLVED = [4 / 3, 7 / 3]


@pytest.mark.parametrize(
    ("problem", "given_answer", "success", "false_success"),
    [
        (SOLVABLE, answer(np.array(SOLVED) * (1 + 1e-4)), False, True),
        (SOLVABLE, answer(SOLVED, False), False, False),
        (SOLVABLE, answer([np.nan, 1]), False, True),
        (SOLVABLE, answer(None), False, True),
        (SOLVABLE, answer(None, False), False, False),
        (SOLVABLE, answer([0, 0], **NONE), False, True),
        (UNKNOWN, answer([0, 0], **NONE), True, False),
        (DIAGONAL, answer([1, 1]), True, False),
        (DIAGONAL, answer([1, 1.3]), False, False),
        (DIAGONAL, answer([0, 1]), False, True),
        (INFEASIBLE, answer([1, 1]), False, True),
        (SOLVED_ALL_THE_SAME, answer([0.5]), False, True),
        (INFEASIBLE, answer([1, 1], False), False, False),
    ],
)
def test_claims_are_checked_against_the_data(
    problem, given_answer, success, false_success
):
    check = checked(problem, given_answer, 1e-6)
    assert (check["success"], check["false_success"]) == (success, false_success)


def test_no_two_cases_of_a_bench_have_the_same_name():
    listed = [each for suite in SUITES.values() for each in suite.cases]
    by_name = {each.name: each for each in listed}
    assert all(by_name[each.name] == each for each in listed)
    assert cases_of([ALL, "quick"]) == list(by_name.values())


def test_files_of_the_same_name_are_told_apart(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "p.json").write_text('{"M": [[1]], "q": [1]}')
    (tmp_path / "q.json").write_text('{"M": [[1]], "q": [1]}')
    paths = [
        str(tmp_path / name) for name in ("a/p.json", "b/p.json", "q.json", "q.json")
    ]
    assert [each.name for each in cases_of(paths)] == [paths[0], paths[1], "q.json"]


def test_answers_are_checked_by_f_evaluated_again():
    problem = literature.josephy()
    undefined = NonlinearProblem(lambda z: np.log(z - 2), x0=[3.0])

    def verdict(given, z, solved=True):
        found = checked(given, answer(z, solved), 1e-6)
        return found["success"], found["false_success"]

    solution = problem.solutions[0].tolist()
    assert verdict(problem, solution) == (True, False)
    assert verdict(problem, solution, False) == (False, False)
    assert verdict(problem, [1.2, 0, 0, 0.5]) == (False, True)
    assert verdict(undefined, [3.0]) == (True, False)
    assert verdict(undefined, [1.0]) == (False, True)


def test_bench_of_linear_and_nonlinear_problems_leaves_out_what_does_not_take_them(
    lcp, in_folder, monkeypatch
):
    install(monkeypatch, "liar", liar)
    (in_folder / "market.nl").write_bytes(MARKET)
    (path,) = write(in_folder, "one")
    solvers = "--method auto --method newton --method josephy-newton --peer liar"
    done = lcp(f"bench market.nl {path} {solvers} --budget 0 -o b.json -q")
    assert done.code == 1
    rows = {row.key: row for row in records.read("b.json").measurements}
    assert {key for key, row in rows.items() if row.success} == {
        ("market.nl", "auto"),
        ("market.nl", "josephy-newton"),
        ("one.json", "auto"),
        ("one.json", "newton"),
    }
    assert {key for key, row in rows.items() if row.status == records.EXCLUDED} == {
        ("market.nl", "newton"),
        ("market.nl", "liar"),
        ("one.json", "josephy-newton"),
    }
    assert rows["market.nl", "liar"].statement == "solves linear problems only"
    assert rows["one.json", "liar"].false_success
    assert rows["market.nl", "auto"].curve_of == "residual"
    assert json.loads(Path("b.json").read_text())["cases"][0]["file"].endswith(
        "market.nl"
    )
    assert_refused(
        lcp("bench market.nl --infinity 1e20"),
        "--infinity: ",
    )


CASES = [
    each for each in (*SUITES["stiff"].cases, *SUITES["extreme"].cases) if each.n <= 100
]


@pytest.mark.slow("the whole table of stability")
@pytest.mark.parametrize("each", CASES, ids=lambda each: each.name)
def test_auto_is_right_to_a_hundred_times_the_condition(each):
    problem = prepare(each)
    answer = run_method("auto", problem, 1e-10, 20.0, with_curve=False)
    check = checked(problem, answer, 1e-6)
    assert (check["success"], check["false_success"]) == (True, False)
    assert (accuracy.forward_error(problem, check.get("error")) or 0) <= 100


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_sensitivity_is_what_perturbed_data_show(seed):
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
        moved = np.linalg.solve(
            M - size * signs[:, np.newaxis] * np.abs(M), -q + size * signs * np.abs(q)
        )
        largest = max(largest, float(np.abs(moved - z).max()))
    assert largest == pytest.approx(size * predicted, rel=1e-3)


def test_a_basis_without_an_inverse_in_doubles_has_no_sensitivity():
    assert (
        sensitivity(Problem(np.ones((2, 2)), [-1.0, -1.0]), np.array([0.5, 0.5]))
        is None
    )
    problem = Problem([[1e-320]], [-1e-320], solutions=[[1.0]])
    assert sensitivity(problem, np.ones(1)) is None
    assert checked(
        problem, run_method("auto", problem, 1e-10, 5.0, with_curve=False), 1e-6
    )["success"]
