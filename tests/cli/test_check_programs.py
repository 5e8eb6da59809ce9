"""lcp check takes x of a program alone, or with its multipliers, and says what x is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.files import contents
from lcpcli.solving.answer import Minimum

from ..solving.test_program_forms import SEEDS, program
from .conftest import Lcp, assert_refused, record

PORTFOLIO = contents.shipped_path("programs/portfolio.json")
EXACT_X = "13/62,41/124,57/124"
UNIQUE = "x is the unique minimizer, as Q is positive definite"
SHIPPED = sorted(Path(contents.shipped_path("programs")).glob("*.json"))


def minimum(problem: lcpcli.Problem) -> Minimum:
    answer = lcpcli.run(problem).answer
    assert isinstance(answer, Minimum)
    return answer


@pytest.mark.parametrize("distance", [1e-3, -0.09])
def test_what_is_missing_to_the_minimum_is_said_exactly_where_a_short_step_leads_there(distance: float) -> None:
    """x^2 - 2x has its minimum at 1, and x exceeds it by the square of the distance."""
    verification = lcpcli.check(lcpcli.from_qp([[2]], [-2]), [1 + distance])
    assert not verification.accepted
    assert verification.statement.endswith(f" is at least {distance**2:.2g} above the minimum")


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
def test_gain_that_is_small_beside_the_terms_of_the_objective_is_none(size: float) -> None:
    verification = lcpcli.check(lcpcli.from_qp([[2 * size]], [-2 * size]), [1 + 1e-6])
    statement = "x is feasible to the tolerance 1e-10, but not shown to be a minimizer"
    assert (verification.accepted, verification.statement) == (False, statement)


@pytest.mark.parametrize("problem", [*map(lcpcli.read, SHIPPED), *(lcpcli.from_qp(**program(s)) for s in SEEDS[:5])])
def test_x_alone_and_x_with_its_multipliers_are_accepted_and_a_changed_one_is_not(problem: lcpcli.Problem) -> None:
    answer = minimum(problem)
    alone = lcpcli.check(problem, answer.x)
    both = lcpcli.check(problem, np.concatenate((answer.x, answer.y)))
    assert (alone.accepted, both.accepted) == (True, True)
    assert lcpcli.check(problem, np.concatenate((answer.x, alone.multipliers))).accepted
    changed = lcpcli.check(problem, answer.x + 0.01)
    assert not changed.accepted
    assert changed.statement.startswith("x is ")


def test_statements_say_which_bound_is_violated_and_by_how_much(lcp: Lcp) -> None:
    told = {
        "0.2,0.3,0.4": "x is not feasible: row budget is 0.9, 0.1 below its lower bound 1; 1 other bound violated",
        "0.2,0.2,0.6": "x is not feasible: cash is 0.6, 0.1 above its upper bound 0.5; 1 other bound violated",
        "0.3,0.3,0.4": "x is feasible to the tolerance 1e-10, but not a minimizer: its objective 0.0126 is at least ",
        "0.2096774,0.3306452,0.4596774": "x is feasible to the tolerance 1e-10, but not shown to be a minimizer",
    }
    for x, statement in told.items():
        outcome = lcp("check", PORTFOLIO, x)
        assert (outcome.code, outcome.out.splitlines()[2][: len(statement)]) == (1, statement)
    statement = record(lcp("check", PORTFOLIO, "0.3,0.3,0.4", "--format", "json"))["statement"]
    far = float(statement.split("at least ")[1].split()[0])
    assert 0 < far <= 0.0126 - 0.010997983870967742
    outcome = lcp("check", PORTFOLIO, "0.2096774,0.3306452,0.4596774", "--tol", "1e-6")
    assert outcome.code == 0
    assert outcome.out.splitlines()[2:4] == [UNIQUE, "found y = (budget 0.007741935, return 0.203629)"]


def test_x_at_the_end_of_a_range_is_not_beyond_it_by_rounding() -> None:
    """0.1 + 0.1 + 0.1 is 0.30000000000000004."""
    program = lcpcli.from_qp(np.eye(3), [-5] * 3, [[0.1, 0.1, 0.1]], row_lower=-1, row_upper=0.3)
    assert max(lcpcli.check(program, x).relative_residual for x in ([1, 1, 1], [1, 1, 1, -40])) <= 1e-15


def test_worst_row_is_the_one_violated_most_relative_to_its_terms() -> None:
    program = lcpcli.from_qp([[1, 0], [0, 1]], [1, 1], [[1, 0], [0, 1]], row_lower=[1, 1e6], rows=["small", "large"])
    statement = lcpcli.check(program, [0.5, 1e6 - 10]).statement
    assert statement == "x is not feasible: row small is 0.5, 0.5 below its lower bound 1; 1 other bound violated"


@pytest.mark.parametrize("given", [EXACT_X, f"{EXACT_X},6/775,101/496"])
def test_fractions_are_verified_exactly(given: str, lcp: Lcp) -> None:
    outcome = lcp("check", PORTFOLIO, given, "--exact")
    assert (outcome.code, outcome.out.splitlines()[2]) == (0, UNIQUE)
    wrong = given.replace("13/62", "0.2096774193548387")
    assert lcp("check", PORTFOLIO, wrong, "--exact").code == 1


@pytest.mark.parametrize("keys", ["result", "answer", "x", "x and y"])
def test_answers_in_json_are_read(keys: str, lcp: Lcp, tmp_path: Path) -> None:
    result = record(lcp("solve", PORTFOLIO, "--format", "json"))
    answer = result["answer"]
    held: dict[str, Any] = {
        "result": result,
        "answer": {"z": [1.0], "answer": answer},
        "x": {"x": answer["x"]},
        "x and y": {"x": answer["x"], "y": answer["y"]},
    }[keys]
    (tmp_path / "a.json").write_text(json.dumps(held))
    outcome = lcp("check", PORTFOLIO, str(tmp_path / "a.json"))
    assert (outcome.code, outcome.out.splitlines()[2]) == (0, UNIQUE)


def test_a_rounded_x_is_accepted_by_the_tolerance_that_is_named(lcp: Lcp, tmp_path: Path) -> None:
    program = {"Q": [[6, 1], [1, 2]], "c": [-1, -3], "A": [[1, 3]], "row_upper": [1]}
    (tmp_path / "p.json").write_text(json.dumps(program))
    given = ["check", str(tmp_path / "p.json"), "0,0.33333"]
    assert "; --tol 1e-05 accepts it" in lcp(*given).out
    assert lcp(*given, "--tol", "1e-05").code == 0


def test_wrong_lengths_are_reported_in_one_line(lcp: Lcp, tmp_path: Path) -> None:
    for given, words in {
        '{"x": [1, 2]}': "x: has 2 entries for 3 unknowns; make them agree",
        '{"x": [1, 2, 3], "y": [1]}': "y: has 1 entry for 2 unknowns; make them agree",
        "[1, 2]": "z: has 2 entries for 6 unknowns; give 3 for x, 5 for x and y or 6 for z",
    }.items():
        (tmp_path / "a.json").write_text(given)
        assert_refused(lcp("check", PORTFOLIO, str(tmp_path / "a.json")), f"a.json: {words}")


def test_multipliers_of_a_maximum_have_the_sign_of_the_answer_or_of_z() -> None:
    for bounds in ({"row_upper": [4, 6]}, {"row_lower": [0, -9], "row_upper": [4, 6]}):
        problem = lcpcli.from_qp(None, [3, 2], [[1, 1], [1, 3]], sense="max", **bounds)
        answer = minimum(problem)
        for y in (answer.y, -answer.y):
            found = lcpcli.check(problem, np.concatenate((answer.x, y)))
            assert (found.accepted, found.statement) == (True, "x is a maximizer of the linear program")

    found = lcpcli.check(lcpcli.read(PORTFOLIO), [13 / 62, 41 / 124, 57 / 124, 0.1, 0.2])
    assert (found.accepted, found.statement) == (False, f"{UNIQUE}, but with other multipliers")


def test_stationary_point_is_not_called_a_minimizer() -> None:
    problem = lcpcli.from_qp([[-2, 0], [0, 1]], [1, 0], [[1, 1]], row_lower=-1, row_upper=2)
    found = lcpcli.check(problem, [0.5, 0])
    assert found.accepted
    assert found.statement.startswith("x is a stationary point and need not be a minimizer")


UNBOUNDED = {"c": [-1, -1], "A": [[1, -1]], "b": [-2], "columns": ["up", "out"]}
WITHOUT_X = {"c": [1, 1], "A": [[1, 1]], "row_lower": [3], "upper": 1, "rows": ["both"]}
TOLD = ["the program is unbounded below", "improves without limit in the direction (up 1, out 1)"]
PROVED = ["the program is infeasible: no x satisfies its constraints", "by its rows times (both 1)"]


@pytest.mark.parametrize(("given", "told"), [(UNBOUNDED, TOLD), (WITHOUT_X, PROVED)])
def test_a_proof_is_told_in_terms_of_the_program(
    lcp: Lcp, tmp_path: Path, given: dict[str, Any], told: list[str]
) -> None:
    problem, result = tmp_path / "p.json", tmp_path / "r.json"
    problem.write_text(json.dumps(given))
    lcp("solve", str(problem), "-o", str(result), "-q")
    for exact in ([], ["--exact"]):
        outcome = lcp("check", str(problem), str(result), *exact)
        assert outcome.code == 0
        lines = [line.removeprefix("excluded within the bounds ") for line in outcome.out.splitlines()[1:]]
        assert lines == [f"proved: {told[0]}", told[1]]
    assert record(lcp("check", str(problem), str(result), "--format", "json"))["statement"] == told[0]


def test_of_decimals_that_are_no_doubles_only_what_y_proves_is_told(lcp: Lcp, tmp_path: Path) -> None:
    (tmp_path / "p.json").write_text('{"c": [-0.1, -0.1], "A": [[0.1, -0.1]], "b": [-0.2]}')
    (tmp_path / "y.json").write_text('{"z": null, "certificate": {"kind": "farkas", "vector": [1, 1, 0]}}')
    outcome = lcp("check", str(tmp_path / "p.json"), str(tmp_path / "y.json"), "--exact")
    assert "proved: the program has no minimum: it is infeasible or unbounded below\n" in outcome.out
