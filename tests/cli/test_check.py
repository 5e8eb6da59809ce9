"""`lcp check` verifies an answer, of a program x alone too, and says which conditions it violates."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.files import contents, writing
from lcpcli.solving.minimum import Minimum

from ..solving.test_programs import SEEDS, program
from .conftest import Lcp, assert_refused, record

EXAMPLE = contents.shipped_path("paper-example-2.json")  # z = (0, 15/29, 17/29, 0), w = (14/29, 0, 0, 99/29)
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'


@pytest.fixture
def checked(lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lcp:
    """Check an answer, a text or an object for a file, to a problem in a file or an object for one."""

    def run(answer: Any, *options: str, problem: Any = EXAMPLE, name: str = "answer") -> Any:
        monkeypatch.chdir(tmp_path)
        if not isinstance(problem, str):
            Path("p.json").write_text(json.dumps(problem))
            problem = "p.json"
        Path(name).write_text(answer if isinstance(answer, str) else json.dumps(answer))
        return lcp("check", problem, name, *options)

    return run


def test_what_is_said_of_answers_is_the_same_as_before(session: Callable[..., None], folder: Path) -> None:
    (folder / "near.json").write_text('{"M": [[2, 1], [1, 2]], "q": [5, -6]}')
    identity = '{"M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "q": [1, -4, 1], "lower": [null, 0, 0]}'
    (folder / "minus.json").write_text(identity)
    session("check")


def test_upper_bound_that_is_violated_is_named(lcp: Lcp) -> None:
    statement = "x is not feasible: cash is 0.6, 0.1 above its upper bound 0.5; 1 other bound violated"
    assert lcp("check", PORTFOLIO, "0.2,0.2,0.6").out.splitlines()[2] == statement


@pytest.mark.parametrize(
    "answer",
    [
        "0\n15/29\n17/29\n0\n",
        "z\n0\n15/29\n# the third\n34/58\n0.0\n",
        "0; 15/29; 17/29; 0e0;",
        '[0, "15/29", "17/29", 0.00]',
        '{"z": [0, "15/29", "17/29", 0]}\n{"z": [1, 2, 3, 4]}\n',
        '{"z": [1, 1, 1, 1], "exact": {"z": ["0", "15/29", "17/29", "0"]}}',
    ],
)
def test_exact_answers_in_every_form(answer: str, checked: Lcp) -> None:
    assert checked(answer, "--exact").code == 0
    assert checked(answer).code == 0


def test_rounded_answers_stand_in_doubles_alone_to_the_tolerance(lcp: Lcp, checked: Lcp, tmp_path: Path) -> None:
    answer = "0,0.5172413793103449,0.5862068965517241,0"
    assert [checked(answer, *options, name="z.csv").code for options in ([], ["--exact"])] == [0, 1]
    assert [checked("0 0.5172 0.5862 0", *options).code for options in ([], ["--tol", "1e-3"])] == [1, 0]
    np.savez(tmp_path / "z.npz", z=[0, 15 / 29, 17 / 29, 0])
    assert lcp("check", EXAMPLE, str(tmp_path / "z.npz")).code == 0
    (tmp_path / "z.mtx").write_text("%%MatrixMarket matrix array real general\n4 1\n0\n1\n0\n0\n")
    assert lcp("check", EXAMPLE, str(tmp_path / "z.mtx")).code == 1


def test_results_of_solve_are_accepted_and_any_changed_digit_is_refused(lcp: Lcp, checked: Lcp) -> None:
    solved = record(lcp("solve", EXAMPLE, "--exact", "--format", "json"))
    found = record(checked(solved, "--exact", "--format", "json"))
    assert (found["accepted"], found["residual"], found["backward_error"], found["violations"]) == (True, 0, 0, [])
    for vector, told in (("z", "not an exact solution"), ("w", "the given w is not Mz + q")):
        for i, text in enumerate(solved["exact"][vector]):
            place = [k for k, mark in enumerate(text) if mark.isdigit()][-1 - i % 2 * text.count("/")]
            changed = text[:place] + str((int(text[place]) + 1) % 10) + text[place + 1 :]
            answer = {
                **solved["exact"],
                vector: [*solved["exact"][vector][:i], changed, *solved["exact"][vector][i + 1 :]],
            }
            outcome = checked(solved | {"exact": answer}, "--exact")
            assert (outcome.code, told in outcome.out) == (1, True), changed


def test_at_most_ten_violations_are_listed(lcp: Lcp, tmp_path: Path) -> None:
    writing.write(Problem(np.eye(30), -np.arange(1.0, 31.0)), tmp_path / "p.json")
    (tmp_path / "z.txt").write_text("0 " * 30)
    found = record(lcp("check", str(tmp_path / "p.json"), str(tmp_path / "z.txt"), "--format", "json"))
    assert (found["violated"], len(found["violations"])) == (30, 10)
    assert "the worst 10 of 30" in lcp("check", str(tmp_path / "p.json"), str(tmp_path / "z.txt"), "--exact").out


def test_proof_of_infeasibility_is_checked(lcp: Lcp, checked: Lcp, tmp_path: Path) -> None:
    problem = tmp_path / "infeasible.json"
    problem.write_text(INFEASIBLE)
    held = record(lcp("solve", str(problem), "--exact", "--format", "json"))
    for options in ([], ["--exact"]):
        outcome = checked(held, *options, problem=str(problem))
        assert (outcome.code, "proved infeasible" in outcome.out) == (0, True)
    for y, why in (["0", "-1"], "negative"), (["0", "0"], "q'y"):
        held["exact"]["y"] = y
        outcome = checked(held, "--exact", problem=str(problem))
        assert (outcome.code, "y proves nothing" in outcome.out, why in outcome.out) == (1, True, True)
    plain = record(lcp("solve", str(problem), "--format", "json"))
    assert checked(plain, problem=str(problem)).code == 0
    assert checked(plain, "--exact", problem=str(problem)).code == 0


def test_an_answer_without_a_proof_of_this_problem_is_refused(checked: Lcp) -> None:
    outcome = checked({"z": [0] * 4, "certificate": {"kind": "farkas", "vector": [1, 0, 0, 0]}})
    assert (outcome.code, "y proves nothing" in outcome.out) == (1, True)
    outcome = checked({"z": [0] * 4, "certificate": {"kind": "exhaustion", "vector": None}})
    assert (outcome.code, "has no certificate to check; solve it again" in outcome.out) == (1, True)


def test_rounded_proof_is_corrected_and_an_exact_one_is_not(checked: Lcp, tmp_path: Path) -> None:
    problem = tmp_path / "p.json"
    problem.write_text('{"M": [[3, -3], [-1, 1]], "q": [-1, 0.25]}')
    rounded = {"z": [0, 0], "certificate": {"kind": "farkas", "vector": [0.333333333333333, 1]}}
    assert checked(rounded, problem=str(problem)).code == 0
    assert checked(rounded, "--exact", problem=str(problem)).code == 0
    claimed = {"z": [0, 0], "exact": {"y": ["333333333333333/1000000000000000", "1"]}}
    assert checked(claimed, "--exact", problem=str(problem)).code == 1


@pytest.mark.usefixtures("folder")
def test_bad_answers_are_reported_in_one_line(session: Callable[[str], None]) -> None:
    session("refused-answers")


PORTFOLIO = contents.shipped_path("programs/portfolio.json")
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


def test_x_at_the_end_of_a_range_is_not_beyond_it_by_rounding() -> None:
    """0.1 + 0.1 + 0.1 is 0.30000000000000004."""
    program = lcpcli.from_qp(np.eye(3), [-5] * 3, [[0.1, 0.1, 0.1]], row_lower=-1, row_upper=0.3)
    assert max(lcpcli.check(program, x).relative_residual for x in ([1, 1, 1], [1, 1, 1, -40])) <= 1e-15


def test_worst_row_is_the_one_violated_most_relative_to_its_terms() -> None:
    program = lcpcli.from_qp([[1, 0], [0, 1]], [1, 1], [[1, 0], [0, 1]], row_lower=[1, 1e6], rows=["small", "large"])
    statement = lcpcli.check(program, [0.5, 1e6 - 10]).statement
    assert statement == "x is not feasible: row small is 0.5, 0.5 below its lower bound 1; 1 other bound violated"


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
    outcome = checked(held, problem=PORTFOLIO)
    assert (outcome.code, outcome.out.splitlines()[2]) == (0, UNIQUE)


def test_wrong_lengths_are_reported_in_one_line(checked: Lcp) -> None:
    for answer, words in (
        ({"x": [1, 2]}, "x: has 2 entries for 3 unknowns; make them agree"),
        ({"x": [1, 2, 3], "y": [1]}, "y: has 1 entry for 2 unknowns; make them agree"),
        ([1, 2], "z: has 2 entries for 6 unknowns; give 3 for x, 5 for x and y or 6 for z"),
    ):
        assert_refused(checked(answer, problem=PORTFOLIO), f"answer: {words}")


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


PROVED = {
    "unbounded": {"c": [-1, -1], "A": [[1, -1]], "b": [-2], "columns": ["up", "out"]},
    "without-x": {"c": [1, 1], "A": [[1, 1]], "row_lower": [3], "upper": 1, "rows": ["both"]},
}


def test_a_proof_is_told_in_terms_of_the_program(session: Callable[..., None], lcp: Lcp, folder: Path) -> None:
    for name, given_too in PROVED.items():
        (folder / f"{name}.json").write_text(json.dumps(given_too))
        assert lcp("solve", f"{name}.json", "-q", "-o", f"{name}.jsonl").code == 3
    session("check-proofs")


def test_of_decimals_that_are_no_doubles_only_what_y_proves_is_told(checked: Lcp) -> None:
    proof = {"z": None, "certificate": {"kind": "farkas", "vector": [1, 1, 0]}}
    outcome = checked(proof, "--exact", problem={"c": [-0.1, -0.1], "A": [[0.1, -0.1]], "b": [-0.2]})
    assert "proved: the program has no minimum: it is infeasible or unbounded below\n" in outcome.out


NAMED = '{{"name": "{}", "M": [[2, 1], [1, 2]], "q": [-5, {}]}}\n'


def test_of_several_results_that_of_the_problem_is_checked_or_none_in_a_log(lcp: Lcp, folder: Path) -> None:
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


def test_of_results_of_one_name_that_of_the_file_is_checked(lcp: Lcp, folder: Path) -> None:
    """Also in a log that another program has written again, without blanks."""
    files = [f"p{i}.json" for i in range(3)]
    for i, name in enumerate(files):
        Path(name).write_text(NAMED.format("trial", -i))
    lcp("solve", *files, "-o", "log.jsonl")
    found = [json.loads(line) for line in Path("log.jsonl").read_text().splitlines()]
    Path("bare.jsonl").write_text("".join(json.dumps(record, separators=(",", ":")) + "\n" for record in found))
    Path("elsewhere").mkdir()
    for name in files:
        Path("elsewhere", name).write_text(Path(name).read_text())
        for file in (name, f"./{name}", str(folder / name), f"elsewhere/{name}"):
            assert (lcp("check", file, "log.jsonl").code, file) == (0, file)
        assert lcp("check", name, "bare.jsonl", "-q").code == 0
    Path("copy.json").write_text(NAMED.format("trial", 0))
    told = "lcp: log.jsonl: has 3 results for trial; give the line of one as a file of its own\n"
    assert_refused(lcp("check", "copy.json", "log.jsonl"), told)


@pytest.mark.parametrize("n", [8, 30])
def test_of_an_ill_posed_problem_the_proof_stands_and_no_solution(n: int, lcp: Lcp, checked: Lcp, folder: Path) -> None:
    """Weights in a row whose rounding leaves a solution: they are chosen so that the exact pivots are positive."""
    M = 2.2 * np.eye(n) - np.diag(np.full(n - 1, 1.1), 1) - np.diag(np.full(n - 1, 1.1), -1)
    M[0, 0], M[-1, -1] = 1.1, np.nextafter(1.1, 2)
    (folder / "ill.json").write_text(json.dumps({"M": M.tolist(), "q": [-1.0] + [0.0] * (n - 1)}))
    solved = lcp("solve", "ill.json", "--format", "json")
    result = record(solved)
    assert (solved.code, result["status"], result["solved"]) == (1, "ill_posed", False)
    assert result["certificate"]["kind"] == "farkas"
    assert [checked(answer, problem="ill.json").code for answer in (result, result["z"])] == [0, 1]
