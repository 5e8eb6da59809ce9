"""lcp make turns programs and games in files into problems, and lcp solve says what their solutions mean."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, from_game, from_qp, read
from lcpcli.errors import ProblemError

from ..conftest import Outcome

Lcp = Callable[..., Outcome]
PROGRAM = {"Q": [[2, 0], [0, 2]], "c": [-3, 1], "A": [[1, 1]], "b": [1]}
GAME = {"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["opera", "football"], "columns": ["left", "right"]}


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder, entered, with program.json and game.json."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "program.json").write_text(json.dumps(PROGRAM))
    (tmp_path / "game.json").write_text(json.dumps(GAME))
    return tmp_path


def remade(lcp: Lcp, option: str, name: str, *arguments: str) -> list[str]:
    """The lines that lcp solve prints on the problem that lcp make makes of a file."""
    assert lcp("make", option, name, "-o", "made.json") == Outcome(0, "", "")
    outcome = lcp("solve", "made.json", *arguments)
    assert (outcome.code, outcome.err) == (0, "")
    return outcome.out.splitlines()


@pytest.mark.usefixtures("files")
def test_minimum_and_multipliers_are_reported(lcp: Lcp) -> None:
    lines = remade(lcp, "--from-qp", "program.json")
    assert lines[0] == "program: n = 3"
    line = lines.index("x = (1.5, 0), y = (0), objective -2.25")
    assert lines[line + 1] == "x is the unique minimizer, as Q is positive definite"


@pytest.mark.usefixtures("files")
def test_strategies_payoffs_and_gains_are_reported(lcp: Lcp) -> None:
    lines = remade(lcp, "--from-game", "game.json")
    assert lines[0] == "game: n = 4"
    line = lines.index("row = (opera 0.6, football 0.4), column = (left 0.4, right 0.6), payoffs 1.2 and 1.2")
    assert lines[line + 1] == "an equilibrium: by a best response the row player would gain 0, the column player 0"


@pytest.mark.usefixtures("files")
def test_every_method_of_a_comparison_is_reported_by_name(lcp: Lcp) -> None:
    remade(lcp, "--from-qp", "program.json")
    lines = lcp("compare", "made.json", "--method", "newton", "--method", "lemke").out.splitlines()
    answer = "x = (1.5, 0), y = (0), objective -2.25"
    assert {f"newton: {answer}", f"lemke: {answer}"} <= set(lines)


@pytest.mark.usefixtures("files")
def test_exact_answers_are_fractions(lcp: Lcp) -> None:
    pytest.importorskip("flint")
    lines = remade(lcp, "--from-game", "game.json", "--exact")
    assert {"exact row = (3/5, 2/5)", "exact column = (2/5, 3/5)"} <= set(lines)
    (line,) = remade(lcp, "--from-qp", "program.json", "--exact", "--format", "json")
    assert json.loads(line)["answer"]["exact"] == {"x": ["3/2", "0"], "y": ["0"]}


@pytest.mark.usefixtures("files")
def test_json_has_the_answer(lcp: Lcp) -> None:
    (line,) = remade(lcp, "--from-qp", "program.json", "--format", "json")
    answer = json.loads(line)["answer"]
    told = ["statement", "proved", "exact", "ray", "certificate", "rows", "columns"]
    assert list(answer) == ["kind", "x", "y", "bound_multipliers", "objective", *told]
    assert (answer["kind"], answer["x"], answer["y"], answer["objective"]) == ("qp", [1.5, 0], [0], -2.25)
    (line,) = remade(lcp, "--from-game", "game.json", "--format", "json")
    answer = json.loads(line)["answer"]
    assert list(answer) == [
        "kind",
        "row",
        "column",
        "payoffs",
        "gains",
        "statement",
        "exact",
        "rows",
        "columns",
    ]
    assert answer["row"] == pytest.approx([0.6, 0.4])
    assert (answer["payoffs"], answer["exact"]) == (pytest.approx([1.2, 1.2]), None)


def test_json_has_no_answer_without_an_origin(lcp: Lcp) -> None:
    assert [json.loads(line)["answer"] for line in lcp("compare", "--format", "json").out.splitlines()] == [None] * 4


@pytest.mark.usefixtures("files")
def test_an_unsolvable_program_is_reported_in_words_and_by_the_exit_code(lcp: Lcp, files: Path) -> None:
    (files / "program.json").write_text('{"Q": [[0]], "c": [1], "A": [[-1]], "b": [1], "name": "no  point"}')
    assert lcp("make", "--from-qp", "program.json", "-o", "made.npz").code == 0
    outcome = lcp("solve", "made.npz")
    assert outcome.code == 3
    assert "the program is infeasible: no x satisfies its constraints" in outcome.out.splitlines()


BAD_PROGRAMS = {
    "[1]": "is a list; give an object with the keys M and q",
    "{": "line 1, column 2: ends too early",
    '{"Q": [[1]]}': "c: is missing; add the objective, c'x",
    '{"Q": [[1]], "c": [1], "q": [1]}': "q: and Q belong to two ways to write a program; give min x'Qx/2 + c'x, row",
    '{"M": [[1]], "q": [1]}': "is not a program; give Q and c, or an MPS file",
    '{"Q": [[1]], "c": []}': "c: is empty",
    '{"Q": 3, "c": [1]}': "Q: is a number; give a list of rows of numbers",
    '{"Q": [[1, 2]], "c": [1]}': "Q: is 1 x 2; make it square",
    '{"Q": [[1]], "c": [1, 2]}': "Q: is 1 x 1 but c has 2 entries; make them agree",
    '{"Q": [[1, 2], [0, 1]], "c": [1, 2]}': "Q[0][1]: makes Q unsymmetric; give (Q + Q') / 2, the same program",
    '{"Q": [[1]], "c": [1], "A": [[1]]}': "row_lower: is missing; give it with A, or leave both out",
    '{"Q": [[1]], "c": [1], "b": [1]}': "A: is missing; give it with b, or leave both out",
    '{"Q": [[1]], "c": [1], "A": [[1, 2]], "b": [1]}': "A: has 2 columns for 1 variable; make them agree",
    '{"Q": [[1]], "c": [1], "A": [[1]], "b": [1, 2]}': "b: has 2 entries for 1 row; make them agree",
    '{"Q": [[1]], "c": [1], "A": [[]], "b": [1]}': "A: has empty rows; give a list of rows of numbers",
    '{"Q": [[1]], "c": [1e999]}': "c[0]: is not a finite number",
    '{"Q": [[1]], "c": [1], "free": 0}': "free: is a number; give a list of indices",
    '{"Q": [[1]], "c": [1], "free": [1]}': "free[0]: is 1; indices are whole numbers from 0 to 0",
    '{"Q": [[1]], "c": [1], "free": [0, 0]}': "free: names an index twice; keep one",
    '{"Q": [[1]], "c": [1], "name": 3}': "name: is a number; give a text",
}
BAD_GAMES = {
    "3": "is a number; give an object with the keys M and q",
    '{"A": [[1]]}': "B: is missing; add the key B",
    '{"A": [[1, 2]], "B": [[1]]}': "B: is 1 x 1 but A is 1 x 2; make them agree",
    '{"A": [[1]], "B": [["x"]]}': "B[0][0]: is the text 'x'; give real numbers",
    '{"A": [[1e308], [-1e308]], "B": [[1], [2]]}': "A: exceeds the double-precision range; scale the payoffs",
    '{"A": [[1]], "B": [[1]], "rows": "x"}': "rows: is the text 'x'; give a list of names",
    '{"A": [[1]], "B": [[1]], "rows": [1]}': "rows[0]: is a number; give a text",
    '{"A": [[1]], "B": [[1]], "columns": ["x", "y"]}': "columns: has 2 names for 1 strategy; make them agree",
    '{"A": [[1]], "B": [[1]], "row": ["x"]}': "row: is not a key of a game; did you mean rows?",
}


@pytest.mark.parametrize(
    ("option", "content", "words"),
    [("--from-qp", *each) for each in BAD_PROGRAMS.items()] + [("--from-game", *each) for each in BAD_GAMES.items()],
)
def test_bad_files_are_reported_in_one_line(option: str, content: str, words: str, lcp: Lcp, files: Path) -> None:
    (files / "bad.json").write_text(content)
    outcome = lcp("make", option, "bad.json", "-o", "made.json")
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert outcome.err.startswith(f"lcp: bad.json: {words}")
    assert not (files / "made.json").exists()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--from-qp program.json murty", "FAMILY: has no effect with --from-qp; leave one out"),
        ("--from-qp program.json -n 3", "-n: has no effect with --from-qp"),
        ("--from-game game.json --seed 3", "--seed: has no effect with --from-game"),
        ("--from-game game.json --set a=3", "--set: has no effect with --from-game"),
        ("--from-game game.json --from-qp program.json", "--from-game: has no effect with --from-qp"),
        ("--list --from-qp program.json", "--from-qp: has no effect with --list"),
        ("--from-qp gone.json", "gone.json: no such file"),
        ("--from-qp program.json -o program.json", "program.json: holds the problem; choose another file"),
        ("--from-qp program.json -o made.xyz", "made.xyz: has the unknown suffix .xyz"),
    ],
)
@pytest.mark.usefixtures("files")
def test_options_without_effect_are_refused(line: str, words: str, lcp: Lcp) -> None:
    outcome = lcp("make", *line.split())
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert words in outcome.err


BAD_ORIGINS = {
    "3": "origin: is a number; give an object with the key kind",
    "{}": "origin.kind: is missing; add one of qp, game",
    '{"kind": "lp"}': "origin.kind: is 'lp'; use one of qp, game",
    '{"kind": 3}': "origin.kind: is a number; use one of qp, game",
    '{"kind": "qp"}': "origin.variables: is not a number of variables; give a whole number from 1",
    '{"kind": "qp", "variables": 1.5}': "origin.variables: is not a number of variables",
    '{"kind": "qp", "variables": 1, "free": [2]}': "origin.free: is not a key",
    '{"kind": "qp", "variables": 1, "size": 2}': "origin.size: is not a key",
    '{"kind": "qp", "variables": 9}': "origin: does not yield this M and q",
    '{"kind": "qp", "variables": 1}': "origin: does not yield this M and q",
    '{"kind": "game", "A": [[1]]}': "origin.B: is missing; add the key B",
    '{"kind": "game", "A": [[1]], "B": [[1]]}': "origin: does not yield this M and q; make the problem again",
}


@pytest.mark.parametrize("ending", ["json", "npz"])
@pytest.mark.parametrize("origin", BAD_ORIGINS)
def test_bad_origins_are_reported_in_one_line(origin: str, ending: str, lcp: Lcp, files: Path) -> None:
    M, q = [[2.0, 1.0], [1.0, 2.0]], [-1.0, -1.0]
    (files / "bad.json").write_text(f'{{"M": {M}, "q": {q}, "origin": {origin}}}')
    np.savez(files / "bad.npz", M=M, q=q, origin=origin)
    outcome = lcp("solve", f"bad.{ending}")
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert outcome.err.startswith(f"lcp: bad.{ending}: {BAD_ORIGINS[origin]}")


def test_an_origin_that_is_no_json_is_reported_in_one_line(lcp: Lcp, files: Path) -> None:
    np.savez(files / "bad.npz", M=[[2.0]], q=[1.0], origin="{")
    outcome = lcp("solve", "bad.npz")
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert outcome.err.startswith("lcp: bad.npz: origin: line 1, column 2: ends too early")


@pytest.mark.parametrize("place", [(0, 1), (0, 2), (2, 1), (2, 2), (3, 3)])
@pytest.mark.parametrize(
    "made", [lambda: from_qp(PROGRAM["Q"], [1, 2], [[1, 1]], [1], row_upper=[2]), lambda: game_of(GAME)]
)
def test_a_changed_matrix_no_longer_fits_its_origin(made: Callable[[], Problem], place: tuple[int, int]) -> None:
    problem = made()
    M = problem.M.copy()
    M[place] += 1
    with pytest.raises(ProblemError, match="origin: does not yield this M and q"):
        Problem(M, problem.q, origin=problem.origin, lower=problem.lower, upper=problem.upper)
    with pytest.raises(ProblemError, match="origin: does not yield this M and q"):
        replace(problem, q=problem.q + np.eye(problem.n)[2])
    with pytest.raises(ProblemError, match="origin: does not yield this M and q"):
        replace(problem, lower=np.eye(problem.n)[2], upper=np.inf)


def test_an_unsymmetric_matrix_comes_from_no_program() -> None:
    with pytest.raises(ProblemError, match="origin: does not yield this M and q"):
        Problem([[1, 2], [0, 1]], [1, 1], origin={"kind": "qp", "variables": 2})


def game_of(data: dict[str, Any]) -> Problem:
    return from_game(data["A"], data["B"])


@pytest.mark.usefixtures("files")
def test_names_come_from_the_file_or_its_content(lcp: Lcp, files: Path) -> None:
    assert json.loads(lcp("make", "--from-qp", "program.json").out)["name"] == "program"
    (files / "program.json").write_text(json.dumps(PROGRAM | {"name": "own", "source": "me", "note": "short"}))
    assert lcp("make", "--from-qp", "program.json", "-o", "made.json").code == 0
    problem = read("made.json")
    assert (problem.name, problem.source, problem.note) == ("own", "me", "short")
