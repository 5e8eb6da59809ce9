"""Runs and paths of solutions as figures, with one legend below all axes.

The figure of convergence has one row per problem, with the error against run time on
the left and against the iteration on the right. Curves have few markers, a ring around
each point beyond the axes, and a cross where a run failed. That of a benchmark has the
performance profile and error against run time. That of a path has z(t), or x of a
program, and the objective, or the frontier if a row side of a quadratic program varies.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter

from lcpcli.parametric.path import Path
from lcpcli.report import path_formats, wording
from lcpcli.report.figures import style
from lcpcli.report.figures.style import (
    FONT,
    ROW,
    WIDTH,
    Entry,
    LineStyle,
    LineStyles,
    add_legend,
    fitted_text,
    styles_of,
)
from lcpcli.report.plotting import Curve, Panel, Profile

MEASURES = {
    "error": r"error $\|z - z^*\|_\infty$",
    "residual": r"residual $\|\min(z, Mz + q)\|_\infty$",
}
# Markers on a curve: enough to follow it where curves cross, few enough to see the
# line.
MAX_MARKERS = 12
TICKS = 6  # labelled on an axis at most, whose labels would touch if there were more
AXIS_MARGIN = 0.04  # of the length of an axis
# The ratio of the longest to the shortest run from which on the axis of iterations is
# logarithmic.
UNEVEN = 20


# Relative to the start: a smaller error, below rounding, is drawn at the lower limit,
# like 0.
SMALLEST_ERROR = 1e-17
# Relative to the start: a larger error, of a divergent run, is drawn at the upper
# limit, like inf.
LARGEST_ERROR = 1e4
# Relative to the length of the data: margins on both sides, where values off the scale
# are drawn.
MARGIN = 0.06
MIN_MARGIN = 0.12  # decades: the margin of data that hardly vary
# No axis goes beyond these limits, so that matplotlib stays within double precision.
SMALLEST_END, LARGEST_END = 1e-250, 1e250


class Range(NamedTuple):
    """The positions of values off the scale, below and above all others."""

    low: float
    high: float

    def clipped(self, value: float) -> float:
        return max(self.low, value) if value <= self.high else self.high


# The position of an iterate, and whether its value lies off the scale.
DrawnPoint = tuple[float, float, bool]
ALL_ZERO = Range(1e-17, 1e-15)  # at whose lower edge a point without any error is drawn


def errors(curves: Iterable[Curve]) -> Range:
    """Return a range around the errors that are neither practically 0 nor those of a
    divergent run."""
    series = [[v for v in curve.errors if v is not None] for curve in curves]
    proper = [
        [v for v in positive_errors if 0 < v < math.inf] for positive_errors in series
    ]
    values = list(chain(*series))
    if values and not any(values):
        return ALL_ZERO
    scale = max(
        [positive_errors[0] for positive_errors in proper if len(positive_errors) > 1]
        or chain(*proper),
        default=1.0,
    )
    floor = max(SMALLEST_ERROR * scale, SMALLEST_END)
    ceiling = min(LARGEST_ERROR * scale, LARGEST_END)
    return times(values, floor, ceiling)


def times(
    values: Iterable[float], floor: float = SMALLEST_END, ceiling: float = LARGEST_END
) -> Range:
    """Return a range around the values from floor to ceiling, of at least one
    decade."""
    shown = [math.log10(v) for v in values if floor <= v <= ceiling] or [0.0]
    margin = max(MARGIN * (max(shown) - min(shown)), MIN_MARGIN)
    low, high = min(shown) - margin, max(shown) + margin
    if math.floor(high) - math.ceil(low) < 1:
        low, high = (
            min(low, math.floor(low + 0.5)),
            max(high, math.floor(low + 0.5) + 1),
        )
    return Range(10.0**low, 10.0**high)


def inside(
    xs: Sequence[float | None], ys: Sequence[float | None], across: Range, up: Range
) -> list[DrawnPoint]:
    """Return the points where both x and y are measured, moved to the edge if they are
    off the axes, and whether so."""
    measured = [
        (x, y) for x, y in zip(xs, ys, strict=True) if x is not None and y is not None
    ]
    clipped = [(across.clipped(x), up.clipped(y)) for x, y in measured]
    return [
        (*point, point != original)
        for point, original in zip(clipped, measured, strict=True)
    ]


def draw_convergence(panels: Sequence[Panel]) -> Figure:
    styles = styles_of(
        (curve.name, curve.label) for panel in panels for curve in panel.curves
    )
    figure = Figure(figsize=(WIDTH, min(ROW * len(panels), style.PAGE_HEIGHT)))
    counts = [
        [
            max((k for k in curve.k if k is not None), default=0)
            for curve in panel.curves
        ]
        for panel in panels
    ]
    is_logarithmic = any(
        counts_of_panel
        and max(counts_of_panel)
        >= max(100, UNEVEN * min(filter(None, counts_of_panel), default=1) + 1)
        for counts_of_panel in counts
    )
    rows = figure.subplots(len(panels), 2, sharey="row", squeeze=False)
    for (left, right), panel, longest in zip(rows, panels, counts, strict=True):
        _against_time(left, panel, styles, WIDTH)
        right.set_xlabel("iteration")
        max_iteration = max([*longest, 1])
        across = (
            Range(-0.15, 1.6 * max_iteration)
            if is_logarithmic
            else Range(-0.03 * max_iteration, 1.08 * max_iteration)
        )
        if is_logarithmic:
            right.set_xscale("symlog", linthresh=1, linscale=0.4, subs=range(2, 10))
            right.xaxis.set_major_formatter("{x:.0f}")
        else:
            right.xaxis.set_major_locator(MaxNLocator(nbins=TICKS, integer=True))
        right.set_xlim(across)
        _draw(right, panel, across, [curve.k for curve in panel.curves], styles)
    return add_legend(figure, _drawn(styles, panels))


def _against_time(axes: Axes, panel: Panel, styles: LineStyles, width: float) -> None:
    """Draw error against run time, both logarithmic. width : the inches for the title
    and its surroundings."""
    axes.set_title(fitted_text(panel.title, FONT, width - 1.0))
    axes.set(xlabel="run time (s)", ylabel=MEASURES[panel.measure])
    across = times(second for curve in panel.curves for second in curve.seconds)
    _log_axis(axes, "x", across)
    _draw(axes, panel, across, [curve.seconds for curve in panel.curves], styles)


def _draw(
    axes: Axes,
    panel: Panel,
    across: Range,
    abscissas: Sequence[Sequence[float | None]],
    styles: LineStyles,
) -> None:
    up = errors(panel.curves)
    _log_axis(axes, "y", up)
    for number, (curve, xs) in enumerate(zip(panel.curves, abscissas, strict=True)):
        if points := inside(xs, curve.errors, across, up):
            _draw_run(
                axes, points, styles[curve.name, curve.label], curve.solved, number
            )


def _log_axis(axes: Axes, which: str, span: Range, margin: float = AXIS_MARGIN) -> None:
    """Make the x or y axis logarithmic over a range, with a fraction of its length as a
    margin for markers at both limits."""
    beyond = (span.high / span.low) ** margin
    axes.set(
        **{
            f"{which}scale": "log",
            f"{which}lim": (span.low / beyond, span.high * beyond),
        }
    )
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_minor_formatter(NullFormatter())


def _draw_run(
    axes: Axes,
    points: Sequence[DrawnPoint],
    line_style: LineStyle,
    solved: bool,
    number: int,
) -> None:
    """Draw a run in axes whose scales and limits are set. number : its number in the
    axes, which staggers the markers."""
    xs, ys = np.array([point[:2] for point in points]).T
    if len(points) > 1:
        axes.plot(xs, ys, zorder=2, **line_style.line)
    outside = [i for i, (_, _, is_beyond) in enumerate(points) if is_beyond]
    marked = {*range(len(points))}
    # The first point, the last, and some between, spread evenly along the drawn curve.
    if len(points) > MAX_MARKERS:
        across, up = axes.transData.transform(np.column_stack((xs, ys))).T
        # Without this minimum, oscillations would take all markers.
        falling = np.diff(np.minimum.accumulate(up))
        length = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(across), falling))))
        shares = (np.arange(1, MAX_MARKERS - 1) + 0.25 * (number % 4 - 1.5)) / (
            MAX_MARKERS - 1
        )
        marked = {
            0,
            *np.searchsorted(length, shares * length[-1]).tolist(),
            len(points) - 1,
        }
    marked |= {*outside[:: math.ceil(len(outside) / MAX_MARKERS) or 1]}
    if not solved and len(points) > 1:
        marked -= {len(points) - 1}
    ringed = sorted(marked.intersection(outside))
    above: dict[str, Any] = {"color": line_style.color, "clip_on": False}
    axes.plot(
        xs[sorted(marked)],
        ys[sorted(marked)],
        linestyle="",
        clip_on=False,
        zorder=3,
        **line_style.points,
    )
    if ringed:
        axes.plot(
            xs[ringed],
            ys[ringed],
            label=style.BEYOND,
            zorder=4,
            **above,
            **style.SIGNS[style.BEYOND],
        )
    if not solved:
        axes.plot(
            xs[-1],
            ys[-1],
            label=style.UNSOLVED,
            zorder=5,
            **above,
            **style.SIGNS[style.UNSOLVED],
        )


def _drawn(
    styles: LineStyles, panels: Sequence[Panel], others: Sequence[Profile] = ()
) -> LineStyles:
    curves = (curve for panel in panels for curve in panel.curves)
    entries: list[Profile | Curve] = [
        *others,
        *(
            curve
            for curve in curves
            if any(error is not None for error in curve.errors)
        ),
    ]
    names = {(entry.name, entry.label) for entry in entries}
    return {key: line_style for key, line_style in styles.items() if key in names}


# Doublings on the abscissa of a profile up to which ticks are at powers of 2, not of
# 10: the labels of more would touch.
DOUBLINGS = 12


def draw_bench(profiles: Sequence[Profile], panels: Sequence[Panel]) -> Figure:
    """Draw the figure: axes in two columns; if their number is odd, the first ones are
    as wide as the figure."""
    curves = [curve for panel in panels for curve in panel.curves]
    entries: list[Profile | Curve] = [*profiles, *curves]
    styles = styles_of((entry.name, entry.label) for entry in entries)
    count = bool(profiles) + len(panels)
    axes_numbers = [0] * (count % 2) + list(range(count))
    rows = len(axes_numbers) // 2
    figure = Figure(
        figsize=(WIDTH if count > 1 else WIDTH / 2, min(ROW * rows, style.PAGE_HEIGHT))
    )
    mosaic: dict[int, Axes] = figure.subplot_mosaic(
        [axes_numbers[i : i + 2] for i in range(0, len(axes_numbers), 2)]
    )
    free = (mosaic[i] for i in range(count))
    if profiles:
        _profile(next(free), profiles, styles)
    for panel in panels:
        _against_time(next(free), panel, styles, WIDTH / 2)
    return add_legend(figure, _drawn(styles, panels, profiles))


def _profile(axes: Axes, profiles: Sequence[Profile], styles: LineStyles) -> None:
    """Draw the share of problems that each solver solves within a multiple of the
    fastest solver's time, or in time."""
    in_seconds = profiles[0].in_seconds
    title = "Solved over time" if in_seconds else "Performance profile"
    axes.set_title(
        f"{title}, {max(len(profile.ratios) for profile in profiles)} problems"
    )
    xlabel = "run time (s)" if in_seconds else "time / time of the fastest solver"
    axes.set(xlabel=xlabel, ylabel="share of problems solved")
    all_ratios = chain.from_iterable(profile.ratios for profile in profiles)
    ratios = [ratio for ratio in all_ratios if ratio < math.inf]
    across = times(ratios) if in_seconds else Range(1.0, max([*ratios, 2.0]) ** 1.05)
    _log_axis(axes, "x", across, 0.0)
    if not in_seconds and math.log2(across.high) <= DOUBLINGS:
        axes.set_xscale("log", base=2, subs=[])
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.xaxis.set_major_locator(LogLocator(2, numticks=8))
        axes.xaxis.set_major_formatter("{x:.0f}")
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_locator(FixedLocator([0, 0.2, 0.4, 0.6, 0.8, 1]))
    for profile in profiles:
        line_style = styles[profile.name, profile.label]
        xs = sorted({*across, *(ratio for ratio in profile.ratios if ratio < math.inf)})
        ys = [
            sum(ratio <= x for ratio in profile.ratios) / max(len(profile.ratios), 1)
            for x in xs
        ]
        axes.plot(xs, ys, drawstyle="steps-post", zorder=2, **line_style.line)
        every = math.ceil((len(xs) - 1) / (MAX_MARKERS - 1))
        marked = sorted({*range(0, len(xs), every), len(xs) - 1})
        axes.plot(
            xs,
            ys,
            markevery=marked,
            linestyle="",
            clip_on=False,
            zorder=3,
            **line_style.points,
        )


