"""`lcp check` verifies an answer on the data, and says which conditions it violates."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
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

EXAMPLE = contents.shipped_path("paper-example-2.json")  # z = (0, 15/29, 17/29, 0), w = (14/29, 0, 0, 99/29)
INFEASIBLE = '{"M": [[0, -0.1], [0, -0.3]], "q": [-0.1, -0.3]}'


@pytest.fixture
def solved(lcp: Callable[..., Any]) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(lcp("solve", EXAMPLE, "--exact", "--format", "json").out)
    return record


@pytest.fixture
def checked(lcp: Callable[..., Any], tmp_path: Path) -> Callable[..., Any]:
    """Write an answer to a file and check it."""

    def run(answer: Any, *options: str, problem: str = EXAMPLE, name: str = "answer") -> Any:
        file = tmp_path / name
        file.write_text(answer if isinstance(answer, str) else json.dumps(answer))
        return lcp("check", problem, str(file), *options)

    return run


@pytest.mark.parametrize(
    "answer",
    [
        "0 15/29 17/29 0",
        "0\n15/29\n17/29\n0\n",
        "z\n0\n15/29\n# the third\n34/58\n0.0\n",
        "0; 15/29; 17/29; 0e0;",
        '[0, "15/29", "17/29", 0.00]',
        '{"z": [0, "15/29", "17/29", 0]}',
        '{"z": [0, "15/29", "17/29", 0]}\n{"z": [1, 2, 3, 4]}\n',
        '{"z": [1, 1, 1, 1], "exact": {"z": ["0", "15/29", "17/29", "0"]}}',
    ],
)
def test_exact_answers_in_every_form(answer: str, checked: Callable[..., Any]) -> None:
    assert checked(answer, "--exact").code == 0
    assert checked(answer).code == 0


def test_rounded_answers_stand_in_doubles_alone(checked: Callable[..., Any]) -> None:
    answer = "0,0.5172413793103449,0.5862068965517241,0"
    assert checked(answer, name="z.csv").code == 0
    assert checked(answer, "--exact").code == 1


def test_npz_and_matrix_market_answers(lcp: Callable[..., Any], tmp_path: Path) -> None:
    np.savez(tmp_path / "z.npz", z=[0, 15 / 29, 17 / 29, 0])
    assert lcp("check", EXAMPLE, str(tmp_path / "z.npz")).code == 0
    (tmp_path / "z.mtx").write_text("%%MatrixMarket matrix array real general\n4 1\n0\n1\n0\n0\n")
    assert lcp("check", EXAMPLE, str(tmp_path / "z.mtx")).code == 1


def test_results_of_solve_are_accepted(checked: Callable[..., Any], solved: dict[str, Any]) -> None:
    assert checked(solved, "--exact").code == 0
    outcome = checked(solved, "--exact", "--format", "json")
    record = json.loads(outcome.out)
    assert (record["accepted"], record["residual"], record["backward_error"], record["violations"]) == (True, 0, 0, [])


@pytest.mark.parametrize("vector", ["z", "w"])
@pytest.mark.parametrize("component", range(4))
@pytest.mark.parametrize("place", range(5))
def test_any_changed_digit_is_refused(
    vector: str, component: int, place: int, checked: Callable[..., Any], solved: dict[str, Any]
) -> None:
    text = solved["exact"][vector][component]
    places = [i for i, mark in enumerate(text) if mark.isdigit()]
    i = places[place % len(places)]
    changed = text[:i] + str((int(text[i]) + 1) % 10) + text[i + 1 :]
    solved["exact"][vector][component] = changed
    outcome = checked(solved, "--exact")
    assert outcome.code == 1
    assert "not an exact solution" in outcome.out or "the given w is not Mz + q" in outcome.out


def test_what_a_wrong_answer_violates_is_reported(checked: Callable[..., Any]) -> None:
    outcome = checked("0 1/2 -1/10 2", "--exact", "--format", "json")
    record = json.loads(outcome.out)
    assert (outcome.code, record["violated"]) == (1, 4)
    found = {v["index"]: (v["kind"], v["z"], v["w"]) for v in record["violations"]}
    assert found == {
        0: ("w < 0", "0", "-19/2"),
        1: ("z w > 0", "1/2", "3/5"),
        2: ("z < 0, w < 0", "-1/10", "-61/10"),
        3: ("z w > 0", "2", "181/10"),
    }
    assert record["residual"] == 9.5
    assert record["backward_error"] is None
    table = checked("0 1/2 -1/10 2").out
    assert "does not solve the problem: its relative residual" in table
    assert "z < 0, w < 0" in table


def test_at_most_ten_violations_are_listed(lcp: Callable[..., Any], tmp_path: Path) -> None:
    writing.write(Problem(np.eye(30), -np.arange(1.0, 31.0)), tmp_path / "p.json")
    (tmp_path / "z.txt").write_text("0 " * 30)
    record = json.loads(lcp("check", str(tmp_path / "p.json"), str(tmp_path / "z.txt"), "--format", "json").out)
    assert (record["violated"], len(record["violations"])) == (30, 10)
    assert "the worst 10 of 30" in lcp("check", str(tmp_path / "p.json"), str(tmp_path / "z.txt"), "--exact").out


def test_tolerance_decides(checked: Callable[..., Any]) -> None:
    answer = "0 0.5172 0.5862 0"
    assert checked(answer).code == 1
    assert checked(answer, "--tol", "1e-3").code == 0


def test_proof_of_infeasibility_is_checked(
    lcp: Callable[..., Any], checked: Callable[..., Any], tmp_path: Path
) -> None:
    problem = tmp_path / "infeasible.json"
    problem.write_text(INFEASIBLE)
    record = json.loads(lcp("solve", str(problem), "--exact", "--format", "json").out)
    for options in ([], ["--exact"]):
        outcome = checked(record, *options, problem=str(problem))
        assert outcome.code == 0
        assert "proved infeasible" in outcome.out
    for y, why in (["0", "-1"], "negative"), (["0", "0"], "q'y"):
        record["exact"]["y"] = y
        outcome = checked(record, "--exact", problem=str(problem))
        assert outcome.code == 1
        assert "y proves nothing" in outcome.out
        assert why in outcome.out
    plain = json.loads(lcp("solve", str(problem), "--format", "json").out)
    assert checked(plain, problem=str(problem)).code == 0
    assert checked(plain, "--exact", problem=str(problem)).code == 0


def test_proof_for_another_problem_is_refused(checked: Callable[..., Any]) -> None:
    answer = {"z": [0] * 4, "certificate": {"kind": "farkas", "vector": [1, 0, 0, 0]}}
    outcome = checked(answer)
    assert outcome.code == 1
    assert "y proves nothing" in outcome.out


def test_rounded_proof_is_corrected_and_an_exact_one_is_not(checked: Callable[..., Any], tmp_path: Path) -> None:
    problem = tmp_path / "p.json"
    problem.write_text('{"M": [[3, -3], [-1, 1]], "q": [-1, 0.25]}')
    rounded = {"z": [0, 0], "certificate": {"kind": "farkas", "vector": [0.333333333333333, 1]}}
    assert checked(rounded, problem=str(problem)).code == 0
    assert checked(rounded, "--exact", problem=str(problem)).code == 0
    claimed = {"z": [0, 0], "exact": {"y": ["333333333333333/1000000000000000", "1"]}}
    assert checked(claimed, "--exact", problem=str(problem)).code == 1


def test_exhaustion_holds_nothing_to_check(checked: Callable[..., Any]) -> None:
    outcome = checked({"z": [0] * 4, "certificate": {"kind": "exhaustion", "vector": None}})
    assert outcome.code == 1
    assert "has no certificate to check; solve it again" in outcome.out


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
        ("[0, true, 1, 2]", "[1]: is true"),
        ('{"w": [0]}', "without z"),
        ('{"z": 3}', "z: is"),
        ('{"z": [0, 1, 2, "x"]}', "z[3]: has 'x'"),
        ('{"z": [1], "exact": {"z": ["1/2"]}}', "exact.z: has 1 entry"),
        ('{"z": [1], "certificate": {"kind": "farkas", "vector": null}}', "certificate.vector: is null"),
        ("[1e-999999999, 1, 2, 3]", "keep exponents"),
        ("0 1e999999999 2 3", "keep exponents"),
        ("{", "ends too early; is the file cut off?"),
    ],
)
def test_bad_answers_are_reported_in_one_line(answer: str, words: str, checked: Callable[..., Any]) -> None:
    outcome = checked(answer)
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert words in outcome.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((EXAMPLE,), "give the file of the problem"),
        ((EXAMPLE, "a", "b", "c"), "give the file of the problem"),
        (("-", "-"), "can be read only once"),
        ((EXAMPLE, "missing.json"), "no such file"),
        ((EXAMPLE, EXAMPLE, "--exact", "--tol", "0.1"), "has no effect with --exact"),
        ((EXAMPLE, EXAMPLE, "--tol", "2"), "out of range"),
    ],
)
def test_bad_usage_is_reported_in_one_line(arguments: tuple[str, ...], words: str, lcp: Callable[..., Any]) -> None:
    outcome = lcp("check", *arguments)
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert words in outcome.err


def test_q_in_a_file_of_its_own(lcp: Callable[..., Any], tmp_path: Path) -> None:
    for name, content in (("M.csv", "0.1,0\n0,0.3\n"), ("q.csv", "-0.1\n-0.1\n"), ("z.csv", "1\n1/3\n")):
        (tmp_path / name).write_text(content)
    assert lcp("check", *(str(tmp_path / name) for name in ("M.csv", "q.csv", "z.csv")), "--exact").code == 0


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys; sys.argv = ['lcp', 'check', '--help']\n"
        "heavy = {'numpy', 'scipy', 'rich', 'flint'}\n"
        "import atexit; atexit.register(lambda: print(sorted({m.split('.')[0] for m in sys.modules} & heavy)))\n"
        "from lcpcli.cli.main import main\n"
        "main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


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


def test_quiet_leaves_the_outcome_to_the_exit_code(checked: Callable[..., Any]) -> None:
    for answer, code in (('[0, "15/29", "17/29", 0]', 0), ("0 0 0 0", 1)):
        outcome = checked(answer, "--exact", "-q")
        assert (outcome.code, outcome.out, outcome.err) == (code, "", "")
    assert checked("0 0", "-q").err.count("\n") == 1


@pytest.mark.parametrize(("numbers", "code"), [("-1,4,0", 0), ("-1,1,1", 1), ("-.5,1,1", 1), ("-1/2,1,1", 1)])
def test_a_solution_given_here_may_begin_with_a_minus_sign(
    lcp: Callable[..., Any], tmp_path: Path, numbers: str, code: int
) -> None:
    path = tmp_path / "p.json"
    path.write_text('{"M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "q": [1, -4, 1], "lower": [null, 0, 0]}')
    for arguments in ((str(path), numbers), (str(path), "--tol", "1e-9", numbers), (str(path), numbers, "--exact")):
        outcome = lcp("check", *arguments)
        assert (outcome.code, outcome.err) == (code, "")
    assert "no option '-x1'" in lcp("check", str(path), "-x1").err
    assert "no option '-x'" in lcp("check", str(path), numbers, "-x").err
    assert "given 2 times" in lcp("check", str(path), numbers, "--tol", "-1", "--tol", "-1").err
