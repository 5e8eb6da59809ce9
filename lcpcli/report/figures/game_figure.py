"""The best replies of both players of a 2 x 2 game in the unit square; where they meet is an equilibrium.

The abscissa is the probability that the row player plays the first strategy, the ordinate that of the column player.
The best replies of the row player to each ordinate, and of the column player to each abscissa, are lines, or the whole
square for a player who is always indifferent. Equilibria are numbered as in the table.

The best replies of the players of a 2 x 2 game, as sets in the unit square of the probabilities of first strategies.

Points are (p, q): the probabilities that the row and the column player play their first strategies.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise, product
from typing import Any, TypeAlias

from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.patheffects import withStroke

from lcpcli.report.figures.cones_figure import COLUMN, EDGE, MARK, Drawing, header
from lcpcli.report.figures.data import Pair, Replies
from lcpcli.report.figures.style import FONT, METHODS, SMALL_FONT, fitted

HALF = 80.0  # points: half a side of the square
LEFT, HEADER, FOOTER = 0.9, 0.45, 0.96  # inches beside, above and below the square
ROOM = 6.0  # points between the square and the frame, for marks on its sides
OUTSIDE = 28  # points: farther from the frame than the number of any equilibrium could be
ROW, OTHER = METHODS["fixed-point"].color, METHODS["milp"].color  # dark and light, also in grey
LINES: dict[str, dict[str, Any]] = {
    ROW: {"linewidth": 6.5, "solid_capstyle": "projecting", "zorder": 3},
    OTHER: {"linewidth": 3.2, "solid_capstyle": "projecting", "zorder": 4},
}
AREAS: dict[str, dict[str, Any]] = {
    ROW: {"facecolor": to_rgba(ROW, 0.22), "edgecolor": "none", "zorder": 1},
    OTHER: {"facecolor": "none", "edgecolor": OTHER, "hatch": 4 * "\\", "linewidth": 0, "zorder": 2},
}
POINT: dict[str, Any] = {"marker": "o", "markersize": 7, "markerfacecolor": "black", "markeredgecolor": "white"}
OUTLINE = withStroke(linewidth=2.5, foreground="white")  # of numbers, which may lie on an area
SUBSET: dict[str, Any] = {"color": "black", "linewidth": 1.2}


def draw(picture: Replies) -> Figure:
    """Draw the figure, as wide as one column of a journal."""
    side = 2 * (HALF + ROOM) / 72
    height = HEADER + side + FOOTER
    figure = Figure(figsize=(COLUMN, height))
    figure.set_layout_engine("none")
    axes = figure.add_axes((LEFT / COLUMN, FOOTER / height, side / COLUMN, side / height))
    drawing = Drawing(axes)
    _axes(axes, picture)
    entries = [
        _replies(drawing, picture.row, ROW, "best replies of row"),
        _replies(drawing, picture.column, OTHER, "best replies of column"),
        *_equilibria(drawing, picture),
    ]
    sides = (("A", picture.A), ("B", picture.B))
    payoffs = [f"{name} = [{'; '.join(' '.join(row) for row in own)}]" for name, own in sides]
    header(figure, picture.title, picture.count.split(":")[0], f"payoffs {',  '.join(payoffs)}")
    handles, labels = zip(*entries, strict=True)
    place: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, EDGE / height), "borderaxespad": 0}
    figure.legend(handles, labels, ncols=2, handlelength=1.8, borderpad=0, **place)
    return figure


def _at(point: Pair) -> complex:
    """Return the place of a point of the unit square, in points from its middle."""
    return complex(*(HALF * (2 * value - 1) for value in point))


def _axes(axes: Axes, picture: Replies) -> None:
    ends = -HALF - ROOM, HALF + ROOM
    axes.set(xlim=ends, ylim=ends)
    places = [-HALF, 0.0, HALF]
    across = [fitted(name, SMALL_FONT, room) for name, room in zip(picture.rows, (0.56, 1.2), strict=True)]
    up = [fitted(name, SMALL_FONT, 0.55) for name in picture.columns]
    axes.set_xticks(places, [f"0\n{across[1]}", "0.5", f"1\n{across[0]}"])
    axes.set_yticks(places, [f"0\n{up[1]}", "0.5", f"1\n{up[0]}"])
    of_row, of_column = (fitted(names[0], FONT, 0.9) for names in (picture.rows, picture.columns))
    axes.set_xlabel(f"probability that row plays {of_row}", labelpad=3)
    axes.set_ylabel(f"probability that column plays {of_column}")
    axes.yaxis.set_label_coords(-0.73 * 72 / (2 * (HALF + ROOM)), 0.5)


def _replies(drawing: Drawing, line: Sequence[Pair], color: str, label: str) -> tuple[Any, str]:
    """Draw the best replies of a player; return the entry of the legend."""
    points = [_at(point) for point in line]
    if points[0] == points[-1]:
        drawing.axes.add_patch(Polygon([(point.real, point.imag) for point in points], **AREAS[color]))
        return Patch(**AREAS[color]), f"{label}: all"
    drawing.axes.plot([p.real for p in points], [p.imag for p in points], color=color, **LINES[color])
    for start, end in pairwise(points):
        aside = 1j * (end - start) / abs(end - start) * LINES[color]["linewidth"] / 2
        drawing.take_line(start + aside, end + aside)
        drawing.take_line(start - aside, end - aside)
    return Line2D([], [], color=color, linewidth=LINES[color]["linewidth"], solid_capstyle="butt"), label


def _equilibria(drawing: Drawing, picture: Replies) -> list[tuple[Any, str]]:
    """Mark the equilibria, with their numbers; return the entries of the legend."""
    large = [(_at(low), _at(high)) for low, high in picture.subsets if low != high]
    for low, high in large:
        corners = [(low.real, low.imag), (high.real, low.imag), (high.real, high.imag), (low.real, high.imag)]
        drawing.axes.add_patch(Polygon(corners, fill=False, zorder=5, **SUBSET))
    for distance, turn in product(range(0, OUTSIDE, 4), (1, 1j, -1, -1j)):  # the numbers stay in the frame
        corner = -(1 + 1j) * (HALF + ROOM + distance) * turn
        drawing.take_line(corner, corner * 1j)
    marks = [_at(point) for point in picture.equilibria]
    for mark in marks:
        drawing.axes.plot(mark.real, mark.imag, zorder=7, **POINT)
        drawing.take(mark + 4 * MARK)
    for number, mark in enumerate(marks, 1):
        drawing.label(str(number), mark, math.atan2(-mark.imag or -1, -mark.real or 1))
    for text in drawing.axes.texts:
        text.set_path_effects([OUTLINE])
    entries: list[tuple[Any, str]] = []
    if marks:
        name = "equilibrium" if len(marks) == 1 else "extreme equilibria" if large else "equilibria"
        entries.append((Line2D([], [], linestyle="", **POINT), name))
    if large:
        is_all = any(low.real < high.real and low.imag < high.imag for low, high in large)  # of two indifferent players
        entries.append((Line2D([], [], **SUBSET), "all are equilibria" if is_all else "other equilibria"))
    return entries


Point: TypeAlias = tuple[Fraction, Fraction]
Line: TypeAlias = list[Point]
SQUARE: Line = [(Fraction(p), Fraction(q)) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))]


def of_row(A: Sequence[Sequence[Fraction]]) -> Line:
    """Return the p that are best against each q, as a line of points from q = 0 to q = 1; SQUARE if all p are."""
    return [(p, q) for q, p in _sets_of_replies(A[0][1] - A[1][1], A[0][0] - A[1][0])] or SQUARE


def of_column(B: Sequence[Sequence[Fraction]]) -> Line:
    """Return the q that are best against each p, as a line of points from p = 0 to p = 1; SQUARE if all q are."""
    return list(_sets_of_replies(B[1][0] - B[1][1], B[0][0] - B[0][1])) or SQUARE


def _sets_of_replies(at_0: Fraction, at_1: Fraction) -> Line:
    """Return the best replies as points (probability of the other, own probability); none if all are best.

    at_0, at_1 : what a player gains by the first strategy instead of the second, against the second and against the
        first strategy of the other. The gain is linear in mixed strategies, and where it is 0, all replies are best.
    """
    if at_0 == at_1 == 0:
        return []
    zero, one = Fraction(0), Fraction(1)
    if at_0 * at_1 > 0:
        reply = one if at_0 > 0 else zero
        return [(zero, reply), (one, reply)]
    turn, falls = at_0 / (at_0 - at_1), at_0 > at_1
    corners = [(zero, one * falls), (turn, one * falls), (turn, one * (not falls)), (one, one * (not falls))]
    return list(dict.fromkeys(corners))
