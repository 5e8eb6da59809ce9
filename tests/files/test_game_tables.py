"""Games in two tables of payoffs, by --game of every command that reads problems, with their labels."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli import read
from lcpcli.files.games import game_in
from lcpcli.model.origins import Game

Lcp = Callable[..., Any]
TABLES = ("A.csv", "B.csv", "--game")
PAIR = "row = (opera 0.6, box 0.4), column = (left 0.4, right 0.6)"


def put(first: str, second: str) -> None:
    Path("A.csv").write_text(first)
    Path("B.csv").write_text(second)


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the battle of the sexes in two tables, the first with labels as pandas writes them."""
    monkeypatch.chdir(tmp_path)
    put(",left,right\nopera,3,0\nbox,0,2\n", "2;0\n0;3\n")


def test_tables_of_payoffs_are_taken_by_every_command_with_their_labels(lcp: Lcp) -> None:
    assert PAIR in lcp("solve", *TABLES, "--method", "newton").out
    assert PAIR in lcp("check", *TABLES, "0.6,0.4,0.4,0.6").out
    assert lcp("check", *TABLES, "3/5,2/5,2/5,3/5", "--exact").code == 0
    assert lcp("inspect", *TABLES).out.startswith("A: n = 4\n")
    assert "opera" in lcp("compare", *TABLES, "--method", "newton").out
    assert lcp("convert", *TABLES, "-o", "game.json").code == 0
    game = read("game.json").origin
    assert isinstance(game, Game)
    assert (game.rows, game.columns) == (("opera", "box"), ("left", "right"))


@pytest.mark.parametrize("labels", [True, False])
def test_csv_has_the_strategies_as_the_table_has_and_check_reads_it(labels: bool, lcp: Lcp) -> None:
    if not labels:
        Path("A.csv").write_text("3,0\n0,2\n")
    assert lcp("solve", *TABLES, "--method", "newton", "-o", "z.csv").code == 0
    rows = list(csv.DictReader(line for line in Path("z.csv").read_text().splitlines() if not line.startswith("#")))
    names = ["opera", "box", "left", "right"] if labels else ["x1", "x2", "y1", "y2"]
    assert [row["name"] for row in rows] == names
    assert [row["player"] for row in rows] == ["row", "row", "column", "column"]
    assert [round(float(row["probability"]), 9) for row in rows] == [0.6, 0.4, 0.4, 0.6]
    assert [round(float(row["payoff"]), 9) for row in rows] == [1.2] * 4
    assert lcp("check", *TABLES, "z.csv").code == 0
    for form in ("markdown", "latex") if labels else ():
        text = lcp("solve", *TABLES, "--format", form).out
        assert all(name in text for name in (*names, "row gets", "column gets"))


def test_csv_of_an_iterate_without_strategies_has_empty_cells(lcp: Lcp) -> None:
    out = lcp("solve", *TABLES, "--method", "fixed-point", "--max-iterations", "0", "--format", "csv").out
    assert out.splitlines()[-1] == "4,0.0,-1.0,right,column,,"


GAMES = {
    "labelled": (",l,r\nu,3,0\nd,0,2\n", ",l,r\nu,2,0\nd,0,3\n"),
    "square": ("3,0\n0,2\n", "2,0\n0,3\n"),
    "labelled below a name": ("firm,low,mid\nenter,3,1\nstay,2,2\n", "firm,low,mid\nenter,1,3\nstay,2,1\n"),
    "labelled like M and q": (",l,c,r\nu,3,0,1\nd,0,2,1\n", ",l,c,r\nu,2,0,1\nd,0,3,1\n"),
    "long": ("3,0\n0,2\n1,1\n", "2,0\n0,3\n1,1\n"),
    "wide": ("3;0;1;2\n0;2;1;2\n", "2;0;1;2\n0;3;1;2\n"),
}
NO_GAMES = {
    "two problems": ("2,1,-1\n1,2,-1\n", "2,1,-1\n1,2,-2\n"),
    "two of pandas": (",a,b,q\n0,2,1,-1\n1,1,2,-1\n", ",a,b,q\n0,2,1,-1\n1,1,2,-1\n"),
    "three q": ("2,1\n1,2\n", "1,2,3\n-1,-2,-3\n"),
    "one q": ("2,1\n1,2\n", "-1\n-2\n"),
}
ADD = "if A.csv and B.csv are the payoffs of a game, add --game"


