"""lcp solve --all: every solution in every format, whether the list is complete, and the exit code."""

from __future__ import annotations

import re
import signal
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

from ..conftest import Outcome
from .conftest import Lcp, assert_refused, record

PROBLEMS = {  # with the vertices, rays and lines of each piece
    "murty": ('{"M": [[1, 2], [2, 1]], "q": [-1, -1]}', [(["0 1"], [], []), (["1 0"], [], []), (["1/3 1/3"], [], [])]),
    "faces": ('{"M": [[0, 1], [0, 0]], "q": [-1, 0]}', [(["0 1"], ["0 1"], []), (["0 1"], ["1 0"], [])]),
    "none": ('{"M": [[0, -1], [1, 0]], "q": [-1, -1]}', []),
    "one": ('{"M": [[2, 1], [1, 2]], "q": [-5, -6]}', [(["4/3 7/3"], [], [])]),
    "line": ('{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}', [(["0 1/10"], [], ["1 0"])]),
}


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, (text, _) in PROBLEMS.items():
        (tmp_path / f"{name}.json").write_text(text)
    (tmp_path / "game.json").write_text('{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]]}')
    (tmp_path / "both.json").write_text('{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]]}')
    return tmp_path


@pytest.fixture
def listed(lcp: Lcp) -> Any:
    """What JSON has of all solutions of a problem."""

    def run(name: str, *options: str) -> dict[str, Any]:
        return record(lcp("solve", f"{name}.json", "--all", *options, "--format", "json"))

    return run


@pytest.mark.parametrize("name", PROBLEMS)
def test_pieces_are_listed_in_fractions_and_proved_to_be_all(name: str, lcp: Lcp) -> None:
    expected = PROBLEMS[name][1]
    outcome = lcp("solve", f"{name}.json", "--all", "--exact", "--format", "json")
    held = record(outcome)
    vertices = [" ".join(each["z"]) for each in held["solutions"]]
    pieces = [
        ([vertices[k] for k in piece["vertices"]], *([" ".join(v) for v in piece[kind]] for kind in ("rays", "lines")))
        for piece in held["pieces"]
    ]
    assert sorted(pieces) == sorted(expected)
    assert (outcome.code, outcome.err) == (0 if expected else 3, "")
    assert (held["complete"], held["status"]) == (True, "complete" if expected else "unsolvable")
    assert len(set(vertices)) == len(vertices)


def test_w_of_a_ray_is_how_w_changes_along_it(lcp: Lcp) -> None:
    Path("ray.json").write_text('{"M": [[0, 0], [3, 0]], "q": [0, 5]}')
    rows = lcp("solve", "ray.json", "--all", "--format", "csv").out.splitlines()
    assert [row for row in rows if ",ray," in row] == ["1,ray,2,1,1.0,0.0", "1,ray,2,2,0.0,3.0"]


@pytest.mark.parametrize("name", ["faces", "none", "line", "game", "both"])
def test_every_format_holds_the_same_solutions(name: str, lcp: Lcp, listed: Any) -> None:
    exact, held = listed(name, "--exact"), listed(name)
    for key in ("z", "w"):
        theirs = [[float(Fraction(value)) for value in each[key]] for each in exact["solutions"]]
        assert [each[key] for each in held["solutions"]] == theirs
    assert lcp("solve", f"{name}.json", "--all", "--format", "csv", "-o", "out.txt").out == ""
    heading, *rows = (line.split(",") for line in Path("out.txt").read_text().splitlines() if not line.startswith("#"))
    if exact["components"] is not None:
        expected = [each["equilibrium"][player] for each in exact["solutions"] for player in ("row", "column")]
        assert heading == ["equilibrium", "player", "strategy", "probability", "payoff"]
        assert [float(row[3]) for row in rows] == [float(Fraction(p)) for part in expected for p in part]
    else:
        assert heading == ["piece", "kind", "number", "component", "z", "w"]
        vertices = sum(len(piece["vertices"]) for piece in exact["pieces"])
        assert sum(row[1] == "vertex" for row in rows) == vertices * exact["n"]
    for form in ("table", "markdown", "latex"):
        assert exact["message"] in lcp("solve", f"{name}.json", "--all", "--format", form).out.replace(r"\{", "{")


