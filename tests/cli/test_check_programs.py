"""lcp check takes x of a program, with its multipliers or alone, logs of many results, and what is no answer."""

from __future__ import annotations

import json
import re
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


@pytest.fixture
def checked(lcp: Lcp, folder: Path) -> Lcp:
    """Check an answer, typed or an object for a file, to a problem, in a file or an object or text for one."""

    def run(problem: Any, answer: Any, *options: str) -> Any:
        if not isinstance(problem, str) or problem.startswith("{"):
            (folder / "p.json").write_text(problem if isinstance(problem, str) else json.dumps(problem))
            problem = "p.json"
        if not isinstance(answer, str):
            (folder / "a.json").write_text(json.dumps(answer))
            answer = "a.json"
        return lcp("check", problem, answer, *options)

    return run


def minimum(problem: lcpcli.Problem) -> Minimum:
    answer = lcpcli.run(problem).answer
    assert isinstance(answer, Minimum)
    return answer


@pytest.mark.parametrize("distance", [1e-3, -0.09])
def test_what_is_missing_to_the_minimum_is_said_exactly_where_a_short_step_leads_there(distance: float) -> None:
    """x^2 - 2x has its minimum at 1, and x exceeds it by the square of the distance."""
    verification = lcpcli.check(lcpcli.from_qp([[2]], [-2]), [1 + distance])
    assert not verification.accepted
    (gain,) = re.findall(r" is at least (\S+) above the minimum$", verification.statement)
    assert 0.95 * distance**2 <= float(gain) <= distance**2


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
def test_answers_in_json_are_read(keys: str, lcp: Lcp, checked: Lcp) -> None:
    result = record(lcp("solve", PORTFOLIO, "--format", "json"))
    answer = result["answer"]
    held: dict[str, Any] = {
        "result": result,
        "answer": {"z": [1.0], "answer": answer},
        "x": {"x": answer["x"]},
        "x and y": {"x": answer["x"], "y": answer["y"]},
    }[keys]
    outcome = checked(PORTFOLIO, held)
    assert (outcome.code, outcome.out.splitlines()[2]) == (0, UNIQUE)


def test_a_rounded_x_is_accepted_by_the_tolerance_that_is_named(checked: Lcp) -> None:
    program = {"Q": [[6, 1], [1, 2]], "c": [-1, -3], "A": [[1, 3]], "row_upper": [1]}
    assert "; --tol 1e-05 accepts it" in checked(program, "0,0.33333").out
    assert checked(program, "0,0.33333", "--tol", "1e-05").code == 0


def test_wrong_lengths_are_reported_in_one_line(checked: Lcp) -> None:
    for given, words in (
        ({"x": [1, 2]}, "x: has 2 entries for 3 unknowns; make them agree"),
        ({"x": [1, 2, 3], "y": [1]}, "y: has 1 entry for 2 unknowns; make them agree"),
        ([1, 2], "z: has 2 entries for 6 unknowns; give 3 for x, 5 for x and y or 6 for z"),
    ):
        assert_refused(checked(PORTFOLIO, given), f"a.json: {words}")


def test_multipliers_of_a_maximum_have_the_sign_of_the_answer_or_of_z_and_wrong_ones_are_told() -> None:
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
    lcp: Lcp, checked: Lcp, given: dict[str, Any], told: list[str]
) -> None:
    Path("p.json").write_text(json.dumps(given))
    result = record(lcp("solve", "p.json", "--format", "json"))
    for exact in ([], ["--exact"]):
        outcome = checked("p.json", result, *exact)
        assert outcome.code == 0
        lines = [line.removeprefix("excluded within the bounds ") for line in outcome.out.splitlines()[1:]]
        assert lines == [f"proved: {told[0]}", told[1]]
    assert record(checked("p.json", result, "--format", "json"))["statement"] == told[0]


def test_of_decimals_that_are_no_doubles_only_what_y_proves_is_told(checked: Lcp) -> None:
    proof = {"z": None, "certificate": {"kind": "farkas", "vector": [1, 1, 0]}}
    outcome = checked({"c": [-0.1, -0.1], "A": [[0.1, -0.1]], "b": [-0.2]}, proof, "--exact")
    assert "proved: the program has no minimum: it is infeasible or unbounded below\n" in outcome.out


EXAMPLE = contents.shipped_path("paper-example-2.json")
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'


@pytest.mark.parametrize(("digits", "tol"), [(6, "1e-06"), (9, "1e-09")])
def test_least_power_of_ten_is_named_that_accepts_a_rounded_answer(digits: int, tol: str, lcp: Lcp) -> None:
    assert_refused(lcp("check", EXAMPLE, "0,1"))
    answer = f"0,{15 / 29:.{digits}f},{17 / 29:.{digits}f},0"
    assert f"; --tol {tol} accepts it" in lcp("check", EXAMPLE, answer).out


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}', ["1,4/3,0", "2,7/3,0"]),
        ('{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}', ["1,1/8,0,x1,row,3/5,6/5", "3,1/12,0,y1,column,2/5,6/5"]),
        ('{"Q": [[3]], "c": [-1]}', ["1,1/3,0,x,1/3,0.0,,"]),
    ],
    ids=["problem", "game", "program"],
)
def test_csv_of_exact_answers_has_fractions_which_check_reads(
    text: str, cells: list[str], lcp: Lcp, tmp_path: Path
) -> None:
    file, solution = str(tmp_path / "p.json"), str(tmp_path / "z.csv")
    (tmp_path / "p.json").write_text(text)
    assert lcp("solve", file, "--method", "newton", "--exact", "-o", solution).code == 0
    lines = Path(solution).read_text().splitlines()
    assert [line for line in lines if line in cells] == cells, lines
    assert lcp("check", file, solution, "--exact").code == 0