@pytest.mark.parametrize("kind", [*GAMES, *NO_GAMES])
def test_two_tables_that_may_be_a_game_get_a_hint(kind: str, lcp: Lcp) -> None:
    put(*(GAMES | NO_GAMES)[kind])
    for command in ("solve", "inspect"):
        assert lcp(command, "A.csv", "B.csv").err.count(ADD) == int(kind in GAMES)
        assert lcp(command, "A.csv", "B.csv", "--game").err == "" or kind in NO_GAMES


def test_every_command_gives_the_hint_unless_it_is_quiet(lcp: Lcp) -> None:
    put(*GAMES["square"])
    for command in (["compare", "--method", "newton"], ["convert"], ["solve", "--all"]):
        assert lcp(*command, "A.csv", "B.csv").err.count(ADD) == 1, command
    assert ADD not in lcp("solve", "A.csv", "B.csv", "-q").err


@pytest.mark.parametrize(
    ("first", "second", "rows", "columns"),
    [
        (",0,1\n0,3,0\n1,0,2\n", "2,0\n0,3\n", (), ()),
        ("left,right\n3,0\n0,2\n", "2,0\n0,3\n", (), ("left", "right")),
        ("3,0\n0,2\n", "left,right\n2,0\n0,3\n", (), ("left", "right")),
        ("event,left,right\nopera,3,0\nbox,0,2\n", "2,0\n0,3\n", ("opera", "box"), ("left", "right")),
    ],
    ids=["numbers", "of-A", "of-B", "below-a-named-corner"],
)
def test_labels_that_name_the_strategies_are_kept(
    first: str, second: str, rows: tuple[str, ...], columns: tuple[str, ...]
) -> None:
    put(first, second)
    origin = game_in(["A.csv", "B.csv"]).read().origin
    assert isinstance(origin, Game)
    assert (origin.rows, origin.columns) == (rows, columns)


@pytest.mark.parametrize(
    ("second", "words"),
    [
        ("left,rihgt\n2,0\n0,3\n", "B.csv: has 'rihgt' among the columns where the other table has 'right'; give both"),
        ("left,middle,right\n2,0,1\n0,3,1\n", "B: is 2 x 3 but A is 2 x 2"),
        ("left,right\n2,0\n0,1/0\n", "B.csv: line 3, column 2: is '1/0', a division by 0; give a number"),
        ("right,left\n2,0\n0,3\n", "B.csv: has the columns right, left, the other table left, right; put them in"),
    ],
)
def test_another_table_is_refused(second: str, words: str, lcp: Lcp) -> None:
    Path("B.csv").write_text(second)
    refused = lcp("solve", *TABLES)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert words in refused.err


@pytest.mark.parametrize("command", ["inspect", "convert"])
def test_a_single_table_is_no_game(command: str, lcp: Lcp) -> None:
    refused = lcp(command, "A.csv", "--game")
    assert (refused.code, "--game: takes two files, not 1" in refused.err) == (2, True)


def test_check_says_what_tolerance_accepts_rounded_strategies_and_how_many_there_are(lcp: Lcp) -> None:
    put("3,0,1\n0,2,1\n", "1,0,0\n0,2,0\n")
    rounded = "0.6666667,0.3333333,0.4,0.6,0"
    refused = lcp("check", *TABLES, rounded)
    assert refused.code == 1
    (told,) = re.findall(r"; --tol (\S+) accepts it", refused.out)
    assert float(told) <= 1e-6
    assert lcp("check", *TABLES, rounded, "--tol", told).code == 0
    assert "accepts it" not in lcp("check", *TABLES, "0.7,0.3,0.4,0.6,0").out
    assert "z: has 4 entries for 2 and 3 strategies; make them agree" in lcp("check", *TABLES, "1,0,0,1").err