COLORS = [look.color for look in [*style.METHODS.values(), *style.SPARE][1:13]]
MAX_NAMED = len(COLORS)  # lines in the legend
# Breakpoints with a vertical rule and markers; more would be a grey area.
MAX_RULES = 60
SAMPLES = 24  # of the objective on a piece, on which it is a parabola
MAX_SAMPLES = 4000  # on a path, more than a figure shows


def draw(path: Path, selection: Sequence[str] = ()) -> Figure:
    """Draw the components of z along a path that are not always 0, or of a program
    those of x, or the chosen unknowns and multipliers instead, as for
    `wording.selected_components`; and the objective of a program."""
    terms = path_formats.Terms(path)
    moving, program = terms.moving, terms.block_form
    across = _across(terms, path.t)
    figure = Figure(figsize=(WIDTH, ROW + 0.15))
    panels = figure.subplots(1, 1 + (program is not None), squeeze=False)[0]
    label = fitted_text(moving.label, FONT, WIDTH / 3) if moving else "$t$"
    entries = _solutions(panels[0], terms, across, selection)
    panels[0].set_title(
        fitted_text(wording.title_and_size(path.problem), FONT, WIDTH - 1.0)
    )
    panels[0].set_xlabel(label)
    if program is not None:
        is_frontier = (
            terms.is_quadratic and moving is not None and moving.what.startswith("row")
        )
        _objective(panels[1], terms, across, label, is_frontier)
    for axis in (axis for axes in panels for axis in (axes.xaxis, axes.yaxis)):
        axis.set_major_locator(MaxNLocator(TICKS, steps=[1, 2, 5, 10]))
    return add_legend(figure, {}, entries)


