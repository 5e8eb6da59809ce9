"""`lcp check` verifies an answer on the data, and says which conditions it violates."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lcpcli import Problem
from lcpcli.files import contents, writing
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify.verification import verify, verify_exactly

from .. import exact as oracle
from .conftest import Lcp, assert_refused, record

EXAMPLE = contents.shipped_path("paper-example-2.json")  # z = (0, 15/29, 17/29, 0), w = (14/29, 0, 0, 99/29)
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'


@pytest.fixture
def checked(lcp: Lcp, tmp_path: Path) -> Lcp:
    """Write an answer to a file and check it."""

    def run(answer: Any, *options: str, problem: str = EXAMPLE, name: str = "answer") -> Any:
        file = tmp_path / name
        file.write_text(answer if isinstance(answer, str) else json.dumps(answer))
        return lcp("check", problem, str(file), *options)

    return run


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


def test_what_a_wrong_answer_violates_is_reported(checked: Lcp) -> None:
    outcome = checked("0 1/2 -1/10 2", "--exact", "--format", "json")
    held = record(outcome)
    assert (outcome.code, held["violated"], held["residual"], held["backward_error"]) == (1, 4, 9.5, None)
    assert {v["index"]: (v["kind"], v["z"], v["w"]) for v in held["violations"]} == {
        0: ("w < 0", "0", "-19/2"),
        1: ("z w > 0", "1/2", "3/5"),
        2: ("z < 0, w < 0", "-1/10", "-61/10"),
        3: ("z w > 0", "2", "181/10"),
    }
    table = checked("0 1/2 -1/10 2").out
    assert "does not solve the problem: its relative residual" in table
    assert "z < 0, w < 0" in table


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


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("0 1 2", "z: has 3 entries for 4 unknowns"),
        ("0 a 2 3", "line 1, column 2: has 'a', not a number"),
        ("0 1/0 2 3", "not a fraction"),
        ("1 2\n3 4\n", "2 rows and 2 columns without a header"),
        ("# nothing", "z: has 0 entries"),
        ("", "is empty"),
        ("[0, null, 1, 2]", "[1]: is null"),
        ('{"w": [0]}', "without z"),
        ('{"z": 3}', "z: is a number"),
        ('{"z": [1], "exact": {"z": ["1/2"]}}', "exact.z: has 1 entry"),
        ('{"z": [1], "certificate": {"kind": "farkas", "vector": null}}', "certificate.vector: is null"),
        ("[1e-999999999, 1, 2, 3]", "keep exponents"),
        ("0 1e999999999 2 3", "keep exponents"),
        ("nan\n1\n2\n0\n", "not finite"),
        ('{"z": [Infinity, 0, 0, 0]}', "not finite"),
        ("{", "ends too early; is the file cut off?"),
    ],
)
def test_bad_answers_are_reported_in_one_line(answer: str, words: str, checked: Lcp) -> None:
    assert_refused(checked(answer), words)


def test_q_in_a_file_of_its_own(lcp: Lcp, folder: Path) -> None:
    for name, content in (("M.csv", "0.1,0\n0,0.3\n"), ("q.csv", "-0.1\n-0.1\n"), ("z.csv", "1\n1/3\n")):
        (folder / name).write_text(content)
    assert lcp("check", "M.csv", "q.csv", "z.csv", "--exact").code == 0


def test_bad_usage_is_reported_in_one_line(lcp: Lcp) -> None:
    assert_refused(lcp("check", EXAMPLE), "give the file of the problem")
    assert_refused(lcp("check", EXAMPLE, "missing.json"), "no such file")
    assert_refused(lcp("check", EXAMPLE, EXAMPLE, "--exact", "--tol", "0.1"), "has no effect with --exact")


ints = st.integers(-4, 4)


@pytest.mark.slow("many random problems in fractions")
@settings(deadline=None)
@given(st.integers(0, 10**6), st.data())
def test_exact_verification_agrees_with_the_definition(seed: int, data: st.DataObject) -> None:
    problem = oracle.random_problem(seed, 3)
    z = oracle.solution(problem) or [Fraction(0)] * problem.n
    changes = data.draw(st.lists(ints, min_size=problem.n, max_size=problem.n))
    z = [value + Fraction(change, 7) for value, change in zip(z, changes, strict=True)]
    assert verify_exactly(ExactProblem.of_floats(problem), z).accepted == oracle.solves(problem, z)


@settings(deadline=None)
@given(st.integers(1, 4), st.data())
def test_backward_error_is_the_smallest_change_that_makes_z_a_solution(n: int, data: st.DataObject) -> None:
    """With omega the signed worst change makes z a solution; with a little less no change does, row by row."""
    rows = data.draw(st.lists(st.lists(ints, min_size=n, max_size=n), min_size=n, max_size=n))
    q = data.draw(st.lists(ints, min_size=n, max_size=n))
    z = [Fraction(v) for v in data.draw(st.lists(st.integers(0, 3), min_size=n, max_size=n))]
    problem = Problem(rows, q)
    omega = verify_exactly(ExactProblem.of_floats(problem), z).backward_error
    assert omega is not None
    assert verify(problem, np.array(z, dtype=float), 1e-10).backward_error == pytest.approx(omega)
    if omega == 0:
        assert oracle.solves(problem, z)
        return
    for part, mends in ((Fraction(omega) * (1 + Fraction(1, 10**9)), True), (Fraction(omega) * Fraction(9, 10), False)):
        assert (
            all(reachable(row, constant, z, i, part) for i, (row, constant) in enumerate(zip(rows, q, strict=True)))
            == mends
        )


def reachable(row: list[int], constant: int, z: list[Fraction], i: int, omega: Fraction) -> bool:
    """Whether changes of row i by omega, in the extreme, let w_i be 0, or at least 0 where z_i = 0 (z >= 0)."""
    low = sum((a - omega * abs(a)) * v for a, v in zip(row, z, strict=True)) + constant - omega * abs(constant)
    high = sum((a + omega * abs(a)) * v for a, v in zip(row, z, strict=True)) + constant + omega * abs(constant)
    return high >= 0 and (not z[i] or low <= 0)


def test_quiet_leaves_the_outcome_to_the_exit_code(checked: Lcp) -> None:
    for answer, code in (('[0, "15/29", "17/29", 0]', 0), ("0 0 0 0", 1)):
        outcome = checked(answer, "--exact", "-q")
        assert (outcome.code, outcome.out, outcome.err) == (code, "", "")
    assert checked("0 0", "-q").err.count("\n") == 1


@pytest.mark.parametrize(("numbers", "code"), [("-1,4,0", 0), ("-1,1,1", 1), ("-.5,1,1", 1), ("-1/2,1,1", 1)])
def test_a_solution_given_here_may_begin_with_a_minus_sign(lcp: Lcp, tmp_path: Path, numbers: str, code: int) -> None:
    path = tmp_path / "p.json"
    path.write_text('{"M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "q": [1, -4, 1], "lower": [null, 0, 0]}')
    for arguments in ((str(path), numbers), (str(path), "--tol", "1e-9", numbers), (str(path), numbers, "--exact")):
        outcome = lcp("check", *arguments)
        assert (outcome.code, outcome.err) == (code, "")
    assert "lcp: -x1: is no option of lcp check" in lcp("check", str(path), "-x1").err
    assert "lcp: -x: is no option of lcp check" in lcp("check", str(path), numbers, "-x").err
    assert "given 2 times" in lcp("check", str(path), numbers, "--tol", "-1", "--tol", "-1").err
