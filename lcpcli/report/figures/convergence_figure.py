"""How runs converge: one row a problem, error against run time on the left and against the iteration on the right."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lcpcli.report.figures import curves, labels, ranges
from lcpcli.report.figures.data import Panel
from lcpcli.report.figures.labels import Drawn, End
from lcpcli.report.figures.ranges import Range
from lcpcli.report.figures.style import FONT, POINTS, Looks, add_axes, fitted, looks, name_axes, page

WIDTH = 7.0  # inches, as all lengths here: two columns of a journal
ROW = 2.45  # from one row to the next
AXES = 1.72  # the height of axes
TOP = 0.27  # above the axes, for the title
LEFT = 0.79
GUTTER = 0.18
RIGHT = 0.15
MEASURES = {
    "error": "error $|z - z^*|$,\nlargest component",
    "residual": "residual $|\\min(z, Mz + q)|$,\nlargest component",
}


def draw(panels: Sequence[Panel]) -> Figure:
    """The figure, with labels at the ends of all curves or else a legend."""
    chosen = looks((curve.name, curve.label) for panel in panels for curve in panel.curves)
    figure = page(WIDTH, ROW * max(len(panels), 1))
    width = (WIDTH - LEFT - GUTTER - RIGHT) / 2
    seen: list[list[Drawn]] = []
    for i, panel in enumerate(panels):
        bottom = ROW * (len(panels) - i) - TOP - AXES
        left, right = (add_axes(figure, (x, bottom, width, AXES)) for x in (LEFT, LEFT + width + GUTTER))
        left.set_title(fitted(figure, panel.title, FONT, (WIDTH - LEFT) * POINTS), loc="left", parse_math=False)
        right.tick_params(labelleft=False)
        seen.append([against_time(left, panel, chosen), _against_iteration(right, panel, chosen)])
    remarks = curves.remarks([drawn for row in seen for drawn in row])
    labels.identify(figure, seen, chosen, remarks)
    return figure


def against_time(axes: Axes, panel: Panel, chosen: Looks) -> Drawn:
    """Error against run time, both logarithmic."""
    name_axes(axes, "run time (s)", MEASURES[panel.measure])
    across = ranges.times(second for curve in panel.curves for second in curve.seconds)
    curves.log_axis(axes, "x", across)
    return _draw(axes, panel, across, [(curve.seconds, curve.errors) for curve in panel.curves], chosen)


def _against_iteration(axes: Axes, panel: Panel, chosen: Looks) -> Drawn:
    name_axes(axes, "iteration", "")
    counted = [[(k, e) for k, e in zip(curve.k, curve.errors, strict=True) if k is not None] for curve in panel.curves]
    across = curves.iteration_axis(axes, [pairs[-1][0] for pairs in counted if pairs])
    return _draw(axes, panel, across, [([k for k, _ in pairs], [e for _, e in pairs]) for pairs in counted], chosen)


def _draw(
    axes: Axes,
    panel: Panel,
    across: Range,
    data: Sequence[tuple[Sequence[float], Sequence[float | None]]],
    chosen: Looks,
) -> Drawn:
    """All curves of a panel in axes whose abscissa is set. data : abscissas and errors of each."""
    up = ranges.errors(panel.curves)
    curves.log_axis(axes, "y", up)
    drawn = Drawn(axes)
    for turn, (curve, (xs, errors)) in enumerate(zip(panel.curves, data, strict=True)):
        points = ranges.inside(xs, errors, across, up)
        look = chosen[curve.name, curve.label]
        curves.draw(axes, points, look, curve.solved, turn)
        drawn.outside |= any(point.beyond for point in points)
        drawn.unsolved |= bool(points) and not curve.solved
        drawn.ends.append(End(points[-1].x, points[-1].y, curve.label, look) if points else None)
    return drawn
