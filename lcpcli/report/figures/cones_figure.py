"""The complementary cones of an LCP with two unknowns, and q: each cone that holds q gives a solution.

w - M z = q with w, z >= 0 and z'w = 0 says that q lies in a cone that is spanned, for each j, by the column j of I or
that of -M (K. G. Murty 1972; R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, section
1.3). Only directions count, so that all vectors are drawn with one length, and cones reach to an arc. Cones that
overlap have arcs of different radii, and a ray through q crosses the arcs of those that hold it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Patch, Wedge

from lcpcli.report.figures import cone_shapes
from lcpcli.report.figures.cone_shapes import LINE, POINT, RAY, SAME, SECTOR, SETS, TURN, Cone
from lcpcli.report.figures.convergence_figure import GREY
from lcpcli.report.figures.data import Cones
from lcpcli.report.figures.style import FONT, METHODS, SMALL, WIDTH, extent, fitted

COLORS = tuple(METHODS[name].color for name in ("fixed-point", "milp", "newton", "lemke"))
COLUMN = WIDTH / 2  # inches
BOLD = 1.15  # how much wider text is in bold
EDGE = 0.08  # inches around everything
HEADER, LEGEND = 0.41, 0.74  # inches above and below the axes
# Lengths in the axes, in points.
REACH = 124.0  # from the origin to the frame
AXIS = 105.0
VECTOR, Q = 91.0, 99.0  # from the origin to the tip, and to q
ARC, APART = 84.0, 13.5  # the radius of the outermost arc, and how much smaller the next is
STEP = 2.0  # between the points that stand for a line or an area
CLEAR = 2.0  # at least, around a label
FILLS = (0.15, 0.35)  # how opaque a sector is that does not hold q, and one that does
CHECK = "\u2713"
KINDS = {SECTOR: "", RAY: ": a ray", LINE: ": a line", POINT: ": the origin"}
ARROW = {"arrowstyle": "-|>,head_width=0.22,head_length=0.5", "shrinkA": 0, "shrinkB": 0, "color": "black"}
MARK = np.array([(x, y) for x in (-1, 0, 1) for y in (-1, 0, 1)])  # points that stand for a mark of that size

Pair = tuple[float, float]


class Place(NamedTuple):
    """The centre of a label, and its rotation in radians."""

    x: float
    y: float
    rotation: float = 0.0


class Drawing:
    """What is drawn in axes whose unit is the point, as points that labels avoid."""

    def __init__(self, axes: Axes) -> None:
        self.axes = axes
        self._taken = np.empty((0, 2))

    def take(self, points: Iterable[Sequence[float]]) -> None:
        """Keep labels off these points."""
        self._taken = np.vstack([self._taken, *points])

    def take_line(self, start: Pair, end: Pair) -> None:
        """Keep labels off a line."""
        self.take(np.linspace(start, end, max(2, math.ceil(math.dist(start, end) / STEP))))

    def label(
        self, text: str, size: float, places: Iterable[Place], free: float = CLEAR, least: float = -math.inf
    ) -> bool:
        """Write a text at the first place with so much free space around it, or else where there is most, but not where
        there is less than `least`; whether it was written."""
        width, height = extent(text, size)
        spaces = [(min(self._space(place, width, height), free), place) for place in places]
        space, (x, y, rotation) = max(spaces, key=lambda pair: pair[0])
        if space < least:
            return False
        style: dict[str, Any] = {"fontsize": size, "ha": "center", "va": "center", "zorder": 8}
        self.axes.text(x, y, text, rotation=math.degrees(rotation), **style)
        across, up = (np.linspace(-side / 2, side / 2, math.ceil(side / STEP) + 1) for side in (width, height))
        box = np.reshape(np.meshgrid(across, up), (2, -1)).T
        self.take(box @ _turned(-rotation) + [x, y])
        return True

    def _space(self, place: Place, width: float, height: float) -> float:
        """How far a label is from all that is drawn, across or along it; negative if it covers any of that."""
        across, up = np.abs((self._taken - place[:2]) @ _turned(place.rotation)).T
        return float(np.max([across - width / 2, up - height / 2], axis=0).min())


def _turned(rotation: float) -> np.ndarray[Any, Any]:
    """What turns rows of coordinates back by an angle."""
    cos, sin = math.cos(rotation), math.sin(rotation)
    return np.array([[cos, -sin], [sin, cos]])


def draw(picture: Cones) -> Figure:
    """The figure, as wide as one column of a journal."""
    square = 2 * REACH / 72
    height = HEADER + square + LEGEND
    figure = Figure(figsize=(COLUMN, height))
    figure.set_layout_engine("none")
    axes = figure.add_axes(((COLUMN - square) / 2 / COLUMN, LEGEND / height, square / COLUMN, square / height))
    axes.set(xlim=(-REACH, REACH), ylim=(-REACH, REACH))
    axes.set_axis_off()
    shapes, generators = cone_shapes.cones(picture.M), cone_shapes.generators(picture.M)
    drawing = Drawing(axes)
    _axes(drawing)
    for cone, color, holds in zip(shapes, COLORS, picture.holding, strict=True):
        _cone(drawing, cone, color, FILLS[holds])
    vectors = _vectors(drawing, generators)
    _q(drawing, picture, shapes)
    for direction, labels in vectors:
        _label_around(drawing, ", ".join(labels), _at(direction, VECTOR), direction, free=3)
    zero = [label.strip("$-") for label, direction in generators.items() if direction is None]
    if zero:
        _label_around(drawing, f"${' = '.join(zero)} = 0$", (0.0, 0.0), 1.25 * math.pi)
    _cone_labels(drawing, shapes)
    _header(figure, picture)
    _legend(figure, picture, shapes)
    return figure


def _at(direction: float, radius: float) -> Pair:
    return radius * math.cos(direction), radius * math.sin(direction)


def _axes(drawing: Drawing) -> None:
    """The axes of q, with their names where they end, and a frame that is not seen, which keeps labels inside."""
    corners = [(-REACH, -REACH), (REACH, -REACH), (REACH, REACH), (-REACH, REACH)]
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        drawing.take_line(start, end)
    for name, direction in (("$q_1$", 0.0), ("$q_2$", math.pi / 2)):
        ends = _at(direction, -AXIS), _at(direction, AXIS)
        drawing.axes.plot(*zip(*ends, strict=True), color="0.6", linewidth=0.6, zorder=1)
        drawing.take_line(*ends)
        _label_around(drawing, name, ends[1], direction)


def _cone(drawing: Drawing, cone: Cone, color: str, fill: float) -> None:
    """A sector with its arc, thick rays for a ray or a line, or a ring for the origin."""
    radius = _radius(cone)
    if cone.kind == POINT:
        drawing.axes.plot(0, 0, marker="o", markersize=9, color="none", markeredgecolor=color, mew=2.2, zorder=6)
        drawing.take(5 * MARK)
    elif cone.kind == SECTOR:
        ((start, width),) = cone.parts
        degrees = math.degrees(start), math.degrees(start + width)
        drawing.axes.add_patch(Wedge((0, 0), radius, *degrees, facecolor=color, alpha=fill, linewidth=0, zorder=2))
        rim: dict[str, Any] = {"theta1": degrees[0], "theta2": degrees[1], "color": "white", "linewidth": 3.6}
        drawing.axes.add_patch(Arc((0, 0), 2 * radius, 2 * radius, zorder=3, **rim))
        drawing.axes.add_patch(Wedge((0, 0), radius, *degrees, fill=False, edgecolor=color, linewidth=1.6, zorder=3))
        steps = max(2, round(radius * width / 2))
        drawing.take(_at(start + width * i / steps, radius) for i in range(steps + 1))
    else:
        for ray, _ in cone.parts:
            tip = _at(ray, radius)
            drawing.axes.plot([0, tip[0]], [0, tip[1]], color=color, linewidth=5, solid_capstyle="butt", zorder=4)


def _radius(cone: Cone) -> float:
    return ARC - APART * cone.level


def _vectors(drawing: Drawing, generators: dict[str, float | None]) -> list[tuple[float, list[str]]]:
    """Draw the generators as arrows; each of their directions with its labels."""
    vectors: list[tuple[float, list[str]]] = []
    for label, direction in generators.items():
        if direction is None:
            continue
        same = [labels for other, labels in vectors if abs((other - direction + math.pi) % TURN - math.pi) < SAME]
        if same:
            same[0].append(label)
            continue
        vectors.append((direction, [label]))
        tip = _at(direction, VECTOR)
        drawing.axes.annotate("", tip, (0, 0), arrowprops=ARROW | {"linewidth": 1.1}, zorder=5)
        drawing.take_line((0, 0), tip)
    return vectors


def _q(drawing: Drawing, picture: Cones, shapes: list[Cone]) -> None:
    """Mark q, the ray through it, and where that crosses the arcs of the cones that hold q."""
    direction = cone_shapes.angle(picture.q)
    at = (0.0, 0.0) if direction is None else _at(direction, Q)
    if direction is not None:
        drawing.axes.plot([0, at[0]], [0, at[1]], color="black", linewidth=1.0, dashes=(3, 2), zorder=5)
        drawing.take_line((0, 0), at)
        for cone, holds in zip(shapes, picture.holding, strict=True):
            if holds and cone.kind != POINT:
                crossing = _at(direction, _radius(cone))
                drawing.axes.plot(*crossing, "o", markersize=4.2, mfc="white", mec="black", mew=0.9, zorder=7)
                drawing.take(crossing + 2 * MARK)
    drawing.axes.plot(*at, "o", markersize=5.5, color="black", zorder=7)
    drawing.take(at + 3 * MARK)
    _label_around(drawing, "$q = 0$" if direction is None else "$q$", at, direction or 0.0)


def _label_around(drawing: Drawing, text: str, at: Pair, direction: float, free: float = CLEAR) -> None:
    """Write a label beside a point, in that direction if there is room."""
    width, height = extent(text, FONT)

    def places() -> Iterator[Place]:
        for gap in (5, 8, 11, 16):
            for i in range(25):
                x, y = _at(direction + (i + 1) // 2 * (-1) ** i * math.pi / 12, 1.0)
                yield Place(at[0] + x * (width / 2 + gap), at[1] + y * (height / 2 + gap))

    drawing.label(text, FONT, places(), free)


def _cone_labels(drawing: Drawing, shapes: list[Cone]) -> None:
    """Write into each sector which variables may be positive, upright or along its arc, where fewest others overlap."""
    for cone, chosen in zip(shapes, SETS, strict=True):
        if cone.kind != SECTOR:
            continue
        ((start, width),) = cone.parts
        angles = [start + width * (0.5 + (i + 1) // 2 * (-1) ** i / 40) for i in range(38)]
        inside = [(angle, share * _radius(cone), 0.0) for share in (0.66, 0.56, 0.76) for angle in angles]
        along = [(angle, _radius(cone) - APART / 2, angle % math.pi - math.pi / 2) for angle in angles]
        places: dict[int, list[Place]] = {}
        for angle, radius, rotation in inside + along:
            covering = sum(cone_shapes.holds(other, angle) and radius < _radius(other) for other in shapes)
            places.setdefault(covering, []).append(Place(*_at(angle, radius), rotation))
        any(drawing.label(_variables(chosen), SMALL, fewest, 8, CLEAR) for _, fewest in sorted(places.items()))


def _variables(chosen: tuple[int, ...]) -> str:
    return ", ".join(f"${'z' if j in chosen else 'w'}_{j}$" for j in (1, 2))


def _header(figure: Figure, picture: Cones) -> None:
    """The title and the number of solutions, and below them M and q."""
    width, height = figure.get_size_inches()
    left, right = EDGE / width, 1 - EDGE / width
    count = fitted(picture.count, FONT, 0.6 * width)
    room = width - 2 * EDGE - BOLD * extent(count, FONT)[0] / 72 - 0.1
    first = {"va": "top", "y": 1 - EDGE / height}
    figure.text(x=left, s=fitted(picture.title, FONT, room), ha="left", **first)
    figure.text(x=right, s=count, ha="right", weight="bold", **first)
    (a, b), (c, d) = ([_number(entry) for entry in row] for row in picture.M)
    data = f"M = [{a} {b}; {c} {d}],  q = ({', '.join(map(_number, picture.q))})"
    named = [f"z{j} = {name}" for j, name in enumerate(picture.names, 1) if name]
    text = fitted(",  ".join([data, *named]), SMALL, width - 2 * EDGE)
    figure.text(left, 1 - (EDGE + 0.16) / height, text, ha="left", va="top", fontsize=SMALL)


def _number(value: float) -> str:
    return f"{value + 0.0:.4g}".replace("-", "\u2212")


def _legend(figure: Figure, picture: Cones, shapes: list[Cone]) -> None:
    """The variables that may be positive in each cone, and a check mark where the cone holds q."""
    handles, labels = [], []
    for cone, color, chosen, holds in zip(shapes, COLORS, SETS, picture.holding, strict=True):
        patch = Patch(facecolor=to_rgba(color, FILLS[holds]), edgecolor=color, linewidth=1.6)
        line = Line2D([], [], color=color, linewidth=5, solid_capstyle="butt")
        ring = Line2D([], [], color="none", marker="o", markersize=8, markeredgecolor=color, markeredgewidth=2.2)
        handles.append({SECTOR: patch, POINT: ring}.get(cone.kind, line))
        labels.append(_variables(chosen) + KINDS[cone.kind] + f"  {CHECK}" * holds)
    title = f"Variables that may be positive in each cone ({CHECK}: q lies in it)"
    width, height = figure.get_size_inches()
    look: dict[str, Any] = {"title_fontsize": SMALL, "alignment": "left", "borderpad": 0, "borderaxespad": 0}
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (EDGE / width, (EDGE + 0.17) / height)}
    figure.legend(handles, labels, title=title, ncols=2, handlelength=1.6, **place, **look)
    note = "Only directions count: all vectors are drawn with one length."
    figure.text(EDGE / width, EDGE / height, note, fontsize=SMALL, color=GREY, va="bottom")
