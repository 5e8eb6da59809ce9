"""Games in files: in Gambit's .nfg form, and in two tables of payoffs by --game of every command."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from lcpcli import errors, read
from lcpcli.files import contents
from lcpcli.files.games import game_in
from lcpcli.model.origins import Game

from ..conftest import read_exact

Lcp = Callable[..., Any]
HEAD = 'NFG 1 R "a game" { "Alice" "Bob" }\n'
PAYOFFS = HEAD + '{ { "up" "down" } { "left" "mid" "right" } }\n"a comment"\n1 2 3 4\n1/3 -0.5, 1e1 .25\n0 0 -7/2 +1\n'
COUNTS = HEAD + "{ 2 3 }\n" + PAYOFFS.partition('"a comment"\n')[2]
OUTCOMES = HEAD + (
    '{ { "up" "down" } { "left" "mid" "right" } }\n'
    '{ { "one" 1 2 } { "" 3, 4 } { "with \\"quotes\\"" 1/3 -0.5 } { 10 .25 } { "" -7/2 1 } }\n1 2 3 4 0 5\n'
)
A = [[1, Fraction(1, 3), 0], [3, 10, Fraction(-7, 2)]]
B = [[2, Fraction(-1, 2), 0], [4, Fraction(1, 4), 1]]


def game_of(path: Path, text: str) -> Game:
    path.write_text(text)
    problem = read(path)
    assert problem.name == "a game"
    assert isinstance(problem.origin, Game)
    return problem.origin


@pytest.mark.parametrize("text", [PAYOFFS, COUNTS, OUTCOMES], ids=["payoffs", "counts", "outcomes"])
def test_all_versions_have_the_payoffs_with_the_first_player_in_the_rows(text: str, tmp_path: Path) -> None:
    game = game_of(tmp_path / "g.nfg", text)
    assert game.payoffs() == (A, B)
    assert game.columns in ((), ("left", "mid", "right"))


def test_it_is_recognized_by_its_first_word_and_numbers_are_no_names_of_strategies(tmp_path: Path) -> None:
    assert game_of(tmp_path / "g.txt", PAYOFFS).rows == ("up", "down")
    game = game_of(tmp_path / "g.nfg", HEAD + '{ { "1" "2" } { "b" } } 1 1 2 2')
    assert (game.rows, game.columns) == ((), ("b",))


def test_fractions_are_not_rounded_for_proofs(tmp_path: Path) -> None:
    (tmp_path / "g.nfg").write_text(HEAD + "{ 1 2 } 1/3 1 2/3 2")
    assert read_exact(str(tmp_path / "g.nfg")).is_solution([Fraction(1), Fraction(0), Fraction(3)])


def test_the_shipped_games_are_read() -> None:
    shapes = [read(file).n for file in sorted(Path(contents.shipped_path("games")).glob("*.nfg"))]
    assert shapes == [8, 12, 8]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD.replace('"Bob"', '"Bob" "Cy"') + "{ 1 1 1 } 1 2 3", "is a game of more than two players; its equilibria"),
        (HEAD.replace('"Bob"', "") + "{ 1 } 1", "is a game of 1 player; give one of two players"),
        (HEAD + "{ 2 2 } 1 2 3 4 5 6", "ends too early; is it cut off?"),
        (HEAD + "{ 2 2 } 1 2 3 4 5 6 7", "has an odd number of payoffs; give two for each pair"),
        (HEAD + "{ 2 2", "has braces that do not match; is it cut off?"),
        (HEAD + "{ 1 1 }\n1 2\n3 4", "has more than the payoffs of 1 x 1 strategies; remove the others"),
        (HEAD + "{ 1 1 }\n1 x", "has 'x', not a number; give a number"),
        (HEAD + "{ 1 1 }\n1 1/0", "has '1/0', not a fraction; give whole numbers, as in 15/29"),
        (HEAD + '{ 1 1 }\n{ { "" 1 2 } }\n2', "names outcome 2 of 1; name one that is given"),
        (HEAD + "{ 0 1 }", "has a player without strategies; give each at least one"),
        (HEAD + "{ 1 1 }\n{ 1 2 }\n1", "has '1' in place of an outcome; give two payoffs in braces"),
        ("NFG 2 R", "line 1: is not the beginning of a game; begin the file with NFG 1 R"),
        ("NFG 1 R title", "has no title, players and strategies; write NFG 1 R"),
        (HEAD + "{ 1 1 }\n1e400 0", "A[0][0]: is not a finite number in double precision"),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_its_place(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "g.nfg").write_text(text)
    with pytest.raises(errors.ProblemError) as caught:
        read(tmp_path / "g.nfg")
    assert str(caught.value).startswith(f"{tmp_path / 'g.nfg'}: {message}")


def test_it_is_only_read(lcp: Lcp, tmp_path: Path) -> None:
    done = lcp("convert", contents.shipped_path("games/winkels.nfg"), "-o", str(tmp_path / "w.nfg"))
    assert (done.code, "is of a format that is only read" in done.err) == (2, True)
    assert lcp("convert", contents.shipped_path("games/winkels.nfg"), "-o", str(tmp_path / "w.json")).code == 0
    again = read(tmp_path / "w.json").origin
    assert isinstance(again, Game)
    assert again.payoffs()[0][4][0] == Fraction(5, 2)


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


def test_players_of_a_file_are_named_and_costs_are_minimized(tmp_path: Path, lcp: Any) -> None:
    text = 'NFG 1 R "g" { "Ann" "Bob" } { { "up" "down" } { "left" "right" } } 3 2 0 0 0 0 2 3'
    (tmp_path / "g.nfg").write_text(text)
    out = lcp("solve", str(tmp_path / "g.nfg"), "--method", "newton").out
    assert "Ann = (up 0.6, down 0.4), Bob = (left 0.4, right 0.6), payoffs 1.2 and 1.2" in out
    assert "Ann gets Bob gets" in out
    assert "by a best response Ann would gain 0, Bob 0" in out
    assert lcp("convert", str(tmp_path / "g.nfg"), "-o", str(tmp_path / "g.json")).code == 0
    assert json.loads((tmp_path / "g.json").read_text())["players"] == ["Ann", "Bob"]
    assert "Ann gets  Bob gets" in lcp("solve", str(tmp_path / "g.nfg"), "--all").out
    costs = {"A": [["1/3", 0], [0, 2]], "B": [[2, 0], [0, 3]]}
    negated = {"A": [["-1/3", 0], [0, -2]], "B": [[-2, 0], [0, -3]]}
    (tmp_path / "costs.json").write_text(json.dumps(costs | {"sense": "min", "players": ["Ann", "Bob"]}))
    (tmp_path / "payoffs.json").write_text(json.dumps(negated))
    cost, payoff = (read(tmp_path / f"{name}.json") for name in ("costs", "payoffs"))
    assert cost.M.tolist() == payoff.M.tolist()
    assert isinstance(cost.origin, Game)
    assert isinstance(payoff.origin, Game)
    assert cost.origin.payoffs() == payoff.origin.payoffs()
    (tmp_path / "costs.json").write_text(json.dumps(costs | {"sense": "least"}))
    assert 'give "max" for payoffs or "min" for costs' in lcp("solve", str(tmp_path / "costs.json")).err
