"""How runs converge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogFormatterMathtext, MaxNLocator, NullFormatter

from lcpcli.report.figures import data
from lcpcli.report.figures import data as ranges
from lcpcli.report.figures.data import Panel, Point, Range
from lcpcli.report.figures.style import FONT, SMALL, WIDTH, Look, Looks, fitted, looks, row_height

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
    add_legend(figure, chosen)
    return figure


def against_time(axes: Axes, panel: Panel, chosen: Looks) -> None:
    """Error against run time, both logarithmic."""
    axes.set(xlabel="run time (s)", ylabel=MEASURES[panel.measure])
    across = ranges.times(second for curve in panel.curves for second in curve.seconds)
    log_axis(axes, "x", across)
    _draw(axes, panel, across, [(curve.seconds, curve.errors) for curve in panel.curves], chosen)


def _against_iteration(axes: Axes, panel: Panel, chosen: Looks) -> None:
    axes.set(xlabel="iteration")
    counted = [[(k, e) for k, e in zip(curve.k, curve.errors, strict=True) if k is not None] for curve in panel.curves]
    across = iteration_axis(axes, [pairs[-1][0] for pairs in counted if pairs])
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
    log_axis(axes, "y", up)
    for turn, (curve, (xs, errors)) in enumerate(zip(panel.curves, data, strict=True)):
        points = ranges.inside(xs, errors, across, up)
        draw_run(axes, points, chosen[curve.name, curve.label], curve.solved, turn)


MOST_MARKERS = 12
MOST_TICKS = 6
STRIP = "0.92"
FULL = 800  # more points than these are thinned to the extremes of each step along the abscissa
STEPS = 250
UNEVEN = 20  # how many times longer than the shortest the longest run is where iterations are counted by powers of ten
RING: dict[str, Any] = {
    "linestyle": "",
    "marker": "o",
    "markersize": 8,
    "markerfacecolor": "none",
    "markeredgewidth": 0.7,
}
CROSS: dict[str, Any] = {"linestyle": "", "marker": "x", "markersize": 8, "markeredgewidth": 1.3}
BEYOND, UNSOLVED = "0 or beyond the axis", "not solved"
SIGNS = {BEYOND: RING, UNSOLVED: CROSS}  # by their labels, which no other artist in axes has


def log_axis(axes: Axes, which: str, span: Range) -> None:
    """Make the x or y axis logarithmic over a range, with ticks at powers of ten."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    (axes.set_xlim if which == "x" else axes.set_ylim)(span.low, span.high)
    majors, minors = data.decades(span, MOST_TICKS)
    axis.set_major_locator(FixedLocator(majors))
    axis.set_minor_locator(FixedLocator(minors))
    axis.set_major_formatter(LogFormatterMathtext())
    axis.set_minor_formatter(NullFormatter())
    shade = axes.axvspan if which == "x" else axes.axhspan
    for strip in ((span.low, span.scale_low), (span.scale_high, span.high)):
        if strip[0] < strip[1]:
            shade(*strip, color=STRIP, linewidth=0, zorder=0)


def iteration_axis(axes: Axes, longest: Sequence[int]) -> Range:
    """Count iterations on the x axis, evenly or, where the longest run hides the shortest, by powers of ten.

    longest : the last k of each run.
    """
    most = max([*longest, 1])
    if most >= 100 and most > UNEVEN * max(min(longest), 1):
        axes.set_xscale("symlog", linthresh=1, linscale=0.4)
        powers = [10**e for e in range(len(str(most)) + 1) if 10**e <= 1.3 * most]
        axes.xaxis.set_major_locator(FixedLocator([0, *powers]))
        axes.xaxis.set_minor_locator(FixedLocator([d * p for p in powers for d in range(2, 10) if d * p < 1.3 * most]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda k, _: f"{k:.0f}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        low, high = -0.15, 1.6 * most
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=MOST_TICKS, integer=True))
        low, high = -0.03 * most, 1.08 * most
    axes.set_xlim(low, high)
    return Range(low, high, low, high)