def test_tolerance_has_no_effect_on_a_proof(lcp: Lcp, checked: Lcp) -> None:
    Path("p.json").write_text(INFEASIBLE)
    proof = record(lcp("solve", "p.json", "--format", "json"))
    assert proof["certificate"]["kind"] == "farkas"
    assert [checked("p.json", proof, *options).code for options in ([], ["--tol", "1e-3"])] == [0, 2]


NAMED = '{{"name": "{}", "M": [[2, 1], [1, 2]], "q": [-5, {}]}}\n'


def test_of_several_results_that_of_the_problem_is_checked_and_a_log_without_it_is_refused(
    lcp: Lcp, folder: Path
) -> None:
    lines = [NAMED.format(f"s{i}", -i) for i in range(3)]
    Path("many.jsonl").write_text("".join(lines))
    lcp("solve", "many.jsonl", "-o", "log.jsonl")
    for line in lines:
        Path("one.json").write_text(line)
        outcome = lcp("check", "one.json", "log.jsonl")
        assert (outcome.code, outcome.err) == (0, ""), line
    Path("other.json").write_text(lines[0].replace("s0", "another"))
    told = "lcp: log.jsonl: has no results for another; give the line of one as a file of its own\n"
    assert_refused(lcp("check", "other.json", "log.jsonl", "-q"), told)
    (folder / "bare.jsonl").write_text('{"z": [1, 2]}\n{"z": [3, 4]}\n')
    assert "the first of 2 results is checked" in lcp("check", "other.json", "bare.jsonl").err
    assert lcp("check", "other.json", "bare.jsonl", "-q").err == ""


def test_of_results_of_one_name_that_of_the_file_or_of_its_content_is_checked(lcp: Lcp, folder: Path) -> None:
    """Also in a log that another program has written again, without blanks."""
    files = [f"p{i}.json" for i in range(3)]
    for i, name in enumerate(files):
        Path(name).write_text(NAMED.format("trial", -i))
    Path("lines.jsonl").write_text("".join(NAMED.format("trial", -i) for i in range(3)))
    lcp("solve", *files, "-o", "log.jsonl")
    lcp("solve", "lines.jsonl", "-o", "log-of-lines.jsonl")
    found = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    Path("bare.jsonl").write_text("".join(json.dumps(record, separators=(",", ":")) + "\n" for record in found))
    Path("elsewhere").mkdir()
    for name in files:
        content = Path(name).read_text()
        Path("elsewhere", name).write_text(content.replace("2, 1", "2,1"))  # with another digest
        Path("copy.json").write_text(content)
        for file in (name, f"./{name}", str(folder / name), "copy.json", f"elsewhere/{name}"):
            assert (lcp("check", file, "log.jsonl").code, file) == (0, file)
        assert lcp("check", name, "log-of-lines.jsonl").code == 0
        assert lcp("check", name, "bare.jsonl", "-q").code == 0
    told = "lcp: log-of-lines.jsonl: has 3 results for trial; give the line of one as a file of its own\n"
    assert_refused(lcp("check", "elsewhere/p0.json", "log-of-lines.jsonl"), told)


@pytest.mark.parametrize(("z", "told"), [("3,3", False), ("1e-6,3", True)])
def test_a_point_on_the_bounds_is_told_only_where_it_is_near(z: str, told: bool, checked: Lcp) -> None:
    outcome = checked({"M": [[2, 1], [1, 2]], "q": [5, -6]}, z)
    assert (outcome.code, "put on their bounds" in outcome.out) == (1, told)


@pytest.mark.parametrize("n", [8, 30])
def test_of_an_ill_posed_problem_the_proof_stands_and_the_solution_does_not(n: int, lcp: Lcp, checked: Lcp) -> None:
    """Weights in a row whose rounding leaves a solution: they are chosen so that the exact pivots are positive."""
    M = 2.2 * np.eye(n) - np.diag(np.full(n - 1, 1.1), 1) - np.diag(np.full(n - 1, 1.1), -1)
    M[0, 0], M[-1, -1] = 1.1, np.nextafter(1.1, 2)
    Path("p.json").write_text(json.dumps({"M": M.tolist(), "q": [-1.0] + [0.0] * (n - 1)}))
    solved = lcp("solve", "p.json", "--format", "json")
    result = record(solved)
    assert (solved.code, result["status"], result["solved"]) == (1, "ill_posed", False)
    assert result["certificate"]["kind"] == "farkas"
    assert [checked("p.json", answer).code for answer in (result, result["z"])] == [0, 1]
