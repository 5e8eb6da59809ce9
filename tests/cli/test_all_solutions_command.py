"""lcp solve --all: every solution in every format, whether the list is complete, and the exit code."""

from __future__ import annotations

import json
import re
import signal
import threading
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.enumeration.search import Solutions
from lcpcli.files import contents
from lcpcli.files.inputs import Input
from lcpcli.interrupts import TimeIsUp
from lcpcli.report import plotting, solutions
from lcpcli.report.figures.data import Cones

Lcp = Callable[..., Any]
PROBLEMS = {  # with the vertices, rays and lines of each piece
    "murty": ('{"M": [[1, 2], [2, 1]], "q": [-1, -1]}', [(["0 1"], [], []), (["1 0"], [], []), (["1/3 1/3"], [], [])]),
    "faces": ('{"M": [[0, 1], [0, 0]], "q": [-1, 0]}', [(["0 1"], ["0 1"], []), (["0 1"], ["1 0"], [])]),
    "none": ('{"M": [[0, -1], [1, 0]], "q": [-1, -1]}', []),
    "one": ('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}', [(["4/3 7/3"], [], [])]),
    "line": ('{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}', [(["0 1/10"], [], ["1 0"])]),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, (text, _) in PROBLEMS.items():
        (tmp_path / f"{name}.json").write_text(text)
    (tmp_path / "game.json").write_text('{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}')
    (tmp_path / "both.json").write_text('{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]]}')
    return tmp_path


@pytest.mark.parametrize("name", PROBLEMS)
def test_pieces_are_listed_in_fractions_and_proved_to_be_all(name: str, lcp: Lcp, folder: Path) -> None:
    expected = PROBLEMS[name][1]
    outcome = lcp("solve", f"{name}.json", "--all", "--exact", "--format", "json")
    assert folder.is_dir()
    held = json.loads(outcome.out)
    vertices = [" ".join(each["z"]) for each in held["solutions"]]
    pieces = [
        ([vertices[k] for k in piece["vertices"]], *([" ".join(v) for v in piece[kind]] for kind in ("rays", "lines")))
        for piece in held["pieces"]
    ]
    assert sorted(pieces) == sorted(expected)
    assert (outcome.code, outcome.err) == (0 if expected else 3, "")
    assert (held["complete"], held["status"]) == (True, "complete" if expected else "unsolvable")
    assert len(set(vertices)) == len(vertices)


def test_w_of_a_ray_is_how_w_changes_along_it(lcp: Lcp, folder: Path) -> None:
    (folder / "ray.json").write_text('{"M": [[0, 0], [3, 0]], "q": [0, 5]}')
    rows = lcp("solve", "ray.json", "--all", "--format", "csv").out.splitlines()
    assert [row for row in rows if ",ray," in row] == ["1,ray,2,1,1.0,0.0", "1,ray,2,2,0.0,3.0"]


@pytest.mark.parametrize("form", ["table", "json", "csv", "markdown", "latex"])
@pytest.mark.parametrize("name", [*PROBLEMS, "game", "both"])
def test_every_format_holds_the_same_solutions(name: str, form: str, lcp: Lcp, folder: Path) -> None:
    exact = json.loads(lcp("solve", f"{name}.json", "--all", "--exact", "--format", "json").out)
    outcome = lcp("solve", f"{name}.json", "--all", "--format", form, "-o", "out.txt")
    text = (folder / "out.txt").read_text()
    assert outcome.out == ""
    if form == "json":
        held = json.loads(text)
        for ours, theirs in zip(held["solutions"], exact["solutions"], strict=True):
            assert ours["z"] == [float(Fraction(value)) for value in theirs["z"]]
            assert ours["w"] == [float(Fraction(value)) for value in theirs["w"]]
    elif form == "csv":
        rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
        if exact["components"] is not None:
            expected = [each["equilibrium"][player] for each in exact["solutions"] for player in ("row", "column")]
            assert rows[0] == ["equilibrium", "player", "strategy", "probability", "payoff"]
            assert [float(row[3]) for row in rows[1:]] == [float(Fraction(p)) for part in expected for p in part]
            return
        assert rows[0] == ["piece", "kind", "number", "component", "z", "w"]
        vertices = sum(len(piece["vertices"]) for piece in exact["pieces"])
        assert sum(row[1] == "vertex" for row in rows) == vertices * exact["n"]
    else:
        assert exact["message"] in text.replace(r"\{", "{")


def test_equilibria_have_payoffs_indices_subsets_and_components(lcp: Lcp, folder: Path) -> None:
    assert folder.is_dir()
    game = json.loads(lcp("solve", "game.json", "--all", "--exact", "--format", "json").out)
    told = [each["equilibrium"] for each in game["solutions"]]
    assert [(each["row"], each["column"]) for each in told] == [
        (["1", "0"], ["1", "0"]),
        (["3/5", "2/5"], ["2/5", "3/5"]),
        (["0", "1"], ["0", "1"]),
    ]
    assert [each["payoffs"] for each in told] == [["3", "2"], ["6/5", "6/5"], ["2", "3"]]
    assert [each["pure"] for each in told] == [True, False, True]
    assert sum(each["index"] for each in told) == 1
    assert (game["degenerate"], game["components"]) == (False, [[0], [1], [2]])
    both = json.loads(lcp("solve", "both.json", "--all", "--format", "json").out)
    assert (both["degenerate"], both["components"]) == (True, [[0, 1]])
    assert [piece["vertices"] for piece in both["pieces"]] == [[0, 1], [0, 2]]


@pytest.mark.parametrize(("name", "extreme"), [("coordination-4", 15), ("von-stengel-75", 75), ("winkels", 12)])
def test_shipped_games_have_the_published_numbers_of_equilibria(name: str, extreme: int, lcp: Lcp) -> None:
    outcome = lcp("solve", contents.shipped_path(f"games/{name}.nfg"), "--all", "--format", "json")
    held = json.loads(outcome.out)
    assert (outcome.code, held["complete"], len(held["solutions"])) == (0, True, extreme)


def test_two_tables_are_the_payoffs_of_a_game_fractions_among_them(lcp: Lcp, folder: Path) -> None:
    (folder / "A.csv").write_text("3,0\n0,1/2\n")
    (folder / "B.csv").write_text("2;0\n0;0,1\n")
    outcome = lcp("solve", "A.csv", "B.csv", "--game", "--all", "--exact", "--format", "json")
    told = [each["equilibrium"]["payoffs"] for each in json.loads(outcome.out)["solutions"]]
    assert told == [["3", "2"], ["3/7", "2/21"], ["1/2", "1/10"]]
    assert "row = " in lcp("solve", "A.csv", "B.csv", "--game").out
    assert lcp("solve", "A.csv", "--game").err.startswith("lcp: --game: takes two files, not 1")
    (folder / "C.csv").write_text("1,2,3\n")
    assert "make them agree" in lcp("solve", "A.csv", "C.csv", "--game").err


def test_program_has_its_objective(lcp: Lcp) -> None:
    held = json.loads(lcp("solve", contents.shipped_path("programs/transport.json"), "--all", "--format", "json").out)
    assert {each["objective"] for each in held["solutions"]} == {153.675}
    assert (len(held["solutions"]), len(held["pieces"]), held["complete"]) == (2, 1, True)


def test_objective_of_a_quadratic_program_has_its_curvature_sense_and_constant(lcp: Lcp, folder: Path) -> None:
    """3 x_1^2 + x_1 x_2 + x_2^2 - 7 x_1 - 3 x_2 + 10 at its minimizer (1, 1), and minus that."""
    Q, c = np.array([[6, 1], [1, 2]]), np.array([-7, -3])
    for sign, sense in ((1, "min"), (-1, "max")):
        program = lcpcli.from_qp(sign * Q, sign * c, sense=sense, constant=10 * sign)
        lcpcli.write(program, folder / "program.json")
        held = json.loads(lcp("solve", str(folder / "program.json"), "--all", "--format", "json").out)
        assert [each["objective"] for each in held["solutions"]] == [sign * 5]


def reading_until_the_limit(_: Input) -> None:
    raise TimeIsUp


def test_list_that_is_stopped_says_that_there_may_be_others(
    lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert folder.is_dir()
    enough = lcp("solve", "murty.json", "--all", "--max-solutions", "2", "--format", "json")
    held = json.loads(enough.out)
    assert (enough.code, held["status"], held["complete"], len(held["pieces"])) == (0, "max_solutions", False, 2)
    assert "there are others" in held["message"]
    late = lcp("solve", "murty.json", "--all", "--time-limit", "1e-9", "--format", "json")
    held = json.loads(late.out)
    assert (late.code, held["status"], held["complete"]) == (1, "time_limit", False)
    game = json.loads(lcp("solve", "game.json", "--all", "--max-solutions", "1", "--format", "json").out)
    assert (len(game["pieces"]), len(game["solutions"]), game["components"]) == (1, 1, None)
    assert (game["others"], game["message"]) == (
        True,
        "1 equilibrium found, as many as were asked for; there are others",
    )
    monkeypatch.setattr(Input, "exact_parts", reading_until_the_limit)
    late = lcp("solve", "murty.json", "--all", "--time-limit", "9", "--format", "json")
    assert (late.code, json.loads(late.out)["status"]) == (1, "time_limit")


def test_list_as_long_as_was_asked_for_says_that_it_is_complete_if_it_is(lcp: Lcp, folder: Path) -> None:
    (folder / "connected.json").write_text('{"A": [[1, 0], [0, 0], [1, 0]], "B": [[1, 0], [1, 1], [1, 1]]}')
    for name, pieces in (("murty", 3), ("faces", 2), ("one", 1), ("game", 3), ("both", 2)):
        whole, cut = (
            json.loads(lcp("solve", f"{name}.json", "--all", *limit, "--format", "json").out)
            for limit in ((), ("--max-solutions", str(pieces)))
        )
        assert {**cut, "seconds": 0} == {**whole, "seconds": 0}
        assert (len(cut["pieces"]), cut["complete"], cut["others"]) == (pieces, True, False)
    held = json.loads(lcp("solve", "connected.json", "--all", "--max-solutions", "2", "--format", "json").out)
    assert (held["components"], held["others"]) == (None, True)
    assert held["message"].endswith("2 maximal Nash subsets found, as many as were asked for; there are others")
    text = lcp("solve", "connected.json", "--all", "--max-solutions", "2").out
    assert "component" not in text
    assert "in 1 component, proved to be all" in lcp("solve", "connected.json", "--all").out


@pytest.mark.parametrize(
    ("name", "holding"),
    [
        ("murty", [False, True, True, True]),
        ("faces", [False, False, True, True]),
        ("none", [False, False, False, False]),
        ("one", [False, False, False, True]),
    ],
)
def test_picture_marks_the_cones_that_hold_q(
    name: str, holding: list[bool], lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    drawn: list[Cones] = []
    usual = plotting.cones

    def kept(picture: Cones, form: str) -> bytes:
        drawn.append(picture)
        return usual(picture, form)

    monkeypatch.setattr(plotting, "cones", kept)
    lcp("solve", f"{name}.json", "--all", "--plot", "cones.svg")
    (picture,) = drawn
    assert (folder / "cones.svg").read_text().startswith("<?xml")
    assert picture.holding == holding
    assert not any(holding) or picture.count in lcp("solve", f"{name}.json", "--all").out


@pytest.mark.parametrize("name", ["murty", "faces", "game", "both"])
def test_long_table_is_cut_and_says_so(name: str, lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert folder.is_dir()
    whole = lcp("solve", f"{name}.json", "--all").out.split("\n\n")
    monkeypatch.setattr(solutions, "MOST_LINES", 2)
    monkeypatch.setattr(solutions, "MOST_SUBSETS", 1)
    head, rows = lcp("solve", f"{name}.json", "--all").out.split("\n\n")
    assert re.search(r"the first 2 of [34] rows; --format json and csv have all of them", head)
    shown, expected = (
        [line.split() for line in text.splitlines()[:-1] if "--" not in line] for text in (rows, whole[1])
    )
    assert shown[1:] == expected[1:3]
    assert ("{1, 2}, and 1 other:" in head) == (name == "both")


def test_interrupt_shows_what_was_found(lcp: Lcp, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(search: Solutions) -> Any:
        piece = usual(search)
        if len(search.pieces) == 2:
            signal.raise_signal(signal.SIGINT)
        return piece

    assert threading.current_thread() is threading.main_thread()
    usual = Solutions.__next__
    monkeypatch.setattr(Solutions, "__next__", interrupted)
    outcome = lcp("solve", "murty.json", "--all", "--format", "json")
    held = json.loads(outcome.out)
    assert folder.is_dir()
    assert (outcome.code, held["status"], len(held["pieces"])) == (130, "interrupted", 2)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("murty.json --all --method shi", ["--all", "shi", "leave out --method"]),
        ("murty.json --all --p 3", ["--p", "no effect with --all"]),
        ("murty.json --all --z0 1,1", ["--z0", "no effect with --all"]),
        ("murty.json --all --tol 1e-8", ["--tol", "no effect with --all"]),
        ("murty.json --all --trace", ["--trace", "no effect with --all"]),
        ("murty.json --all --bound", ["--bound", "no effect with --all"]),
        ("murty.json --all --jobs 2", ["--jobs", "no effect with --all"]),
        ("murty.json one.json --all", ["--all", "takes one problem"]),
        ("murty.json --all --max-solutions 0", ["--max-solutions", "out of range", ">= 1"]),
        ("murty.json --max-solutions 3", ["--max-solutions", "without --all", "add --all"]),
        ("murty.json --all --plot -", ["--plot", "no known suffix", ".svg"]),
        ("murty.json --all --plot cones.doc", ["--plot", "cones.doc", ".svg"]),
        ("bimatrix --all --plot cones.svg", ["--plot", "two unknowns", "2 x 2 game", "n = "]),
        ("line.json --all --plot cones.svg", ["--plot", "two unknowns", "1 free"]),
        ("murty.json --all -o murty.json", ["murty.json", "holds the problem"]),
        ("large.npz --all", ["large.npz", "900 unknowns", "lcp solve finds one"]),
        ("nowhere.json --all", ["nowhere.json", "no such file"]),
    ],
)
def test_what_does_not_go_with_all_is_refused_in_a_line(
    arguments: str, words: Sequence[str], lcp: Lcp, folder: Path
) -> None:
    if "large" in arguments:
        assert lcp("make", "obstacle", "-n", "900", "-o", str(folder / "large.npz")).code == 0
    outcome = lcp("solve", *arguments.split())
    assert (outcome.code, outcome.out, len(outcome.err.splitlines())) == (2, "", 1), outcome.err
    assert all(word in outcome.err for word in words), outcome.err