def draw_run(axes: Axes, points: Sequence[Point], look: Look, solved: bool, turn: int) -> None:
    """A run in axes whose scales and limits are set. turn : its number in the axes, which staggers the markers."""
    if not points:
        return
    at = axes.transData.transform([(p.x, p.y) for p in points])
    if len(points) > 1:
        kept = [points[i] for i in _thinned(at)]
        axes.plot([p.x for p in kept], [p.y for p in kept], zorder=2, **look.line)
    crossed = len(points) - 1 if len(points) > 1 and not solved else None
    marked = [points[i] for i in sorted({*_marked(at, turn), *_first_outside(points)}) if i != crossed]
    axes.plot([p.x for p in marked], [p.y for p in marked], linestyle="", clip_on=False, zorder=3, **look.points)
    ringed = [p for p in marked if p.beyond]
    above: dict[str, Any] = {"color": look.color, "clip_on": False}
    if ringed:
        axes.plot([p.x for p in ringed], [p.y for p in ringed], label=BEYOND, zorder=4, **above, **RING)
    if not solved:
        axes.plot(points[-1].x, points[-1].y, label=UNSOLVED, zorder=5, **above, **CROSS)


def _marked(at: Any, turn: int) -> list[int]:
    """The first point, the last, and some between that are evenly spread along the curve as it is seen."""
    if len(at) <= MOST_MARKERS:
        return list(range(len(at)))
    falling = np.column_stack((at[:, 0], np.minimum.accumulate(at[:, 1])))  # else oscillations would take all markers
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(falling, axis=0).T))))
    shift = 0.25 * (turn % 4 - 1.5)
    wanted = (np.arange(1, MOST_MARKERS - 1) + shift) / (MOST_MARKERS - 1) * length[-1]
    return sorted({0, *np.searchsorted(length, wanted).tolist(), len(at) - 1})


def _first_outside(points: Sequence[Point]) -> list[int]:
    """Where a curve leaves the axes, or some of these places if there are many."""
    first = [i for i, p in enumerate(points) if p.beyond and (i == 0 or points[i - 1].beyond != p.beyond)]
    return first[:: math.ceil(len(first) / MOST_MARKERS) or 1]


def _thinned(at: Any) -> list[int]:
    """The indices of the points that a line needs to look the same: in each step along x the ends and the extremes."""
    n = len(at)
    if n <= FULL:
        return list(range(n))
    x, y = at.T
    step = np.floor((x - x.min()) / (np.ptp(x) or 1.0) * STEPS)
    kept = {0, n - 1}
    for part in np.split(np.arange(n), np.flatnonzero(np.diff(step)) + 1):
        kept |= {int(part[0]), int(part[-1]), int(part[np.argmin(y[part])]), int(part[np.argmax(y[part])])}
    return sorted(kept)


GREY = "0.35"
SAMPLE = 0.6  # inches that a sample takes in front of its label


def add_legend(figure: Figure, chosen: Looks) -> None:
    """Add the legend in as many columns as there is room for; the figure grows by its height, the axes keep theirs."""
    room = figure.get_figwidth() - SAMPLE
    entries = [(Line2D([], [], **(look.points | look.line)), label) for (_, label), look in chosen.items()]
    signs = {label for axes in figure.axes for label in axes.get_legend_handles_labels()[1]}
    entries += [(Line2D([], [], color=GREY, **sign), text) for text, sign in SIGNS.items() if text in signs]
    if not entries:
        return
    handles, texts = zip(*((handle, fitted(text, SMALL, room)) for handle, text in entries), strict=True)
    for rows in range(1, len(entries) + 1):
        columns = math.ceil(len(entries) / rows)
        legend = figure.legend(handles, ["-"] * len(entries), loc="outside lower center", ncols=columns)
        for drawn, text in zip(legend.get_texts(), texts, strict=True):
            drawn.set_text(text)  # a label given above that begins with _ is left out by matplotlib 3.7
        size = legend.get_window_extent()
        if size.width <= figure.bbox.width:
            break
        if rows < len(entries):
            legend.remove()
    figure.set_figheight(figure.get_figheight() + size.height / figure.dpi)
