"""Games in two tables of payoffs, by --game of every command that reads problems, with their labels."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files.games import game_in
from lcpcli.model.origins import Game


@pytest.fixture
def tables(tmp_path: Path) -> list[str]:
    """The battle of the sexes in two tables, the first with labels as pandas writes them."""
    (tmp_path / "A.csv").write_text(",left,right\nopera,3,0\nbox,0,2\n")
    (tmp_path / "B.csv").write_text("2;0\n0;3\n")
    return [str(tmp_path / "A.csv"), str(tmp_path / "B.csv")]


def test_tables_of_payoffs_are_taken_by_every_command_with_their_labels(
    tables: list[str], lcp: Callable[..., Any], tmp_path: Path
) -> None:
    pair = "row = (opera 0.6, box 0.4), column = (left 0.4, right 0.6)"
    assert pair in lcp("solve", *tables, "--game", "--method", "newton").out
    assert pair in lcp("check", *tables, "0.6,0.4,0.4,0.6", "--game").out
    assert lcp("check", *tables, "3/5,2/5,2/5,3/5", "--game", "--exact").code == 0
    assert lcp("inspect", *tables, "--game").out.startswith("A: n = 4\n")
    assert "opera" in lcp("compare", *tables, "--game", "--method", "newton").out
    assert lcp("convert", *tables, "--game", "-o", str(tmp_path / "game.json")).code == 0
    assert pair in lcp("solve", str(tmp_path / "game.json"), "--method", "newton").out


@pytest.mark.parametrize("labels", [True, False])
def test_csv_has_the_strategies_as_the_table_has_and_check_reads_it(
    labels: bool, tables: list[str], lcp: Callable[..., Any], tmp_path: Path
) -> None:
    if not labels:
        (tmp_path / "A.csv").write_text("3,0\n0,2\n")
    z = tmp_path / "z.csv"
    assert lcp("solve", *tables, "--game", "--method", "newton", "-o", str(z)).code == 0
    rows = list(csv.DictReader(line for line in z.read_text().splitlines() if not line.startswith("#")))
    names = ["opera", "box", "left", "right"] if labels else ["x1", "x2", "y1", "y2"]
    assert [row["name"] for row in rows] == names
    assert [row["player"] for row in rows] == ["row", "row", "column", "column"]
    assert [round(float(row["probability"]), 9) for row in rows] == [0.6, 0.4, 0.4, 0.6]
    assert [round(float(row["payoff"]), 9) for row in rows] == [1.2] * 4
    assert lcp("check", *tables, "--game", str(z)).code == 0
    for ending in ("md", "tex"):
        lcp("solve", *tables, "--game", "-o", str(tmp_path / f"z.{ending}"))
        text = (tmp_path / f"z.{ending}").read_text()
        assert not labels or all(name in text for name in (*names, "row gets", "column gets"))


def test_csv_of_an_iterate_without_strategies_has_empty_cells(tables: list[str], lcp: Callable[..., Any]) -> None:
    out = lcp("solve", *tables, "--game", "--method", "fixed-point", "--max-iterations", "0", "--format", "csv").out
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
def test_two_tables_that_may_be_a_game_get_a_hint(
    kind: str, lcp: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in zip(("A.csv", "B.csv"), (GAMES | NO_GAMES)[kind], strict=True):
        (tmp_path / name).write_text(text)
    times = int(kind in GAMES)
    for command in (["solve"], ["compare", "--method", "newton"], ["inspect"], ["convert"], ["solve", "--all"]):
        assert lcp(*command, "A.csv", "B.csv").err.count(ADD) == times, command
        assert lcp(*command, "A.csv", "B.csv", "--game").err == "" or kind in NO_GAMES
    assert ADD not in lcp("solve", "A.csv", "B.csv", "-q").err


def test_strategies_below_a_named_corner_keep_their_names(
    tables: list[str], lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "A.csv").write_text("event,left,right\nopera,3,0\nbox,0,2\n")
    assert "row = (opera 0.6, box 0.4)" in lcp("solve", *tables, "--game", "--method", "newton").out


@pytest.mark.parametrize("command", ["inspect", "convert"])
def test_a_single_table_is_no_game(command: str, tables: list[str], lcp: Callable[..., Any]) -> None:
    refused = lcp(command, tables[0], "--game")
    assert (refused.code, "--game: takes two files, not 1" in refused.err) == (2, True)


@pytest.mark.parametrize(
    ("first", "second", "columns"),
    [
        (",0,1\n0,3,0\n1,0,2\n", "2,0\n0,3\n", ()),
        ("left,right\n3,0\n0,2\n", "2,0\n0,3\n", ("left", "right")),
        ("3,0\n0,2\n", "left,right\n2,0\n0,3\n", ("left", "right")),
    ],
    ids=["numbers", "of-A", "of-B"],
)
def test_labels_that_name_the_strategies_are_kept(
    first: str, second: str, columns: tuple[str, ...], tmp_path: Path
) -> None:
    for name, content in (("A.csv", first), ("B.csv", second)):
        (tmp_path / name).write_text(content)
    origin = game_in([str(tmp_path / "A.csv"), str(tmp_path / "B.csv")]).read().origin
    assert isinstance(origin, Game)
    assert (origin.rows, origin.columns) == ((), columns)


def test_other_labels_are_refused(tables: list[str], lcp: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "B.csv").write_text("left,rihgt\n2,0\n0,3\n")
    refused = lcp("solve", *tables, "--game")
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "B.csv: has 'rihgt' among the columns where the other table has 'right'; give both" in refused.err
    (tmp_path / "B.csv").write_text("left,middle,right\n2,0,1\n0,3,1\n")
    assert "B: is 2 x 3 but A is 2 x 2" in lcp("solve", *tables, "--game").err


def test_a_division_by_zero_is_named_by_file_line_and_column(
    tables: list[str], lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "B.csv").write_text("left,right\n2,0\n0,1/0\n")
    assert "B.csv: line 3, column 2: is '1/0', a division by 0; give a number" in lcp("solve", *tables, "--game").err


def test_check_says_what_tolerance_accepts_rounded_strategies_and_how_many_there_are(
    lcp: Callable[..., Any], tmp_path: Path
) -> None:
    game = [str(tmp_path / "A.csv"), str(tmp_path / "B.csv"), "--game"]
    (tmp_path / "A.csv").write_text("3,0,1\n0,2,1\n")
    (tmp_path / "B.csv").write_text("1,0,0\n0,2,0\n")
    rounded = "0.6666667,0.3333333,0.4,0.6,0"
    refused = lcp("check", *game, rounded)
    assert refused.code == 1
    (told,) = re.findall(r"; --tol (\S+) accepts it", refused.out)
    assert float(told) <= 1e-6
    assert lcp("check", *game, rounded, "--tol", told).code == 0
    assert "accepts it" not in lcp("check", *game, "0.7,0.3,0.4,0.6,0").out
    assert "z: has 4 entries for 2 and 3 strategies; make them agree" in lcp("check", *game, "1,0,0,1").err


def test_the_same_labels_in_another_order_are_refused(
    tables: list[str], lcp: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "B.csv").write_text("right,left\n2,0\n0,3\n")
    refused = lcp("solve", *tables, "--game")
    assert refused.code == 2
    assert "B.csv: has the columns right, left, the other table left, right; put them in the same order" in refused.err
