"""How runs converge: one row a problem, error against run time on the left and against the iteration on the right.

Curves have few markers, rings around what is beyond the axes, and a cross where a run failed; one legend below all axes
names every method once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, MaxNLocator, NullFormatter

from lcpcli.report.figures.data import Panel, Point, Range, decades, errors, inside, times
from lcpcli.report.figures.style import FONT, PAGE, ROW, SMALL, WIDTH, Look, Looks, fitted, looks

TITLE = WIDTH - 1.0  # inches for the title of a row
MEASURES = {
    "error": r"error $\|z - z^*\|_\infty$",
    "residual": r"residual $\|\min(z, Mz + q)\|_\infty$",
}
MOST_MARKERS = 12
MOST_TICKS = 6
STRIP = "0.92"
UNEVEN = 20  # how many times longer than the shortest the longest run is where iterations are counted by powers of ten
GREY = "0.35"
SAMPLE = 0.6  # inches that a sample takes in front of its label in the legend
BEYOND, UNSOLVED = "0 or beyond the axis", "not solved"
SIGNS: dict[str, dict[str, Any]] = {  # by their labels, which no other artist in axes has
    BEYOND: {"linestyle": "", "marker": "o", "markersize": 8, "markerfacecolor": "none", "markeredgewidth": 0.7},
    UNSOLVED: {"linestyle": "", "marker": "x", "markersize": 8, "markeredgewidth": 1.3},
}


def draw(panels: Sequence[Panel]) -> Figure:
    """The figure of at least one panel."""
    chosen = looks((curve.name, curve.label) for panel in panels for curve in panel.curves)
    figure = Figure(figsize=(WIDTH, min(ROW * len(panels), PAGE)))
    for panel, (left, right) in zip(panels, figure.subplots(len(panels), 2, sharey="row", squeeze=False), strict=True):
        left.set_title(fitted(panel.title, FONT, TITLE))
        against_time(left, panel, chosen)
        right.set_xlabel("iteration")
        counts = [[k for k in curve.k if k is not None] for curve in panel.curves]
        across = _iteration_axis(right, [k[-1] for k in counts if k])
        _draw(right, panel, across, [curve.k for curve in panel.curves], chosen)
    figure.align_labels()
    add_legend(figure, chosen)
    return figure


def against_time(axes: Axes, panel: Panel, chosen: Looks) -> None:
    """Error against run time, both logarithmic."""
    axes.set(xlabel="run time (s)", ylabel=MEASURES[panel.measure])
    across = times(second for curve in panel.curves for second in curve.seconds)
    log_axis(axes, "x", across)
    _draw(axes, panel, across, [curve.seconds for curve in panel.curves], chosen)


def _draw(axes: Axes, panel: Panel, across: Range, abscissas: Sequence[Sequence[float | None]], chosen: Looks) -> None:
    """All curves of a panel in axes whose abscissa is set."""
    up = errors(panel.curves)
    log_axis(axes, "y", up)
    for turn, (curve, xs) in enumerate(zip(panel.curves, abscissas, strict=True)):
        points = inside(xs, curve.errors, across, up)
        if points:
            _draw_run(axes, points, chosen[curve.name, curve.label], curve.solved, turn)


def log_axis(axes: Axes, which: str, span: Range) -> None:
    """Make the x or y axis logarithmic over a range, with ticks at powers of ten."""
    axes.set(**{f"{which}scale": "log", f"{which}lim": (span.low, span.high)})
    axis, shade = (axes.xaxis, axes.axvspan) if which == "x" else (axes.yaxis, axes.axhspan)
    majors, minors = decades(span, MOST_TICKS)
    axis.set_major_locator(FixedLocator(majors))
    axis.set_minor_locator(FixedLocator(minors))
    axis.set_minor_formatter(NullFormatter())
    for strip in ((span.low, span.scale_low), (span.scale_high, span.high)):
        if strip[0] < strip[1]:
            shade(*strip, color=STRIP, linewidth=0, zorder=0)


def _iteration_axis(axes: Axes, longest: Sequence[int]) -> Range:
    """Count iterations on the x axis, evenly or, where the longest run hides the shortest, by powers of ten.

    longest : the last k of each run.
    """
    most = max([*longest, 1])
    if most >= 100 and most > UNEVEN * max(min(longest), 1):
        axes.set_xscale("symlog", linthresh=1, linscale=0.4, subs=range(2, 10))
        axes.xaxis.set_major_formatter("{x:.0f}")
        low, high = -0.15, 1.6 * most
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=MOST_TICKS, integer=True))
        low, high = -0.03 * most, 1.08 * most
    axes.set_xlim(low, high)
    return Range(low, high, low, high)


def _draw_run(axes: Axes, points: Sequence[Point], look: Look, solved: bool, turn: int) -> None:
    """A run in axes whose scales and limits are set. turn : its number in the axes, which staggers the markers."""
    xs, ys = np.array([(p.x, p.y) for p in points]).T
    if len(points) > 1:
        axes.plot(xs, ys, zorder=2, **look.line)
    marked = {*_marked(axes.transData.transform(np.column_stack((xs, ys))), turn), *_first_outside(points)}
    if not solved and len(points) > 1:
        marked -= {len(points) - 1}
    ringed = [i for i in sorted(marked) if points[i].beyond]
    above: dict[str, Any] = {"color": look.color, "clip_on": False}
    axes.plot(xs[sorted(marked)], ys[sorted(marked)], linestyle="", clip_on=False, zorder=3, **look.points)
    if ringed:
        axes.plot(xs[ringed], ys[ringed], label=BEYOND, zorder=4, **above, **SIGNS[BEYOND])
    if not solved:
        axes.plot(xs[-1], ys[-1], label=UNSOLVED, zorder=5, **above, **SIGNS[UNSOLVED])


def _marked(at: Any, turn: int) -> list[int]:
    """The first point, the last, and some between that are evenly spread along the curve as it is seen."""
    if len(at) <= MOST_MARKERS:
        return list(range(len(at)))
    falling = np.column_stack((at[:, 0], np.minimum.accumulate(at[:, 1])))  # else oscillations would take all markers
    length = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(falling, axis=0).T))))
    shift = 0.25 * (turn % 4 - 1.5)
    wanted = (np.arange(1, MOST_MARKERS - 1) + shift) / (MOST_MARKERS - 1) * length[-1]
    return [0, *np.searchsorted(length, wanted).tolist(), len(at) - 1]


def _first_outside(points: Sequence[Point]) -> list[int]:
    """Where a curve leaves the axes, or some of these places if there are many."""
    first = [i for i, p in enumerate(points) if p.beyond and (i == 0 or points[i - 1].beyond != p.beyond)]
    return first[:: math.ceil(len(first) / MOST_MARKERS) or 1]


def add_legend(figure: Figure, chosen: Looks) -> None:
    """Add the legend in as many columns as there is room for; the figure grows by its height, the axes keep theirs."""
    room = figure.get_figwidth() - SAMPLE
    signs = {label for axes in figure.axes for label in axes.get_legend_handles_labels()[1]}
    entries = [(Line2D([], [], **(look.points | look.line)), label) for (_, label), look in chosen.items()]
    entries += [(Line2D([], [], color=GREY, **sign), text) for text, sign in SIGNS.items() if text in signs]
    handles, texts = [handle for handle, _ in entries], [fitted(text, SMALL, room) for _, text in entries]
    for columns in sorted({math.ceil(len(entries) / rows) for rows in range(1, len(entries) + 1)}, reverse=True):
        legend = figure.legend(handles, ["-"] * len(entries), loc="outside lower center", ncols=columns)
        for drawn, text in zip(legend.get_texts(), texts, strict=True):
            drawn.set_text(text)  # a label given above that begins with _ is left out by matplotlib 3.7
        size = legend.get_window_extent()
        if size.width <= figure.bbox.width or columns == 1:
            figure.set_figheight(figure.get_figheight() + size.height / figure.dpi)
            break
        legend.remove()