def test_equilibria_have_payoffs_indices_subsets_and_components(listed: Any) -> None:
    game, both = listed("game", "--exact"), listed("both")
    told = [each["equilibrium"] for each in game["solutions"]]
    strategies = [(["1", "0"], ["1", "0"]), (["3/5", "2/5"], ["2/5", "3/5"]), (["0", "1"], ["0", "1"])]
    assert [(each["row"], each["column"]) for each in told] == strategies
    assert [each["payoffs"] for each in told] == [["3", "2"], ["6/5", "6/5"], ["2", "3"]]
    assert [each["pure"] for each in told] == [True, False, True]
    assert sum(each["index"] for each in told) == 1
    assert (game["degenerate"], game["components"]) == (False, [[0], [1], [2]])
    assert (both["degenerate"], both["components"]) == (True, [[0, 1]])
    assert [piece["vertices"] for piece in both["pieces"]] == [[0, 1], [0, 2]]


@pytest.mark.parametrize(("name", "extreme"), [("coordination-4", 15), ("winkels", 12)])
def test_shipped_games_have_the_published_numbers_of_equilibria(name: str, extreme: int, lcp: Lcp) -> None:
    outcome = lcp("solve", contents.shipped_path(f"games/{name}.nfg"), "--all", "--format", "json")
    held = record(outcome)
    assert (outcome.code, held["complete"], len(held["solutions"])) == (0, True, extreme)


def test_two_tables_are_the_payoffs_of_a_game_fractions_among_them(lcp: Lcp) -> None:
    for name, text in {"A": "3,0\n0,1/2\n", "B": "2;0\n0;0,1\n", "C": "1,2,3\n"}.items():
        Path(f"{name}.csv").write_text(text)
    outcome = lcp("solve", "A.csv", "B.csv", "--game", "--all", "--exact", "--format", "json")
    told = [each["equilibrium"]["payoffs"] for each in record(outcome)["solutions"]]
    assert told == [["3", "2"], ["3/7", "2/21"], ["1/2", "1/10"]]
    assert "row = " in lcp("solve", "A.csv", "B.csv", "--game").out
    assert_refused(lcp("solve", "A.csv", "--game"), "lcp: --game: takes two files, not 1")
    assert_refused(lcp("solve", "A.csv", "C.csv", "--game"), "make them agree")


def test_objective_of_a_program_has_its_curvature_sense_and_constant(lcp: Lcp, listed: Any) -> None:
    """3 x_1^2 + x_1 x_2 + x_2^2 - 7 x_1 - 3 x_2 + 10 at its minimizer (1, 1), and minus that."""
    held = record(lcp("solve", contents.shipped_path("programs/transport.json"), "--all", "--format", "json"))
    assert {each["objective"] for each in held["solutions"]} == {153.675}
    assert (len(held["solutions"]), len(held["pieces"]), held["complete"]) == (2, 1, True)
    Q, c = np.array([[6, 1], [1, 2]]), np.array([-7, -3])
    for sign, sense in ((1, "min"), (-1, "max")):
        lcpcli.write(lcpcli.from_qp(sign * Q, sign * c, sense=sense, constant=10 * sign), "program.json")
        assert [each["objective"] for each in listed("program")["solutions"]] == [sign * 5]


