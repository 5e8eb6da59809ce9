"""A known solution that is wrong is reported and not believed; one that is only rounded is."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lcpcli import Problem, read
from lcpcli.bench.suites import SUITES, problem_of
from lcpcli.files import contents
from lcpcli.verify.point import without_wrong_solutions

from ..conftest import Outcome

Lcp = Callable[..., Outcome]
LARGEST = 500  # unknowns
WRONG = '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "solution": [[1, 1], [1.33333, 2.33333]]}'
ALL_WRONG = '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "solution": [1, 1], "verdict": "infeasible"}'
LINE = "lcp: {}: solution{}: is not a solution: its residual is 3, with z2 = 1 and w2 = -3; it is ignored\n"


@cache
def problems() -> list[Problem]:
    """Those that are shipped, and one of each gallery problem that the suites have, with known solutions."""
    shipped = ("paper-example-1.json", "paper-example-2.json", "bimatrix.json", "tridiagonal-100.json")
    cases = {case.name: case for suite in SUITES.values() for case in suite.cases if case.n <= LARGEST}
    made = [read(contents.shipped_path(name)) for name in shipped] + [*map(problem_of, cases.values())]
    return [problem for problem in made if isinstance(problem, Problem) and problem.solutions]


@pytest.mark.parametrize("digits", ["17g", "4g", "4f"])
def test_solutions_as_computed_and_as_printed_are_accepted(digits: str) -> None:
    for problem in problems():
        printed = tuple(np.array([float(f"{v:.{digits}}") for v in z]) for z in problem.solutions)
        assert without_wrong_solutions(replace(problem, solutions=printed))[1] == [], problem.name


def test_solutions_with_an_error_in_the_first_digit_are_wrong() -> None:
    for problem in problems():
        z = problem.solutions[0]
        if z.any() and "growth" not in problem.name:  # its largest component hides the others
            other = z + 0.3 * np.abs(z).max() * (z > 0)
            kept, faults = without_wrong_solutions(replace(problem, solutions=(other,)))
            assert (kept.solutions, len(faults)) == ((), 1), problem.name


@pytest.mark.parametrize(
    ("q", "z", "is_right"),
    [
        ([-1, -1.7e-5], [1, 1.2345e-5], False),  # its last digit is worth 1e-9
        ([-1, -1.23454e-5], [1, 1.2345e-5], True),
        ([-1.5e16, -3.4], [1.5e16, 3], True),  # the last digit of 3 is worth 1
    ],
)
def test_last_digit_of_a_solution_is_where_the_exponent_puts_it(q: list[float], z: list[float], is_right: bool) -> None:
    problem = Problem(np.eye(2), q, solutions=[np.array(z, dtype=float)])
    assert (without_wrong_solutions(problem)[1] == []) == is_right


def test_a_wrong_solution_is_reported_and_the_others_are_kept(tmp_path: Path, lcp: Lcp) -> None:
    file = tmp_path / "p.json"
    file.write_text(WRONG)
    outcome = lcp("solve", str(file), "--format", "json")
    assert (outcome.code, outcome.err) == (0, LINE.format(file, "[0]"))
    assert 1e-6 < json.loads(outcome.out)["error"] < 1e-5, "to the one of six digits"
    assert lcp("solve", str(file), "--quiet").err == ""


@pytest.mark.parametrize("line", ["solve {} --exact", "compare {}", "check {} 4/3,7/3", "inspect {}"])
def test_every_command_reports_it_and_does_not_measure_errors_against_it(tmp_path: Path, lcp: Lcp, line: str) -> None:
    file = tmp_path / "p.json"
    file.write_text(ALL_WRONG)
    outcome = lcp(*line.format(file).split())
    assert (outcome.code, outcome.err) == (0, LINE.format(file, ""))
    assert "solution (1, 1)" not in outcome.out
    assert "\nerror " not in outcome.out


def test_a_verdict_is_not_believed_if_there_is_a_solution(tmp_path: Path, lcp: Lcp) -> None:
    file = tmp_path / "p.json"
    file.write_text(ALL_WRONG)
    told = "the verdict of the problem, infeasible, is wrong: z is a solution to the tolerance 1e-10"
    for line in ("solve {}", "compare {} --method newton --method lemke"):
        shown = lcp(*line.format(file).split()).out
        assert "known to be infeasible" not in shown
        assert shown.count(told) == 1
    outcome = lcp("bench", str(file), "--method", "newton", "--budget", "0", "--format", "json")
    row = json.loads(outcome.out)["measurements"][0]
    assert (outcome.code, row["success"], row["false_success"]) == (0, True, False)
    assert outcome.err.startswith(LINE.format(file, "")), "and the progress of the bench"
    file.write_text('{"M": [[-1]], "q": [-1], "verdict": "infeasible"}')
    outcome = lcp("solve", str(file))
    assert (outcome.code, "known to be infeasible" in outcome.out) == (3, True)
