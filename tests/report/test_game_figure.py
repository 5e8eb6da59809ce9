"""The picture of a 2 x 2 game: the best replies of both players, and every equilibrium where they meet."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import lcpcli
from lcpcli.enumeration.search import SolutionSet
from lcpcli.model.origins import Game
from lcpcli.report import solution_figure
from lcpcli.report.figures import best_replies, game_figure, style
from lcpcli.report.figures.data import Replies

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]
GAMES: dict[str, tuple[list[list[int]], list[list[int]], list[Any], list[Any]]] = {  # A, B, and the best replies
    "matching pennies": (
        [[1, -1], [-1, 1]],
        [[-1, 1], [1, -1]],
        [(0, 0), (0, 0.5), (1, 0.5), (1, 1)],
        [(0, 1), (0.5, 1), (0.5, 0), (1, 0)],
    ),
    "coordination": (
        [[3, 0], [0, 2]],
        [[2, 0], [0, 3]],
        [(0, 0), (0, 0.4), (1, 0.4), (1, 1)],
        [(0, 0), (0.6, 0), (0.6, 1), (1, 1)],
    ),
    "prisoners' dilemma": ([[3, 0], [5, 1]], [[3, 5], [0, 1]], [(0, 0), (0, 1)], [(0, 0), (1, 0)]),
    "degenerate": ([[2, 2], [2, 1]], [[2, 2], [2, 1]], [(1, 0), (1, 1), (0, 1)], [(0, 1), (1, 1), (1, 0)]),
    "indifferent row": ([[1, 1], [1, 1]], [[1, 0], [1, 0]], SQUARE, [(0, 1), (1, 1)]),
    "both indifferent": ([[1, 1], [1, 1]], [[2, 2], [2, 2]], SQUARE, SQUARE),
}


def exact(payoffs: Any) -> list[list[Fraction]]:
    return [[Fraction(value) for value in row] for row in payoffs]


@pytest.mark.parametrize("name", GAMES)
def test_best_replies_are_those_of_the_textbook(name: str) -> None:
    A, B, row, column = GAMES[name]
    assert [(float(p), float(q)) for p, q in best_replies.of_row(exact(A))] == row
    assert [(float(p), float(q)) for p, q in best_replies.of_column(exact(B))] == column


PAYOFFS = st.lists(st.lists(st.integers(-2, 2), min_size=2, max_size=2), min_size=2, max_size=2)


@given(A=PAYOFFS, part=st.fractions(0, 1))
def test_every_point_of_the_line_is_a_best_reply(A: list[list[int]], part: Fraction) -> None:
    line = best_replies.of_row(exact(A))
    for (p0, q0), (p1, q1) in pairwise(line):
        p, q = p0 + part * (p1 - p0), q0 + part * (q1 - q0)
        first, second = (row[0] * q + row[1] * (1 - q) for row in A)
        assert p * first + (1 - p) * second == max(first, second)
    assert (line[0][1], line[-1][1]) == ((0, 1) if line is not best_replies.SQUARE else (0, 0))


def replies(name: str, names: list[str]) -> Replies:
    """The data of the picture of a game, with these names of strategies for both players."""
    A, B, *_ = GAMES[name]
    game = Game.of(A, B, (), ())
    search = lcpcli.solutions(lcpcli.Problem(*game.conditions(), origin=game))
    assert list(search)
    data = solution_figure.replies(SolutionSet(search, "time_limit", 0.0))
    return Replies(**{**vars(data), "rows": names, "columns": names, "title": "$ " * 30})


@pytest.mark.parametrize(
    ("name", "equilibria", "subsets"),
    [
        ("matching pennies", [(0.5, 0.5)], [((0.5, 0.5), (0.5, 0.5))]),
        ("coordination", [(1, 1), (0.6, 0.4), (0, 0)], [((1, 1), (1, 1)), ((0.6, 0.4),) * 2, ((0, 0), (0, 0))]),
        ("degenerate", [(1, 1), (1, 0), (0, 1)], [((1, 0), (1, 1)), ((0, 1), (1, 1))]),
        ("indifferent row", [(1, 1), (0, 1)], [((0, 1), (1, 1))]),
        ("both indifferent", [(1, 1), (1, 0), (0, 1), (0, 0)], [((0, 0), (1, 1))]),
    ],
)
def test_every_equilibrium_is_drawn_where_the_replies_meet(name: str, equilibria: Any, subsets: Any) -> None:
    data = replies(name, ["a", "b"])
    assert (data.row, data.column) == GAMES[name][2:]
    assert (data.equilibria, data.subsets) == (equilibria, subsets)


def test_the_command_draws_a_game_with_its_strategies(
    lcp: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    names = '"rows": ["upwards", "down"], "columns": ["left", "right"]'
    Path("game.json").write_text(f'{{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]], {names}}}')
    outcome = lcp("solve", "game.json", "--all", "--plot", "replies.svg")
    assert (outcome.code, outcome.err) == (0, "")
    assert "maximal Nash subsets {1, 2}, {1, 3}: any average" in outcome.out
    assert "<!-- probability that row plays upwards -->" in Path("replies.svg").read_text()


def test_names_of_strategies_are_on_the_axes_and_the_legend_has_what_is_drawn() -> None:
    with style.context():
        axes = (figure := game_figure.draw(replies("degenerate", ["up", "down"]))).axes[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["0\ndown", "0.5", "1\nup"]
    assert axes.get_xlabel() == "probability that row plays up"
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["best replies of row", "best replies of column", "extreme equilibria", "other equilibria"]