def _across(terms: path_formats.Terms, t: Any) -> Any:
    return (
        np.array(list(map(terms.varying_at, t.tolist())), dtype=float)
        if terms.moving
        else t
    )


def _solutions(
    axes: Axes, terms: path_formats.Terms, across: Any, selection: Sequence[str]
) -> list[Entry]:
    program = terms.block_form
    names = terms.names()
    z = terms.path.z
    if selection:
        shown = wording.selected_components(names, selection)
        z = np.array(list(map(terms.values, z)))
    else:
        shown = np.flatnonzero(
            z[:, : program.variables if program else None].any(axis=0)
        ).tolist()
    is_named = len(shown) <= MAX_NAMED
    is_marked = is_named and len(across) <= MAX_RULES
    entries = list[Entry]()
    for i, index in enumerate(shown):
        line_style = LineStyle(COLORS[i % len(COLORS)], style.RAMP[i % len(style.RAMP)])
        values = z[:, index]
        line = (
            line_style.line
            if is_named
            else line_style.line | {"linewidth": 0.5, "alpha": 0.8}
        )
        axes.plot(across, values, zorder=2, **line)
        points = (
            {**line_style.points, "markersize": 3, "linestyle": ""} if is_marked else {}
        )
        if is_marked:
            axes.plot(across, values, zorder=3, **points)
        if is_named:
            entries.append(
                (
                    Line2D([], [], **{**points, **line_style.line, "linestyle": "-"}),
                    names[index],
                )
            )
    if len(across) <= MAX_RULES:
        for index in np.unique(across):
            axes.axvline(index, color="0.85", linewidth=0.5, zorder=0)
    symbol = "z" if program is None else "x"
    axes.set_ylabel(symbol if is_named else f"{symbol}, {len(shown)} components")
    return entries


def _objective(
    axes: Axes, terms: path_formats.Terms, across: Any, label: str, is_frontier: bool
) -> None:
    """Draw the objective of a program, a parabola on each piece, against what moves, or
    instead the frontier."""
    path = terms.path
    parts = max(min(SAMPLES, MAX_SAMPLES // max(len(across) - 1, 1)) - 1, 1)
    steps = np.arange(parts * (len(across) - 1) + 1) / parts
    before, corners = steps.astype(int), np.column_stack((path.t, path.z))
    share = (steps - before)[:, np.newaxis]
    after = np.minimum(before + 1, len(across) - 1)
    points = (1 - share) * corners[before] + share * corners[after]
    values = np.array([terms.objective(point[0], point[1:]) for point in points])
    pairs = [(_across(terms, points[:, 0]), values), (across, values[::parts])]
    names = [label, "objective"]
    if is_frontier:
        pairs, names = [(y, x) for x, y in pairs], names[::-1]
    axes.plot(*pairs[0], zorder=2, color="black", linewidth=1.3)
    if len(across) <= MAX_RULES:
        axes.plot(
            *pairs[1], zorder=3, color="black", linestyle="", marker="o", markersize=3
        )
    axes.set(xlabel=names[0], ylabel=names[1])
