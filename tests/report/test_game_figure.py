"""The picture of a 2 x 2 game: the best replies of both players, and every equilibrium where they meet."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

import lcpcli
from lcpcli.enumeration.search import SolutionSet
from lcpcli.model.origins import Game
from lcpcli.report import plotting, solution_figure
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


def picture(lcp: Callable[..., Any], folder: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> Replies:
    """The data of the picture that the command draws."""
    A, B, *_ = GAMES[name]
    (folder / "game.json").write_text(f'{{"A": {A}, "B": {B}, "rows": ["up", "down"], "columns": ["left", "right"]}}')
    drawn: list[Replies] = []
    usual = plotting.replies

    def kept(data: Replies, form: str) -> bytes:
        drawn.append(data)
        return usual(data, form)

    monkeypatch.setattr(plotting, "replies", kept)
    outcome = lcp("solve", str(folder / "game.json"), "--all", "--plot", str(folder / "replies.svg"))
    assert (outcome.code, outcome.err) == (0, "")
    assert (folder / "replies.svg").read_text().startswith("<?xml")
    return drawn[0]


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
def test_the_command_draws_every_equilibrium_where_the_replies_meet(
    name: str, equilibria: Any, subsets: Any, lcp: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = picture(lcp, tmp_path, monkeypatch, name)
    assert (data.row, data.column) == GAMES[name][2:]
    assert (data.equilibria, data.subsets) == (equilibria, subsets)
    assert (data.rows, data.columns) == (["up", "down"], ["left", "right"])


def drawn(name: str, names: list[str]) -> Replies:
    A, B, *_ = GAMES[name]
    game = Game.of(A, B, (), ())
    search = lcpcli.solutions(lcpcli.Problem(*game.conditions(), origin=game))
    assert list(search)
    data = solution_figure.replies(SolutionSet(search, "time_limit", 0.0))
    return Replies(**{**vars(data), "rows": names, "columns": names, "title": "$ " * 30})


@pytest.mark.parametrize("name", GAMES)
@pytest.mark.parametrize("names", [["x1", "x2"], ["a very long name of a strategy " * 2, "$another_ " * 9]])
def test_no_text_lies_on_another_or_leaves_the_figure(name: str, names: list[str]) -> None:
    with style.context():
        figure = game_figure.draw(drawn(name, names))
        FigureCanvasAgg(figure).draw()
        page = figure.bbox
        texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
        boxes = {text: text.get_window_extent() for text in texts}
    for text, box in boxes.items():
        assert page.x0 <= box.x0 <= box.x1 <= page.x1, text
        assert page.y0 <= box.y0 <= box.y1 <= page.y1, text
    for (text, box), (other_text, other) in combinations(boxes.items(), 2):
        assert not box.overlaps(other), (text, other_text)


def test_names_of_strategies_are_on_the_axes_and_the_legend_has_what_is_drawn() -> None:
    with style.context():
        axes = (figure := game_figure.draw(drawn("degenerate", ["up", "down"]))).axes[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["0\ndown", "0.5", "1\nup"]
    assert axes.get_xlabel() == "probability that row plays up"
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend == ["best replies of row", "best replies of column", "extreme equilibria", "other equilibria"]


@pytest.mark.slow("draws figures twice")
@pytest.mark.parametrize(("form", "magic"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF-1.")])
def test_every_form_is_a_file_of_its_kind_and_always_the_same(form: str, magic: bytes) -> None:
    first, second = (plotting.replies(drawn("coordination", ["a", "b"]), form) for _ in range(2))
    assert first.startswith(magic)
    assert first == second
