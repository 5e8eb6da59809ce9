"""How runs converge: one row a problem, error against run time on the left and against the iteration on the right."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lcpcli.report.figures import curves, legend, ranges
from lcpcli.report.figures.data import Panel
from lcpcli.report.figures.ranges import Range
from lcpcli.report.figures.style import FONT, WIDTH, Looks, fitted, looks, row_height

TITLE = WIDTH - 1.0  # inches for the title of a row
MEASURES = {
    "error": r"error $\|z - z^*\|_\infty$",
    "residual": r"residual $\|\min(z, Mz + q)\|_\infty$",
}


def draw(panels: Sequence[Panel]) -> Figure:
    """The figure of at least one panel."""
    chosen = looks((curve.name, curve.label) for panel in panels for curve in panel.curves)
    figure = Figure(figsize=(WIDTH, row_height(len(panels)) * len(panels)))
    for panel, (left, right) in zip(panels, figure.subplots(len(panels), 2, sharey="row", squeeze=False), strict=True):
        left.set_title(fitted(panel.title, FONT, TITLE))
        against_time(left, panel, chosen)
        _against_iteration(right, panel, chosen)
    figure.align_labels()
    legend.add(figure, chosen)
    return figure


def against_time(axes: Axes, panel: Panel, chosen: Looks) -> None:
    """Error against run time, both logarithmic."""
    axes.set(xlabel="run time (s)", ylabel=MEASURES[panel.measure])
    across = ranges.times(second for curve in panel.curves for second in curve.seconds)
    curves.log_axis(axes, "x", across)
    _draw(axes, panel, across, [(curve.seconds, curve.errors) for curve in panel.curves], chosen)


def _against_iteration(axes: Axes, panel: Panel, chosen: Looks) -> None:
    axes.set(xlabel="iteration")
    counted = [[(k, e) for k, e in zip(curve.k, curve.errors, strict=True) if k is not None] for curve in panel.curves]
    across = curves.iteration_axis(axes, [pairs[-1][0] for pairs in counted if pairs])
    _draw(axes, panel, across, [([k for k, _ in pairs], [e for _, e in pairs]) for pairs in counted], chosen)


def _draw(
    axes: Axes,
    panel: Panel,
    across: Range,
    data: Sequence[tuple[Sequence[float], Sequence[float | None]]],
    chosen: Looks,
) -> None:
    """All curves of a panel in axes whose abscissa is set. data : abscissas and errors of each."""
    up = ranges.errors(panel.curves)
    curves.log_axis(axes, "y", up)
    for turn, (curve, (xs, errors)) in enumerate(zip(panel.curves, data, strict=True)):
        points = ranges.inside(xs, errors, across, up)
        curves.draw(axes, points, chosen[curve.name, curve.label], curve.solved, turn)
