"""Which curve is which: labels at the curves' ends where there is room for all of them, else a legend."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lcpcli.report.figures.style import POINTS, SMALL, Look, Looks, fitted, key, legible, renderer, width_of

MOST_DIRECT = 6
CLEAR = 2.0  # points between a label and anything else
EDGE = 4.5  # points between a label and the frame with its ticks
DISTANCES = (6, 9, 13)  # points from the end of a curve to its label
SIDES = ((1, 0), (1, 1), (1, -1), (0, 1), (0, -1), (-1, 0), (-1, 1), (-1, -1))
SAMPLE = 2.0  # points between the samples of a line
MOST_COLUMNS = 6
GAP = 0.08  # inches between a legend and the axes above


@dataclass(frozen=True)
class End:
    """The end of a curve in data coordinates, and what is to be written there."""

    x: float
    y: float
    text: str
    look: Look


@dataclass
class Drawn:
    """Axes with their curves, one end each, None where nothing of it is in these axes; and what is to be remarked."""

    axes: Axes
    ends: list[End | None] = field(default_factory=list)
    outside: bool = False
    unsolved: bool = False


@dataclass(frozen=True)
class Place:
    """Where a label would be: the offset of its anchor in points, its side, and its box in points."""

    dx: float
    dy: float
    side: tuple[int, int]
    box: tuple[float, float, float, float]

    def clear_of(self, x: Any, y: Any) -> bool:
        left, bottom, right, top = self.box
        inside = (x > left - CLEAR) & (x < right + CLEAR) & (y > bottom - CLEAR) & (y < top + CLEAR)
        return not bool(np.any(inside))

    def apart_from(self, other: Place) -> bool:
        (a, b, c, d), (e, f, g, h) = self.box, other.box
        return a > g + CLEAR or e > c + CLEAR or b > h + CLEAR or f > d + CLEAR

    def distance(self, x: float, y: float) -> float:
        left, bottom, right, top = self.box
        return float(np.hypot(max(left - x, 0, x - right), max(bottom - y, 0, y - top)))


def identify(
    figure: Figure, groups: Sequence[Sequence[Drawn]], looks: Looks, remarks: Sequence[tuple[Line2D, str]]
) -> None:
    """Label all curves at their ends in one of the axes of each group; if that cannot be done, by a legend.

    groups : axes that show the same curves. remarks : what the legend says in any case. The figure may grow.
    """
    found = [[_labels(drawn) for drawn in group] for group in groups]
    columns = [*zip(*found, strict=True), [next(filter(None, spots), None) for spots in found]]
    chosen = next((column for column in columns if all(column)), None)
    for axes, end, spot in (label for spots in chosen or [] for label in spots or []):
        _write(axes, end, spot)
    _legend(figure, looks if chosen is None else {}, remarks)


def _labels(drawn: Drawn) -> list[tuple[Axes, End, Place]] | None:
    """Places for the labels of all ends, clear of lines, each other and the frame; None if there is no room.

    The axes hold the curves and have their final size and limits.
    """
    ends = [end for end in drawn.ends if end is not None]
    if not ends or len(ends) < len(drawn.ends) or len(ends) > MOST_DIRECT:
        return None
    axes = drawn.axes
    lines = _samples(axes)
    at = [axes.transData.transform((end.x, end.y)) for end in ends]
    options = []
    for i, end in enumerate(ends):
        others = [other for j, other in enumerate(at) if j != i]
        options.append([p for p in _places(axes, end, at[i]) if _fits(p, lines, at[i], others, axes.bbox)])
    spots = _choose(options, [])
    return [(axes, end, spot) for end, spot in zip(ends, spots, strict=True)] if spots else None


def _write(axes: Axes, end: End, spot: Place) -> None:
    across, up = spot.side
    axes.annotate(
        legible(end.text),
        (end.x, end.y),
        xytext=(spot.dx, spot.dy),
        textcoords="offset points",
        ha={1: "left", 0: "center", -1: "right"}[across],
        va={1: "bottom", 0: "center", -1: "top"}[up],
        color=end.look.text,
        fontsize=SMALL,
    ).set_parse_math(False)


def _legend(figure: Figure, looks: Looks, remarks: Sequence[tuple[Line2D, str]]) -> None:
    """Add a legend under everything, in as many columns as there is room for; the figure grows by its height."""
    entries = [(key(look), label) for (_, label), look in looks.items()] + list(remarks)
    if not entries:
        return
    room = (figure.get_figwidth() - 0.2) * POINTS
    texts = [fitted(figure, label, SMALL, room - 4.5 * SMALL) for _, label in entries]
    for columns in _columns(len(entries)):
        drawn = figure.legend(
            [handle for handle, _ in entries],
            ["-"] * len(entries),
            loc="lower center",
            ncols=columns,
            frameon=False,
            handlelength=3.4,
            columnspacing=1.6,
            borderaxespad=0.3,
        )
        for drawn_text, text in zip(drawn.get_texts(), texts, strict=True):
            drawn_text.set_parse_math(False)
            drawn_text.set_text(text)
        box = drawn.get_window_extent(renderer(figure))
        if box.width <= room or columns == 1:
            break
        drawn.remove()
    _grow(figure, box.height / POINTS + GAP)


def _columns(entries: int) -> list[int]:
    """The numbers of columns that fill all rows but the last, or nearly, the widest first."""
    return sorted({math.ceil(entries / rows) for rows in range(math.ceil(entries / MOST_COLUMNS), entries + 1)})[::-1]


def _grow(figure: Figure, inches: float) -> None:
    """Make a figure higher by an empty strip at its lower edge; axes and texts keep their sizes and distances."""
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + inches)
    for axes in figure.axes:
        box = axes.get_position()
        bottom = (box.y0 * height + inches) / (height + inches)
        axes.set_position((box.x0, bottom, box.width, box.height * height / (height + inches)))


def _places(axes: Axes, end: End, at: Any) -> list[Place]:
    """Where a label could be, the best first."""
    width, height = width_of(cast(Figure, axes.figure), legible(end.text), SMALL), SMALL * 1.2
    found = []
    for distance in DISTANCES:
        for across, up in SIDES:
            reach = distance * (0.75 if across and up else 1)
            dx, dy = across * reach, up * reach
            left = at[0] + dx - {1: 0.0, 0: width / 2, -1: width}[across]
            bottom = at[1] + dy - {1: 0.0, 0: height / 2, -1: height}[up]
            found.append(Place(dx, dy, (across, up), (left, bottom, left + width, bottom + height)))
    return found


def _fits(spot: Place, lines: Any, at: Any, others: Sequence[Any], frame: Any) -> bool:
    """Whether a place is inside the frame, clear of all lines, and nearer to its own end than to any other."""
    left, bottom, right, top = spot.box
    if left < frame.x0 + EDGE or right > frame.x1 - EDGE or bottom < frame.y0 + EDGE or top > frame.y1 - EDGE:
        return False
    if not spot.clear_of(*lines):
        return False
    own = spot.distance(*at)
    return all(spot.distance(*other) > 1.5 * own for other in others)


def _choose(options: Sequence[Sequence[Place]], chosen: list[Place]) -> list[Place] | None:
    """One place for each label, none of them on another: depth first, so that the first choices are the best."""
    if not options:
        return chosen
    for spot in options[0]:
        if all(spot.apart_from(other) for other in chosen):
            found = _choose(options[1:], [*chosen, spot])
            if found is not None:
                return found
    return None


def _samples(axes: Axes) -> Any:
    """Points of all lines and markers in axes, close enough for a label not to pass between them."""
    xs, ys = [], []
    for line in axes.lines:
        x, y = axes.transData.transform(np.column_stack(line.get_data())).T
        xs.append(x)
        ys.append(y)
        if line.get_linestyle() == "None" or len(x) < 2:
            continue
        steps = np.ceil(np.hypot(np.diff(x), np.diff(y)) / SAMPLE).astype(int).clip(1, 1000)
        for i, count in enumerate(steps):
            share = np.arange(1, count) / count
            xs.append(x[i] + share * (x[i + 1] - x[i]))
            ys.append(y[i] + share * (y[i + 1] - y[i]))
    return (np.concatenate(xs), np.concatenate(ys)) if xs else (np.empty(0), np.empty(0))
