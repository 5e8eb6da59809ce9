"""lcp make turns programs and games in files into problems, and lcp solve says what their solutions mean."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lcpcli import from_game, from_qp, read
from lcpcli.errors import ProblemError

from ..conftest import Outcome
from .conftest import EXAMPLE, Lcp, assert_refused, records

PROGRAM = {"Q": [[2, 0], [0, 2]], "c": [-3, 1], "A": [[1, 1]], "b": [1]}
GAME = {"A": [[3, 0], [0, 2]], "B": [[0, 2], [3, 0]], "rows": ["opera", "football"], "columns": ["left", "right"]}


@pytest.fixture(autouse=True)
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


def test_the_minimum_is_reported_and_of_a_comparison_by_each_method(lcp: Lcp) -> None:
    lines = remade(lcp, "--from-qp", "program.json")
    assert lines[0] == "program: n = 3"
    assert lines[1].endswith("; objective -2.25")
    line = lines.index("x = (1.5, 0), y = (0)")
    assert lines[line + 1] == "x is the unique minimizer, as Q is positive definite"
    shown = lcp("compare", "made.json", "--method", "newton", "--method", "lemke").out.splitlines()
    assert {f"{method}: {lines[line]}, objective -2.25" for method in ("newton", "lemke")} <= set(shown)
    (record,) = records(lcp("compare", EXAMPLE, "--method", "newton", "--format", "json"))
    assert record["answer"] is None


def test_strategies_payoffs_and_gains_are_reported(lcp: Lcp) -> None:
    lines = remade(lcp, "--from-game", "game.json", "--exact")
    assert lines[0] == "game: n = 4"
    line = lines.index("row = (opera 0.6, football 0.4), column = (left 0.4, right 0.6), payoffs 1.2 and 1.2")
    assert lines[line + 1] == "an equilibrium: by a best response the row player would gain 0, the column player 0"
    assert {"exact row = (3/5, 2/5)", "exact column = (2/5, 3/5)"} <= set(lines)


def test_json_has_the_answer(lcp: Lcp) -> None:
    (line,) = remade(lcp, "--from-qp", "program.json", "--exact", "--format", "json")
    answer = json.loads(line)["answer"]
    told = ["statement", "proved", "exact", "ray", "certificate", "rows", "columns"]
    assert list(answer) == ["kind", "x", "y", "bound_multipliers", "activities", "slacks", "objective", *told]
    assert (answer["kind"], answer["x"], answer["y"], answer["objective"]) == ("qp", [1.5, 0], [0], -2.25)
    assert answer["exact"] == {"x": ["3/2", "0"], "y": ["0"]}
    (line,) = remade(lcp, "--from-game", "game.json", "--format", "json")
    answer = json.loads(line)["answer"]
    assert list(answer) == ["kind", "row", "column", "payoffs", "gains", "statement", "exact", "rows", "columns"]
    assert answer["row"] == pytest.approx([0.6, 0.4])
    assert (answer["payoffs"], answer["exact"]) == (pytest.approx([1.2, 1.2]), None)


def test_an_unsolvable_program_is_reported_in_words_and_by_the_exit_code(lcp: Lcp, files: Path) -> None:
    (files / "program.json").write_text('{"Q": [[0]], "c": [1], "A": [[-1]], "b": [1], "name": "no  point"}')
    assert lcp("make", "--from-qp", "program.json", "-o", "made.npz").code == 0
    outcome = lcp("solve", "made.npz")
    assert outcome.code == 3
    assert "the program is infeasible: no x satisfies its constraints" in outcome.out.splitlines()


BAD = {
    "--from-qp": {
        "[1]": "is a list; give an object with the keys M and q",
        '{"Q": [[1]], "c": [1], "b": [1]}': "A: is missing; give it with b, or leave both out",
        '{"Q": [[1]], "c": [1], "A": [[]], "b": [1]}': "A: has empty rows; give a list of rows of numbers",
        '{"Q": [[1]], "c": [1e999]}': "c[0]: is not a finite number",
        '{"Q": [[1]], "c": [1], "free": 0}': "free: is a number; give a list of indices",
        '{"Q": [[1]], "c": [1], "free": [0, 0]}': "free: names an index twice; keep one",
        '{"Q": [[1]], "c": [1], "name": 3}': "name: is a number; give a text",
    },
    "--from-game": {
        "3": "is a number; give an object with the keys M and q",
        '{"A": [[1]]}': "B: is missing; add the key B",
        '{"A": [[1, 2]], "B": [[1]]}': "B: is 1 x 1 but A is 1 x 2; make them agree",
        '{"A": [[1]], "B": [["x"]]}': "B[0][0]: is the text 'x'; give real numbers",
        '{"A": [[1e308], [-1e308]], "B": [[1], [2]]}': "A: exceeds the double-precision range; scale the payoffs",
        '{"A": [[1]], "B": [[1]], "rows": "x"}': "rows: is the text 'x'; give a list of names",
        '{"A": [[1]], "B": [[1]], "rows": [1]}': "rows[0]: is a number; give a text",
        '{"A": [[1]], "B": [[1]], "columns": ["x", "y"]}': "columns: has 2 names for 1 strategy; make them agree",
        '{"A": [[1]], "B": [[1]], "row": ["x"]}': "row: is not a key of a game; did you mean rows?",
    },
}


@pytest.mark.parametrize(("option", "text"), [(option, text) for option in BAD for text in BAD[option]])
def test_bad_files_are_reported_in_one_line(option: str, text: str, lcp: Lcp, files: Path) -> None:
    (files / "bad.json").write_text(text)
    assert_refused(lcp("make", option, "bad.json", "-o", "made.json"), f"lcp: bad.json: {BAD[option][text]}")
    assert not (files / "made.json").exists()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--from-qp program.json murty", "FAMILY: has no effect with --from-qp; leave one out"),
        ("--from-qp program.json -n 3", "-n: has no effect with --from-qp"),
        ("--from-game game.json --set a=3", "--set: has no effect with --from-game"),
        ("--from-game game.json --from-qp program.json", "--from-game: has no effect with --from-qp"),
        ("--list --from-qp program.json", "--from-qp: has no effect with --list"),
        ("--from-qp gone.json", "gone.json: no such file"),
    ],
)
def test_options_without_effect_are_refused(line: str, words: str, lcp: Lcp) -> None:
    assert_refused(lcp("make", *line.split()), words)


BAD_ORIGINS = {
    "3": "origin: is a number; give an object with the key kind",
    "{}": "origin.kind: is missing; add one of qp, game",
    '{"kind": "lp"}': "origin.kind: is 'lp'; use one of qp, game",
    '{"kind": 3}': "origin.kind: is a number; use one of qp, game",
    '{"kind": "qp"}': "origin.variables: is not a number of variables; give a whole number from 1",
    '{"kind": "qp", "variables": 1.5}': "origin.variables: is not a number of variables",
    '{"kind": "qp", "variables": 1, "free": [2]}': "origin.free: is not a key",
    '{"kind": "qp", "variables": 9}': "origin: does not yield this M and q",
    '{"kind": "qp", "variables": 1}': "origin: does not yield this M and q",
    '{"kind": "game", "A": [[1]]}': "origin.B: is missing; add the key B",
}


@pytest.mark.parametrize("origin", BAD_ORIGINS)
def test_bad_origins_are_reported_in_one_line(origin: str, lcp: Lcp, files: Path) -> None:
    M, q = [[2.0, 1.0], [1.0, 2.0]], [-1.0, -1.0]
    (files / "bad.json").write_text(f'{{"M": {M}, "q": {q}, "origin": {origin}}}')
    assert_refused(lcp("solve", "bad.json"), f"lcp: bad.json: {BAD_ORIGINS[origin]}")
    np.savez(files / "bad.npz", M=M, q=q, origin=origin)
    assert_refused(lcp("solve", "bad.npz"), f"lcp: bad.npz: {BAD_ORIGINS[origin]}")
    np.savez(files / "bad.npz", M=M, q=q, origin="{")
    assert_refused(lcp("solve", "bad.npz"), "lcp: bad.npz: origin: line 1, column 2: ends too early")


@pytest.mark.parametrize("place", [(0, 1), (0, 2), (2, 2), (3, 3)])
@pytest.mark.parametrize("option", BAD)
def test_a_changed_matrix_no_longer_fits_its_origin(option: str, place: tuple[int, int]) -> None:
    program = from_qp(PROGRAM["Q"], [1, 2], [[1, 1]], [1], row_upper=[2])
    problem = program if option == "--from-qp" else from_game(GAME["A"], GAME["B"])
    M = problem.M.copy()
    M[place] += 1
    unit = np.eye(problem.n)[2]
    for changes in ({"M": M}, {"q": problem.q + unit}, {"lower": unit, "upper": np.inf}):
        with pytest.raises(ProblemError, match="origin: does not yield this M and q"):
            replace(problem, **changes)


def test_names_come_from_the_file_or_its_content(lcp: Lcp, files: Path) -> None:
    assert json.loads(lcp("make", "--from-qp", "program.json").out)["name"] == "program"
    (files / "program.json").write_text(json.dumps(PROGRAM | {"name": "own", "source": "me", "note": "short"}))
    assert lcp("make", "--from-qp", "program.json", "-o", "made.json").code == 0
    problem = read("made.json")
    assert (problem.name, problem.source, problem.note) == ("own", "me", "short")


def test_people_see_activities_slacks_reduced_costs_and_objectives(lcp: Lcp, tmp_path: Path) -> None:
    program = {"c": [3, 2], "A": [[1, 1], [1, 3]], "row_upper": [4, 6], "row_lower": [None, None], "sense": "max"}
    program |= {"rows": ["land", "work"], "columns": ["wheat", "rye"]}
    for name in "ab":
        (tmp_path / f"{name}.json").write_text(json.dumps(program))
    lines = [line.split() for line in lcp("solve", str(tmp_path / "a.json")).out.splitlines()]
    for line in (["land", "4", "0", "3"], ["work", "4", "2", "0"], ["wheat", "4", "0"], ["rye", "0", "-1"]):
        assert line in lines
    answer = json.loads(lcp("solve", str(tmp_path / "a.json"), "--format", "json").out)["answer"]
    assert (answer["activities"], answer["slacks"]) == ([4, 4], [0, 2])
    assert lcp("solve", str(tmp_path)).out.count("objective 12\n") == 2
    assert lcp("solve", str(tmp_path), "--format", "csv").out.count("# objective 12\n") == 2
    assert "-0" not in lcp("solve", str(tmp_path / "a.json")).out.replace("-" * 4, "")
