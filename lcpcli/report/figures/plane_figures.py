"""The complementary cones of an LCP with two unknowns, and the paths of runs on such
LCPs over the merit function.

w - M z = q with w, z >= 0 and z'w = 0 says that q lies in a cone that is spanned, for
each j, by column j of I or by column j of -M (K. G. Murty 1972; R. W. Cottle, J.-S.
Pang and R. E. Stone, The Linear Complementarity Problem, section 1.3). Overlapping
cones have arcs of different radii, and a ray through q crosses the arcs of the cones
that contain q.

The plane of the paths is that of x with z = |x| + x and w = |x| - x, in which F(x) = M
z - w + q is linear in each quadrant: the cones are the images of the quadrants. The
contours are those of |F(x)|; F is 0 only at solutions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Patch, Rectangle, Wedge
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, MaxNLocator

from lcpcli.enumeration.search import SolutionSet
from lcpcli.linalg import matrices
from lcpcli.report import wording
from lcpcli.report.figures.style import (
    FONT,
    METHODS,
    SMALL_FONT,
    WIDTH,
    LineStyles,
    add_legend,
    fitted_text,
    styles_of,
)
from lcpcli.report.plotting import Panel

FULL_CIRCLE = 2 * math.pi
# radians: closer directions are treated as equal; far below what a picture shows, far
# above rounding.
SAME = 1e-9
# The j for which z_j > 0 is allowed, not w_j > 0.
SETS: tuple[tuple[int, ...], ...] = ((), (1,), (2,), (1, 2))
SECTOR, RAY, LINE, POINT = "sector", "ray", "line", "point"
# In points: the radius of the outermost arc, and how much smaller the next is.
ARC, APART = 78.0, 13.0


class Cone(NamedTuple):
    """A cone. parts : the start and the extent of a sector, in radians; for any other
    cone, the direction of each ray and 0. radius : of its arc, in points: the largest
    one that no overlapping cone before it, in the order of SETS, has."""

    parts: tuple[tuple[float, float], ...]
    radius: float = ARC

    @property
    def kind(self) -> str:
        """Return SECTOR; RAY, from the origin; LINE, through it; or POINT, the origin
        alone."""
        return (
            SECTOR
            if any(extent for _, extent in self.parts)
            else (POINT, RAY, LINE)[len(self.parts)]
        )

    def overlaps(self, other: Cone) -> bool:
        """Return whether two sectors have a common interior point, or a ray or line and
        another cone have a common point other than 0."""
        margin = -SAME if self.kind == other.kind == SECTOR else SAME
        rotations = [
            ((second_start - first_start) % FULL_CIRCLE, first_extent, second_extent)
            for first_start, first_extent in self.parts
            for second_start, second_extent in other.parts
        ]
        return any(
            rotation < first_extent + margin
            or FULL_CIRCLE - rotation < second_extent + margin
            for rotation, first_extent, second_extent in rotations
        )


def angle(vector: Sequence[float]) -> float | None:
    """Return the direction of a vector, from 0 to 2 pi; None for the zero vector."""
    x, y = vector
    return None if x == y == 0 else math.atan2(y + 0.0, x + 0.0) % FULL_CIRCLE


def generators(M: Sequence[Sequence[float]]) -> dict[str, float | None]:
    units = {"$I_1$": 0.0, "$I_2$": math.pi / 2}
    return units | {f"$-M_{j + 1}$": angle((-M[0][j], -M[1][j])) for j in (0, 1)}


def cones(M: Sequence[Sequence[float]]) -> list[Cone]:
    """Return the cone of each of SETS, spanned by the columns of -M in the set and the
    columns of I outside the set."""
    directions = generators(M)
    made: list[Cone] = []
    for positive_z in SETS:
        spanning = [
            directions[f"$-M_{j}$" if j in positive_z else f"$I_{j}$"] for j in (1, 2)
        ]
        angles = [direction for direction in spanning if direction is not None]
        parts = tuple((direction, 0.0) for direction in angles[:1])
        rotation = rotation_to(angles[0], angles[-1]) if angles else 0.0
        if abs(rotation) > math.pi - SAME:
            parts = ((angles[0], 0.0), (angles[0] + math.pi, 0.0))
        elif abs(rotation) >= SAME:
            parts = ((angles[0] if rotation > 0 else angles[-1], abs(rotation)),)
        cone = Cone(parts)
        radii_in_use = {other.radius for other in made if cone.overlaps(other)}
        made.append(
            cone._replace(
                radius=max({ARC - APART * k for k in range(len(SETS))} - radii_in_use)
            )
        )
    return made


def rotation_to(first: float, last: float) -> float:
    """Return the angle from one direction to another, from -pi to pi."""
    return (last - first + math.pi) % FULL_CIRCLE - math.pi


KINDS = {SECTOR: "", RAY: ": a ray", LINE: ": a line", POINT: ": the origin"}
COLORS = tuple(
    METHODS[name].color for name in ("fixed-point", "milp", "newton", "lemke")
)
COLUMN = WIDTH / 2  # inches
# Lengths in the axes, in points.
# From the origin to the frame: a little less than half the width of a column, 126.
REACH = 124.0
# From the origin to the tip of an axis or arrow, to q, to a label.
AXIS, VECTOR, Q, LABEL = 91.0, 84.0, 91.0, 97.0
# Vectors of closer directions have one label, as two would touch.
ALIKE = math.radians(15)
FILLS = (0.15, 0.35)  # the opacity of a sector without q, and of a sector that holds q
CHECK = "\u2713"
ARROW = {
    "arrowstyle": "-|>,head_width=0.22,head_length=0.5",
    "shrinkA": 0,
    "shrinkB": 0,
    "color": "black",
}
OUTLINE = withStroke(linewidth=2.0, foreground="white")


def holding(solution_set: SolutionSet) -> list[bool]:
    """Return whether the cone of each of SETS contains q: whether there is a solution
    with w = 0 in the set and z = 0 outside."""
    points = solution_set.arranged.points
    solutions = [list(zip(z, solution_set.data.w(z), strict=True)) for z in points]
    sets = [(1 in positive_z, 2 in positive_z) for positive_z in SETS]
    return [
        any(not (one[first] or other[second]) for one, other in solutions)
        for first, second in sets
    ]


def draw(solution_set: SolutionSet) -> Figure:
    """Draw the figure, as wide as one column of a journal."""
    problem, holds_q = solution_set.data.problem, holding(solution_set)
    M, q = matrices.dense(problem.M).tolist(), problem.q.tolist()
    figure = Figure(figsize=(COLUMN, COLUMN + 0.2))  # with space for the titles
    axes = _coordinates(figure)
    shapes, directions = cones(M), generators(M)
    for cone, color, holds in zip(shapes, COLORS, holds_q, strict=True):
        _cone(axes, cone, color, FILLS[holds])
    for direction in {each for each in directions.values() if each is not None}:
        arrow = ARROW | {"linewidth": 1.1}
        axes.annotate("", _at(VECTOR, direction), (0, 0), arrowprops=arrow, zorder=5)
    around = [cone for cone, holds in zip(shapes, holds_q, strict=True) if holds]
    _vector_q(axes, angle(q), around)
    _labels(axes, directions | {"$q$": angle(q)})
    rows = "; ".join(" ".join(map(_number, row)) for row in M)
    data = [f"M = [{rows}],  q = ({', '.join(map(_number, q))})"]
    data += [f"z{j} = {name}" for j, name in enumerate(problem.names, 1) if name]
    titles = f"{solution_set.count}: {wording.title(problem)}", ",  ".join(data)
    axes.set_title(
        "\n".join(fitted_text(title, FONT, COLUMN - 0.2) for title in titles)
    )
    _legend(figure, shapes, holds_q)
    return figure


def _coordinates(figure: Figure) -> Axes:
    """Return axes through the origin, without a frame."""
    span = (-REACH, REACH)
    axes = figure.add_subplot(
        xlim=span, ylim=span, aspect="equal", xticks=[], yticks=[], frame_on=False
    )
    limits = [-AXIS, AXIS]
    axes.plot(limits, [0, 0], [0, 0], limits, color="0.6", linewidth=0.6, zorder=1)
    return axes


def _vector_q(axes: Axes, direction: float | None, around: Sequence[Cone]) -> None:
    """Draw q, the ray through it, and where this crosses the arcs of the cones around
    it."""
    at = (0.0, 0.0) if direction is None else _at(Q, direction)
    if direction is not None:
        line_style: dict[str, Any] = {
            "color": "black",
            "linewidth": 1.0,
            "dashes": (3, 2),
        }
        axes.plot(*zip((0, 0), at, strict=True), zorder=5, **line_style)
        line_style = {"markersize": 4.2, "mfc": "white", "mec": "black", "mew": 0.9}
        for cone in around:
            if cone.kind != POINT:
                axes.plot(*_at(cone.radius, direction), "o", zorder=7, **line_style)
    axes.plot(*at, "o", markersize=5.5, color="black", zorder=7)


def _legend(figure: Figure, shapes: Sequence[Cone], holds_q: Sequence[bool]) -> None:
    """Add the legend of the cones, by whose height the figure grows."""
    handles, labels = [], []
    for cone, color, positive_z, holds in zip(
        shapes, COLORS, SETS, holds_q, strict=True
    ):
        face = to_rgba(color, FILLS[holds])
        handles.append(Patch(facecolor=face, edgecolor=color, linewidth=1.6))
        mark = f"  {CHECK}" if holds else ""
        labels.append(f"{variables(positive_z)}{KINDS[cone.kind]}{mark}")
    title = (
        f"Variables that may be positive in each cone ({CHECK}: q lies in "
        "it).\nOnly directions count."
    )
    legend_style: dict[str, Any] = {
        "title_fontsize": SMALL_FONT,
        "alignment": "left",
        "handlelength": 1.6,
    }
    legend = figure.legend(
        handles, labels, title=title, ncols=2, loc="outside lower left", **legend_style
    )
    height = legend.get_window_extent().height / figure.dpi
    figure.set_figheight(figure.get_figheight() + height)


def _at(radius: float, direction: float) -> tuple[float, float]:
    return radius * math.cos(direction), radius * math.sin(direction)


def _cone(axes: Axes, cone: Cone, color: str, fill: float) -> None:
    """Draw a sector with its arc, thick rays for a ray or a line, or a ring for the
    origin."""
    radius, add = cone.radius, axes.add_patch
    if cone.kind == POINT:
        axes.plot(
            0,
            0,
            "o",
            markersize=9,
            color="none",
            markeredgecolor=color,
            mew=2.2,
            zorder=6,
        )
    elif cone.kind == SECTOR:
        ((start, width),) = cone.parts
        angles = math.degrees(start), math.degrees(start + width)
        add(
            Wedge(
                (0, 0),
                radius,
                *angles,
                facecolor=color,
                alpha=fill,
                linewidth=0,
                zorder=2,
            )
        )
        add(
            Arc(
                (0, 0),
                2 * radius,
                2 * radius,
                theta1=angles[0],
                theta2=angles[1],
                color="white",
                linewidth=3.6,
                zorder=3,
            )
        )
        add(
            Wedge(
                (0, 0),
                radius,
                *angles,
                fill=False,
                edgecolor=color,
                linewidth=1.6,
                zorder=3,
            )
        )
    else:
        for ray, _ in cone.parts:
            axes.plot(
                *zip((0, 0), _at(radius, ray), strict=True),
                c=color,
                lw=5,
                solid_capstyle="butt",
                zorder=4,
            )


def _labels(axes: Axes, directions: dict[str, float | None]) -> None:
    """Write the names of vectors beyond their tips, those of close directions together,
    and those of zero vectors at the origin."""
    names: dict[float, list[str]] = {}
    for name, direction in directions.items():
        if direction is not None:
            close_directions = (
                other for other in names if abs(rotation_to(direction, other)) < ALIKE
            )
            names.setdefault(next(close_directions, direction), []).append(name)
    for direction, vector_names in names.items():
        x, y = math.cos(direction), math.sin(direction)
        across = _side(x, "left", "right")
        up = _side(y, "bottom", "top")
        text = ("\n" if abs(x) > 0.5 else ", ").join(vector_names)
        axes.text(
            LABEL * x,
            LABEL * y,
            text,
            ha=across,
            va=up,
            path_effects=[OUTLINE],
            zorder=8,
        )
    zero = [
        name.strip("$-") for name, direction in directions.items() if direction is None
    ]
    if zero:
        axes.text(
            -6,
            -6,
            f"${' = '.join(zero)} = 0$",
            ha="right",
            va="top",
            path_effects=[OUTLINE],
            zorder=8,
        )


def _side(coordinate: float, if_positive: str, if_negative: str) -> str:
    """Return the alignment of a text next to a vector, by a coordinate of the
    vector."""
    if abs(coordinate) <= 0.2:
        return "center"
    return if_positive if coordinate > 0 else if_negative


def variables(positive_z: tuple[int, ...]) -> str:
    """Return the names of the variables that may be positive in a cone: those of z in
    the set, and those of w outside."""
    return ", ".join(f"${'z' if j in positive_z else 'w'}_{j}$" for j in (1, 2))


def _number(value: float) -> str:
    return f"{value + 0.0:.4g}".replace("-", "\u2212")


POINTS = 240  # of the grid on which |F| is computed, in each direction
# Number of contours, and the smallest |F| that they show, relative to the largest.
BANDS, DEPTH = 10, 0.02
# Colours and labels are legible on these greys.
GREYS = LinearSegmentedColormap.from_list("", ["white", "0.74"])
# Relative to the length of an axis: the margin beyond the data, and the smallest
# length of a quadrant, for labels.
MARGIN, LEAST = 0.14, 0.22
# Relative to the size of the start and the solutions: farther iterates lie outside.
FARTHEST = 3.0
# Numbers of iterates that may have a label.
NUMBERS = [step * 10**decade for decade in range(7) for step in (1, 2, 5)]
TICKS = 5  # intervals between labels on an axis at most
LABELS_APART = 0.12  # of the length of an axis, between two iterates with labels
INSET = 4  # points: of the labels in the corners
BESIDE = 0.035  # of the length of an axis: from an iterate to its number
HOLLOW: dict[str, Any] = {
    "linestyle": "",
    "markerfacecolor": "white",
    "markeredgecolor": "black",
}
START = HOLLOW | {"marker": "s", "markersize": 6.5}
SOLUTION = HOLLOW | {"marker": "*", "markersize": 11}


@np.errstate(over="ignore", invalid="ignore")
def merit(M: Any, q: Any, x: Any) -> Any:
    z, w = np.abs(x) + x, np.abs(x) - x
    F = np.tensordot(M, z, axes=1) - w + np.reshape(q, (2, *[1] * (np.ndim(x) - 1)))
    return np.hypot(*F)


def ranges(picture: Panel) -> list[tuple[float, float]]:
    """Return the range of each axis: around the origin, the starts, the solutions, and
    the iterates not far from these."""
    anchors = np.array(
        [
            (0.0, 0.0),
            *picture.solutions,
            *(path.x[0] for path in picture.curves if path.x),
        ]
    )
    farthest = FARTHEST * (
        np.abs(anchors[np.isfinite(anchors).all(axis=1)]).max() or 1.0
    )
    points = np.array([*anchors, *(x for path in picture.curves for x in path.x)])
    points = np.clip(points[np.isfinite(points).all(axis=1)], -farthest, farthest)
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * np.where(high > low, high - low, farthest)
    min_extent = LEAST * (high - low + 2 * margin) / (1 - LEAST)
    return list(
        zip(
            np.minimum(low - margin, -min_extent).tolist(),
            np.maximum(high + margin, min_extent).tolist(),
            strict=True,
        )
    )


def draw_paths(pictures: Sequence[Panel]) -> Figure:
    columns = min(2, len(pictures))
    rows = math.ceil(len(pictures) / columns)
    figure = Figure(figsize=(COLUMN * columns, 3.0 * rows))
    styles = styles_of(
        (path.name, path.label) for picture in pictures for path in picture.curves
    )
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(pictures) :]:
        axes.set_axis_off()
    for axes, picture in zip(grid, pictures, strict=False):
        _merit(axes, picture)
        paths = [path for path in picture.curves if path.x]
        for path in paths:
            line_style, (xs, ys) = styles[path.name, path.label], np.array(path.x).T
            axes.plot(
                xs,
                ys,
                zorder=4,
                path_effects=[OUTLINE],
                **line_style.line | {"linewidth": 1.0},
            )
            axes.plot(
                xs,
                ys,
                linestyle="",
                zorder=5,
                **line_style.points | {"markersize": 3, "markeredgewidth": 0.5},
            )
        for start in dict.fromkeys(tuple(path.x[0]) for path in paths):
            axes.plot(*start, zorder=6, **START)
        for solution in dict.fromkeys(map(tuple, picture.solutions)):
            axes.plot(*solution, zorder=7, **SOLUTION)
        _numbers(axes, picture, styles)
    signs = [(Line2D([], [], **START), "start")]
    signs += [(Line2D([], [], **SOLUTION), "solution")] * any(
        picture.solutions for picture in pictures
    )
    paths = [path for picture in pictures for path in picture.curves]
    drawn = {(path.name, path.label) for path in paths if len(path.x) > 1}
    signs += [
        (Line2D([], [], linestyle=""), f"{key[1]}: no iterates")
        for key in styles
        if key not in drawn
    ]
    return add_legend(
        figure,
        {key: line_style for key, line_style in styles.items() if key in drawn},
        signs,
    )


def _merit(axes: Axes, picture: Panel) -> None:
    """Draw the contours of |F| in the quadrants, whose names are in the corners."""
    (left, right), (bottom, top) = ranges(picture)
    x, y = np.linspace(left, right, POINTS), np.linspace(bottom, top, POINTS)
    values = merit(
        matrices.dense(picture.problem.M),
        picture.problem.q,
        np.array(np.meshgrid(x, y)),
    )
    values = np.nan_to_num(values, nan=np.inf, posinf=np.finfo(float).max)
    highest_level = float(values.max()) or 1.0
    lowest_level = max(float(values.min()), DEPTH * highest_level)
    if lowest_level >= highest_level:
        lowest_level = highest_level / 10
    levels = np.geomspace(lowest_level, highest_level, BANDS + 1)
    values = np.clip(values, lowest_level, highest_level)
    filled = axes.contourf(
        x,
        y,
        values,
        levels,
        norm=LogNorm(lowest_level, highest_level),
        cmap=GREYS,
        zorder=0,
    )
    axes.contour(x, y, values, levels[1:-1], colors="white", linewidths=0.4, zorder=0.5)
    for positive_z, color in zip(SETS, COLORS, strict=True):
        corner = right if 1 in positive_z else left, top if 2 in positive_z else bottom
        axes.add_patch(
            Rectangle(
                (0, 0), *corner, facecolor=color, alpha=FILLS[0], linewidth=0, zorder=1
            )
        )
        inwards = (
            INSET - 2 * INSET * (1 in positive_z),
            INSET - 2 * INSET * (2 in positive_z),
        )
        style: dict[str, Any] = {
            "ha": "right" if 1 in positive_z else "left",
            "va": "top" if 2 in positive_z else "bottom",
        }
        style |= {"textcoords": "offset points", "path_effects": [OUTLINE], "zorder": 9}
        axes.annotate(
            variables(positive_z),
            (1 in positive_z, 2 in positive_z),
            inwards,
            xycoords="axes fraction",
            **style,
        )
    axes.axhline(0, color="black", linewidth=0.8, zorder=2)
    axes.axvline(0, color="black", linewidth=0.8, zorder=2)
    axes.set(xlim=(left, right), ylim=(bottom, top), xlabel="$x_1$", ylabel="$x_2$")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(TICKS))
    axes.set_title(fitted_text(wording.title(picture.problem), FONT, COLUMN - 1.2))
    bar = axes.figure.colorbar(filled, ax=axes, pad=0.02, aspect=30)
    bar.set_ticks(LogLocator(10, subs=(1, 2, 5), numticks=8))
    bar.ax.yaxis.set_major_formatter("{x:g}")
    bar.ax.minorticks_off()
    bar.set_label(r"$\|F(x)\|_2$")


def _numbers(axes: Axes, picture: Panel, styles: LineStyles) -> None:
    """Label a few iterates with their numbers, apart from each other and from the
    corners."""
    low, high = np.transpose(ranges(picture))
    numbered: list[Any] = []
    everywhere = (
        np.array([x for path in picture.curves for x in path.x]).reshape(-1, 2) - low
    ) / (high - low)
    everywhere = everywhere[np.isfinite(everywhere).all(axis=1)]
    for path in picture.curves:
        for k, x in zip(path.k, path.x, strict=True):
            relative_position = (np.array(x) - low) / (high - low)
            is_inside = bool(
                ((relative_position > 0) & (relative_position < 0.95)).all()
                and (np.abs(relative_position - 0.5) < (0.3, 0.35)).any()
            )
            is_free = all(
                np.abs(relative_position - other).max() >= LABELS_APART
                for other in numbered
            )
            is_free &= bool(
                (
                    np.abs(everywhere - relative_position - BESIDE).max(axis=1)
                    >= 0.75 * BESIDE
                ).all()
            )  # of iterates, too
            if (k in NUMBERS or k == path.k[-1] != 0) and is_inside and is_free:
                numbered.append(relative_position)
                text_style: dict[str, Any] = {
                    "color": styles[path.name, path.label].color,
                    "fontsize": SMALL_FONT,
                }
                text_style |= {
                    "textcoords": "offset points",
                    "path_effects": [OUTLINE],
                    "zorder": 9,
                }
                axes.annotate(str(k), (x[0], x[1]), (4, 4), **text_style)
