"""The pictures of all solutions: complementary cones of two unknowns, and the best replies of a 2 x 2 game."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Wedge
from scipy.optimize import nnls

import lcpcli
from lcpcli.enumeration.search import SolutionSet
from lcpcli.model.origins import Game
from lcpcli.report import pictures
from lcpcli.report.figures import cones_figure, game_figure, style
from lcpcli.report.figures.cones_figure import LINE, POINT, RAY, SECTOR, SETS
from lcpcli.report.figures.data import Cones, Replies

MURTY = [[1, 2], [2, 1]]
# M and the kinds of its four cones, in the order of SETS
DEGENERATE = {
    "opposite columns": ([[0, 1], [1, 0]], [SECTOR, LINE, LINE, SECTOR]),
    "skew": ([[0, -1], [1, 0]], [SECTOR, LINE, RAY, SECTOR]),
    "parallel columns": ([[1, 1], [1, 1]], [SECTOR, SECTOR, SECTOR, RAY]),
    "parallel up to rounding": ([[0.1, 0.3], [0.2, 0.6]], [SECTOR, SECTOR, SECTOR, RAY]),
    "opposite, of M alone": ([[1, -1], [1, -1]], [SECTOR, SECTOR, SECTOR, LINE]),
    "zero": ([[0, 0], [0, 0]], [SECTOR, RAY, RAY, POINT]),
    "zero column": ([[0, 1], [0, 1]], [SECTOR, RAY, SECTOR, RAY]),
    "three of one direction": ([[-1, -1], [0, 0]], [SECTOR, SECTOR, RAY, RAY]),
    "huge and tiny": ([[1e308, 5e-324], [-1e308, 0]], [SECTOR, SECTOR, LINE, SECTOR]),
}


def picture(M: list[list[float]], q: tuple[float, float], **given_too: object) -> Cones:
    """With the cones that really hold q."""
    holding = []
    for chosen in SETS:
        basis = generators(M, chosen)
        lengths = np.abs(basis).max(axis=0)
        holding.append(bool(nnls(basis / np.where(lengths, lengths, 1), q)[1] < 1e-9))
    return Cones("problem", M, q, holding, f"{sum(holding)} solutions", **given_too)  # type: ignore[arg-type]


def generators(M: list[list[float]], chosen: tuple[int, ...]) -> np.ndarray:
    """Those of a cone, as columns."""
    return np.column_stack([-np.array(M, float)[:, j] if j + 1 in chosen else np.eye(2)[:, j] for j in (0, 1)])


def drawn(M: list[list[float]], q: tuple[float, float]) -> Figure:
    with style.context():
        return cones_figure.draw(picture(M, q))


def sectors(axes: Axes) -> list[Wedge]:
    return [patch for patch in axes.patches if isinstance(patch, Wedge) and patch.get_fill()]


def test_sectors_of_a_P_matrix_are_its_cones_and_meet_at_one_radius() -> None:
    found = sectors(drawn([[2, 1], [1, 2]], (-5, -6)).axes[0])
    first, second = math.degrees(math.atan2(-1, -2)) + 360, math.degrees(math.atan2(-2, -1)) + 360
    angles = [(wedge.theta1, wedge.theta2) for wedge in found]
    assert angles == [pytest.approx(pair) for pair in [(0, 90), (90, first), (second, 360), (first, second)]]
    assert len({wedge.r for wedge in found}) == 1


def test_each_cone_that_holds_q_has_a_mark_where_the_ray_through_q_crosses_its_arc() -> None:
    axes = drawn(MURTY, (-1, -1)).axes[0]
    marks = [line.get_xydata()[0] for line in axes.lines if line.get_markerfacecolor() == "white"]
    radii = [wedge.r for wedge in sectors(axes)]
    assert [math.hypot(*mark) for mark in marks] == pytest.approx(radii[1:])
    assert {round(math.degrees(math.atan2(y, x))) for x, y in marks} == {-135}
    assert len(set(radii[1:])) == 3


@given(M=st.tuples(*[st.tuples(*[st.integers(-3, 3)] * 2)] * 2), q=st.tuples(*[st.integers(-5, 5)] * 2))
def test_q_is_in_the_sectors_whose_generators_have_it_as_a_sum(M: list[list[float]], q: tuple[float, float]) -> None:
    direction = cones_figure.angle(q)
    for cone, chosen in zip(cones_figure.cones(M), SETS, strict=True):
        basis = generators(M, chosen)
        independent = bool(round(np.linalg.det(basis)))
        assert independent == (cone.kind == SECTOR)
        if independent and direction is not None:
            coefficients = np.linalg.solve(basis, q)
            if np.abs(coefficients).min() > 1e-9:
                ((start, width),) = cone.parts
                assert ((direction - start) % math.tau < width) == (coefficients.min() > 0)


@pytest.mark.parametrize("name", DEGENERATE)
def test_degenerate_cones_are_drawn_as_rays_lines_and_points(name: str) -> None:
    M, kinds = DEGENERATE[name]
    assert [cone.kind for cone in cones_figure.cones(M)] == kinds
    figure = drawn(M, (1, -2))
    assert len(sectors(figure.axes[0])) == kinds.count(SECTOR)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    words = {SECTOR: "", RAY: ": a ray", LINE: ": a line", POINT: ": the origin"}
    assert [label.split("$")[-1].rstrip(f" {cones_figure.CHECK}") for label in legend] == [
        words[kind] for kind in kinds
    ]


def test_legend_checks_the_cones_that_hold_q() -> None:
    legend = drawn(MURTY, (-1, -1)).legends[0]
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == ["$w_1$, $w_2$", "$z_1$, $w_2$  ✓", "$w_1$, $z_2$  ✓", "$z_1$, $z_2$  ✓"]


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
    assert [(float(p), float(q)) for p, q in game_figure.of_row(exact(A))] == row
    assert [(float(p), float(q)) for p, q in game_figure.of_column(exact(B))] == column


PAYOFFS = st.lists(st.lists(st.integers(-2, 2), min_size=2, max_size=2), min_size=2, max_size=2)


@given(A=PAYOFFS, part=st.fractions(0, 1))
def test_every_point_of_the_line_is_a_best_reply(A: list[list[int]], part: Fraction) -> None:
    line = game_figure.of_row(exact(A))
    for (p0, q0), (p1, q1) in pairwise(line):
        p, q = p0 + part * (p1 - p0), q0 + part * (q1 - q0)
        first, second = (row[0] * q + row[1] * (1 - q) for row in A)
        assert p * first + (1 - p) * second == max(first, second)
    assert (line[0][1], line[-1][1]) == ((0, 1) if line is not game_figure.SQUARE else (0, 0))


def replies(name: str, names: list[str]) -> Replies:
    """The data of the picture of a game, with these names of strategies for both players."""
    A, B, *_ = GAMES[name]
    game = Game.of(A, B, (), ())
    search = lcpcli.solutions(lcpcli.Problem(*game.conditions(), origin=game))
    assert list(search)
    data = pictures.replies(SolutionSet(search, "time_limit", 0.0))
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
