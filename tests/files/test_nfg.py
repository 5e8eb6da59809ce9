"""Games in Gambit's .nfg form, in both versions, and what is wrong with other files."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

import lcpcli
from lcpcli import errors
from lcpcli.files import contents
from lcpcli.model.origins import Game

from ..conftest import Outcome, read_exact

HEAD = 'NFG 1 R "a game" { "Alice" "Bob" }\n'
PAYOFFS = HEAD + '{ { "up" "down" } { "left" "mid" "right" } }\n"a comment"\n1 2 3 4\n1/3 -0.5, 1e1 .25\n0 0 -7/2 +1\n'
COUNTS = HEAD + "{ 2 3 }\n" + PAYOFFS.partition('"a comment"\n')[2]
OUTCOMES = HEAD + (
    '{ { "up" "down" } { "left" "mid" "right" } }\n'
    '{ { "one" 1 2 } { "" 3, 4 } { "with \\"quotes\\"" 1/3 -0.5 } { 10 .25 } { "" -7/2 1 } }\n1 2 3 4 0 5\n'
)
A = [[1, Fraction(1, 3), 0], [3, 10, Fraction(-7, 2)]]
B = [[2, Fraction(-1, 2), 0], [4, Fraction(1, 4), 1]]


def game_in(path: Path, text: str) -> Game:
    path.write_text(text)
    problem = lcpcli.read(path)
    assert problem.name == "a game"
    assert isinstance(problem.origin, Game)
    return problem.origin


@pytest.mark.parametrize("text", [PAYOFFS, COUNTS, OUTCOMES], ids=["payoffs", "counts", "outcomes"])
def test_all_versions_have_the_payoffs_with_the_first_player_in_the_rows(text: str, tmp_path: Path) -> None:
    game = game_in(tmp_path / "g.nfg", text)
    assert game.payoffs() == (A, B)
    assert game.columns in ((), ("left", "mid", "right"))


def test_it_is_recognized_by_its_first_word_too(tmp_path: Path) -> None:
    assert game_in(tmp_path / "g.txt", PAYOFFS).rows == ("up", "down")


def test_strategies_named_by_their_numbers_have_no_names(tmp_path: Path) -> None:
    game = game_in(tmp_path / "g.nfg", HEAD + '{ { "1" "2" } { "b" } } 1 1 2 2')
    assert (game.rows, game.columns) == ((), ("b",))


def test_fractions_are_not_rounded_for_proofs(tmp_path: Path) -> None:
    (tmp_path / "g.nfg").write_text(HEAD + "{ 1 2 } 1/3 1 2/3 2")
    assert read_exact(str(tmp_path / "g.nfg")).is_solution([Fraction(1), Fraction(0), Fraction(3)])


def test_the_shipped_games_are_read() -> None:
    shapes = [lcpcli.read(file).n for file in sorted(Path(contents.shipped_path("games")).glob("*.nfg"))]
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
        lcpcli.read(tmp_path / "g.nfg")
    assert str(caught.value).startswith(f"{tmp_path / 'g.nfg'}: {message}")


def test_it_is_only_read(lcp: Callable[..., Outcome], tmp_path: Path) -> None:
    done = lcp("convert", contents.shipped_path("games/winkels.nfg"), "-o", str(tmp_path / "w.nfg"))
    assert (done.code, "is of a format that is only read" in done.err) == (2, True)
    assert lcp("convert", contents.shipped_path("games/winkels.nfg"), "-o", str(tmp_path / "w.json")).code == 0
    again = lcpcli.read(tmp_path / "w.json").origin
    assert isinstance(again, Game)
    assert again.payoffs()[0][4][0] == Fraction(5, 2)
