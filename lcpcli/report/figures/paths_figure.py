"""The paths of runs on LCPs with two unknowns, over the merit function that the methods reduce.

The plane is that of x with z = |x| + x and w = |x| - x, in which F(x) = M z - w + q is linear in each quadrant: the
complementary cones of the problem are the images of the quadrants, each named by the variables that are positive in it.
The contours are those of |F(x)|, on a logarithmic scale; F is 0 only at solutions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator

from lcpcli.report.figures.cones_figure import COLORS, COLUMN, MARK, SETS, Drawing, variables
from lcpcli.report.figures.data import Pair, Trajectories, Trajectory
from lcpcli.report.figures.style import FONT, SMALL_FONT, Look, Looks, add_legend, fitted, looks

AXES_HEIGHT = 3.0  # inches: the height of axes with their surroundings
POINTS = 240  # of the grid on which |F| is computed, in each direction
BANDS, DEPTH = 10, 0.02  # of the contours, and the smallest |F| that they tell, relative to the largest
GREYS = LinearSegmentedColormap.from_list("", ["white", "0.74"])  # so that colours and labels are legible on it
TINT = 0.15  # the opacity of the colour of a quadrant
MARGIN, LEAST = 0.14, 0.22  # of the length of an axis, beyond the data and of each quadrant: room for labels
FARTHEST = 3.0  # times the size of the start and the solutions: farther iterates lie outside
NUMBERS = [step * 10**decade for decade in range(7) for step in (1, 2, 5)]  # of iterates with a label
TICKS = 5  # intervals between labels on an axis at most
NEARER = 0.75  # of the distance of a label from its iterate: no other iterate may be as near
APART = 22.0  # points between two iterates with labels
INSET, ACROSS, UP = 4.0, np.arange(0, 31, 2), np.arange(0, 11, 2)  # points: of the labels in the corners
START: dict[str, Any] = {"marker": "s", "markersize": 6.5, "markerfacecolor": "white", "markeredgecolor": "black"}
SOLUTION: dict[str, Any] = {"marker": "*", "markersize": 11, "markerfacecolor": "white", "markeredgecolor": "black"}
OUTLINE = withStroke(linewidth=2.0, foreground="white")


def merit(M: Any, q: Any, x: Any) -> Any:
    """Return |F(x)| for x of shape (2, ...)."""
    z, w = np.abs(x) + x, np.abs(x) - x
    F = np.tensordot(np.asarray(M), z, axes=1) - w + np.reshape(q, (2, *[1] * (np.ndim(x) - 1)))
    return np.hypot(*F)


def ranges(picture: Trajectories) -> list[Pair]:
    """Return the range of each axis: around the origin, the starts, the solutions, and the iterates not far from
    these."""
    near = np.array([(0.0, 0.0), *picture.solutions, *(path.x[0] for path in picture.paths if path.x)])
    far = FARTHEST * (np.abs(near[np.isfinite(near).all(axis=1)]).max() or 1.0)
    places = np.array([*near, *(x for path in picture.paths for x in path.x)])
    places = np.clip(places[np.isfinite(places).all(axis=1)], -far, far)
    found = []
    for low, high in zip(places.min(axis=0).tolist(), places.max(axis=0).tolist(), strict=True):
        length = (high - low) or far
        low, high = low - MARGIN * length, high + MARGIN * length
        room = LEAST * (high - low) / (1 - LEAST)
        found.append((min(low, -room), max(high, room)))
    return found


def draw(pictures: Sequence[Trajectories]) -> Figure:
    """Draw the figure of at least one problem, two in a row."""
    columns = min(2, len(pictures))
    rows = math.ceil(len(pictures) / columns)
    figure = Figure(figsize=(COLUMN * columns, AXES_HEIGHT * rows))
    chosen = looks((path.name, path.label) for picture in pictures for path in picture.paths)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(pictures) :]:
        axes.set_axis_off()
    panels = list(zip(grid, pictures, strict=False))
    for axes, picture in panels:
        _merit(axes, picture)
        for path in picture.paths:
            _path(axes, path, chosen[path.name, path.label])
        _points(axes, picture)
    signs = [(Line2D([], [], linestyle="", **START), "start")]
    if any(picture.solutions for picture in pictures):
        signs.append((Line2D([], [], linestyle="", **SOLUTION), "solution"))
    drawn = {(path.name, path.label) for picture in pictures for path in picture.paths if len(path.x) > 1}
    undrawn = [label for name, label in chosen if (name, label) not in drawn]
    signs += [(Line2D([], [], linestyle=""), f"{label}: no iterates") for label in undrawn]
    add_legend(figure, {key: look for key, look in chosen.items() if key in drawn}, signs)
    FigureCanvasAgg(figure).draw()  # so that the places of the axes are final
    figure.set_layout_engine("none")
    for axes, picture in panels:
        _labels(figure, axes, picture, chosen)
    return figure


def _merit(axes: Axes, picture: Trajectories) -> None:
    """Draw the contours of |F| and the quadrants."""
    (left, right), (bottom, top) = ranges(picture)
    x, y = np.linspace(left, right, POINTS), np.linspace(bottom, top, POINTS)
    with np.errstate(over="ignore", invalid="ignore"):
        values = merit(picture.M, picture.q, np.array(np.meshgrid(x, y)))
    values = np.nan_to_num(values, nan=np.inf, posinf=np.finfo(float).max)
    most = float(values.max()) or 1.0
    least = max(float(values.min()), DEPTH * most)
    if least >= most:
        least = most / 10
    levels = np.geomspace(least, most, BANDS + 1)
    values = np.clip(values, least, most)
    filled = axes.contourf(x, y, values, levels, norm=LogNorm(least, most), cmap=GREYS, zorder=0)
    axes.contour(x, y, values, levels[1:-1], colors="white", linewidths=0.4, zorder=0.5)
    for chosen, color in zip(SETS, COLORS, strict=True):
        corner = right if 1 in chosen else left, top if 2 in chosen else bottom
        axes.add_patch(Rectangle((0, 0), *corner, facecolor=color, alpha=TINT, linewidth=0, zorder=1))
    axes.axhline(0, color="black", linewidth=0.8, zorder=2)
    axes.axvline(0, color="black", linewidth=0.8, zorder=2)
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="$x_1$", ylabel="$x_2$")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(TICKS))
    axes.set_title(fitted(picture.title, FONT, COLUMN - 1.2))
    bar = axes.figure.colorbar(filled, ax=axes, pad=0.02, aspect=30)
    bar.set_ticks(LogLocator(10, subs=(1, 2, 5), numticks=8))
    bar.ax.yaxis.set_major_formatter("{x:g}")
    bar.ax.minorticks_off()
    bar.set_label(r"$\|F(x)\|_2$")


def _path(axes: Axes, path: Trajectory, look: Look) -> None:
    if not path.x:
        return
    xs, ys = np.array(path.x).T
    axes.plot(xs, ys, zorder=4, path_effects=[OUTLINE], **look.line | {"linewidth": 1.0})
    axes.plot(xs, ys, linestyle="", zorder=5, **look.points | {"markersize": 3, "markeredgewidth": 0.5})


def _points(axes: Axes, picture: Trajectories) -> None:
    """Mark the starts and the solutions."""
    for start in dict.fromkeys(path.x[0] for path in picture.paths if path.x):
        axes.plot(*start, linestyle="", zorder=6, **START)
    for solution in dict.fromkeys(picture.solutions):
        axes.plot(*solution, linestyle="", zorder=7, **SOLUTION)


def _labels(figure: Figure, axes: Axes, picture: Trajectories, chosen: Looks) -> None:
    """Label the quadrants in the corners, and a few iterates with their numbers, in axes whose unit is the point."""
    width, height = axes.bbox.width * 72 / figure.dpi, axes.bbox.height * 72 / figure.dpi
    above = figure.add_axes(axes.get_position().bounds, frameon=False, xlim=(0, width), ylim=(0, height), zorder=10)
    above.set_axis_off()
    drawing = Drawing(above)
    for corner, next_corner in pairwise((0j, complex(width), complex(width, height), 1j * height, 0j)):
        drawing.take_line(corner, next_corner)
    for members in SETS:
        right, top = 1 in members, 2 in members
        sides: dict[str, Any] = {"ha": "right" if right else "left", "va": "top" if top else "bottom"}
        place = complex(width - INSET if right else INSET, height - INSET if top else INSET)
        above.text(place.real, place.imag, variables(members), fontsize=FONT, path_effects=[OUTLINE], **sides)
        drawing.take(place + np.add.outer((-1 if right else 1) * ACROSS, (-1j if top else 1j) * UP).ravel())

    def at(points: Sequence[Pair]) -> Any:
        """Return the places of points of the plane, in points from the lower left corner; none outside the axes."""
        places = axes.transAxes.inverted().transform(axes.transData.transform(points)) * (width, height)
        places[~((places >= 0) & (places <= (width, height))).all(axis=1)] = np.nan
        return places[:, 0] + 1j * places[:, 1]

    runs = [(path, at(path.x)) for path in picture.paths if path.x]
    for mark in at([*picture.solutions, *(path.x[0] for path, _ in runs)]):
        drawing.take(mark + 5 * MARK)
    numbered: list[tuple[complex, str, str]] = []
    for path, places in runs:
        for start, end in pairwise(places):
            if not np.isnan(end - start):
                drawing.take_line(start, end)
        for k, place in zip(path.k, places, strict=True):
            is_wanted = not np.isnan(place) and (k in NUMBERS or k == path.k[-1] > 0)
            if is_wanted and all(abs(place - other) >= APART for other, _, _ in numbered):
                numbered.append((place, str(k), chosen[path.name, path.label].color))
                drawing.take(place + 3 * MARK)
    everywhere = np.concatenate([places for _, places in runs]) if runs else np.empty(0)
    for place, number, color in numbered:
        drawing.label(number, place, math.pi / 4)
        text = above.texts[-1]
        text.set(color=color, path_effects=[OUTLINE], fontsize=SMALL_FONT)
        written = complex(*text.get_position())
        if np.nanmin(np.abs(everywhere - written)) < NEARER * abs(place - written):
            text.remove()  # it would seem to be the number of another iterate