def test_list_that_is_stopped_says_that_there_may_be_others(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    def shown(*words: str) -> tuple[Outcome, dict[str, Any]]:
        outcome = lcp("solve", *words, "--format", "json")
        return outcome, record(outcome)

    def reading_until_the_limit(_: Input) -> None:
        raise TimeIsUp

    enough, held = shown("murty.json", "--all", "--max-solutions", "2")
    assert (enough.code, held["status"], held["complete"], len(held["pieces"])) == (0, "max_solutions", False, 2)
    assert "there are others" in held["message"]
    late, held = shown("murty.json", "--all", "--time-limit", "1e-9")
    assert (late.code, held["status"], held["complete"]) == (1, "time_limit", False)
    _, game = shown("game.json", "--all", "--max-solutions", "1")
    assert (len(game["pieces"]), len(game["solutions"]), game["components"], game["others"]) == (1, 1, None, True)
    assert game["message"] == "1 equilibrium found, as many as were asked for; there are others"
    monkeypatch.setattr(Input, "exact_parts", reading_until_the_limit)
    late, held = shown("murty.json", "--all", "--time-limit", "9")
    assert (late.code, held["status"]) == (1, "time_limit")


def test_list_as_long_as_was_asked_for_says_that_it_is_complete_if_it_is(lcp: Lcp, listed: Any) -> None:
    for name, pieces in (("murty", 3), ("faces", 2), ("one", 1), ("both", 2)):
        whole, cut = listed(name), listed(name, "--max-solutions", str(pieces))
        assert {**cut, "seconds": 0} == {**whole, "seconds": 0}
        assert (len(cut["pieces"]), cut["complete"], cut["others"]) == (pieces, True, False)
    Path("connected.json").write_text('{"A": [[1, 0], [0, 0], [1, 0]], "B": [[1, 0], [1, 1], [1, 1]]}')
    held = listed("connected", "--max-solutions", "2")
    assert (held["components"], held["others"]) == (None, True)
    assert held["message"].endswith("2 maximal Nash subsets found, as many as were asked for; there are others")
    assert "component" not in lcp("solve", "connected.json", "--all", "--max-solutions", "2").out
    assert "in 1 component, proved to be all" in lcp("solve", "connected.json", "--all").out


@pytest.mark.parametrize(("name", "holding"), [("murty", "0111"), ("faces", "0011"), ("none", "0000")])
def test_picture_marks_the_cones_that_hold_q(
    name: str, holding: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    drawn: list[Cones] = []
    usual = plotting.cones

    def kept(picture: Cones, form: str) -> bytes:
        drawn.append(picture)
        return b"<?xml" if name == "none" else usual(picture, form)

    monkeypatch.setattr(plotting, "cones", kept)
    lcp("solve", f"{name}.json", "--all", "--plot", "cones.svg")
    (picture,) = drawn
    assert Path("cones.svg").read_text().startswith("<?xml")
    assert picture.holding == [mark == "1" for mark in holding]
    assert "1" not in holding or picture.count in lcp("solve", f"{name}.json", "--all").out


@pytest.mark.parametrize("name", ["murty", "both"])
def test_long_table_is_cut_and_says_so(name: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_interrupt_shows_what_was_found(lcp: Lcp, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(search: Solutions) -> Any:
        piece = usual(search)
        if len(search.pieces) == 2:
            signal.raise_signal(signal.SIGINT)
        return piece

    usual = Solutions.__next__
    monkeypatch.setattr(Solutions, "__next__", interrupted)
    outcome = lcp("solve", "murty.json", "--all", "--format", "json")
    held = record(outcome)
    assert (outcome.code, held["status"], len(held["pieces"])) == (130, "interrupted", 2)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(
    ("line", "words"),
    [
        *((f"murty.json --all {it}", f"{it.split()[0]}: has no effect with --all") for it in ("--p 3", "--z0 1,1")),
        *((f"murty.json --all {it}", f"{it.split()[0]}: has no effect with --all") for it in ("--trace", "--jobs 2")),
        ("murty.json --all --method shi", "--method: has no effect with --all"),
        ("murty.json one.json --all", "takes one problem"),
        ("murty.json --all --max-solutions 0", "--max-solutions: 0 is out of range"),
        ("murty.json --max-solutions 3", "without --all"),
        ("murty.json --all --plot cones.doc", "no known suffix"),
        ("bimatrix --all --plot cones.svg", "not a problem with n = 5"),
        ("line.json --all --plot cones.svg", "1 free"),
        ("large.npz --all", "900 unknowns"),
        ("nowhere.json --all", "no such file"),
    ],
)
def test_what_does_not_go_with_all_is_refused_in_a_line(line: str, words: str, lcp: Lcp) -> None:
    if "large" in line:
        assert lcp("make", "obstacle", "-n", "900", "-o", "large.npz").code == 0
    assert_refused(lcp("solve", *line.split()), words)
