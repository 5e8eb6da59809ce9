"""A benchmark in one figure: performance profile, error against run time, and growth of time over n."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, LogLocator

from lcpcli.report.figures.convergence_figure import MOST_MARKERS, add_legend, against_time, log_axis
from lcpcli.report.figures.data import Curve, Growth, GrowthPanel, Panel, Profile, Range, inside, times
from lcpcli.report.figures.style import FONT, PAGE, ROW, WIDTH, Looks, fitted, looks

TITLE = WIDTH / 2 - 1.0  # inches for a title
EXPONENTS = 10  # of them in a column
ROOM = 0.48  # of the length of the data's range of n, for a column of exponents
DOUBLINGS = 12  # up to how many doublings the abscissa of a profile is marked in powers of 2, else of 10


def draw(profiles: Sequence[Profile], panels: Sequence[Panel], growth_panels: Sequence[GrowthPanel]) -> Figure:
    """The figure: axes in two columns; an odd number of them begins with one as wide as the figure."""
    growths = [growth for panel in growth_panels for growth in panel.growths]
    runs = [curve for panel in panels for curve in panel.curves]
    entries: list[Profile | Curve | Growth] = [*profiles, *runs, *growths]
    chosen = looks((one.name, one.label) for one in entries)
    count = bool(profiles) + len(panels) + len(growth_panels)
    places = [0] * (count % 2) + list(range(count))
    rows = len(places) // 2
    figure = Figure(figsize=(WIDTH if count > 1 else WIDTH / 2, min(ROW * rows, PAGE)))
    mosaic: dict[int, Axes] = figure.subplot_mosaic([places[i : i + 2] for i in range(0, len(places), 2)])
    free = (mosaic[i] for i in range(count))
    if profiles:
        _profile(next(free), profiles, chosen)
    for panel in panels:
        axes = next(free)
        axes.set_title(fitted(panel.title, FONT, TITLE))
        against_time(axes, panel, chosen)
    for growth_panel in growth_panels:
        _growth(next(free), growth_panel, chosen)
    figure.align_labels()
    add_legend(figure, chosen)
    return figure


def _profile(axes: Axes, profiles: Sequence[Profile], chosen: Looks) -> None:
    """The share of problems that each solver solves within a multiple of the fastest solver's time."""
    axes.set_title(f"Performance profile, {max(len(profile.ratios) for profile in profiles)} problems")
    axes.set(xlabel="time / time of the fastest solver", ylabel="share of problems solved")
    most = _ratio_axis(axes, profiles)
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_locator(FixedLocator([0, 0.2, 0.4, 0.6, 0.8, 1]))
    for profile in profiles:
        look = chosen[profile.name, profile.label]
        xs = sorted({1.0, *(ratio for ratio in profile.ratios if ratio < math.inf), most})
        ys = [sum(ratio <= x for ratio in profile.ratios) / max(len(profile.ratios), 1) for x in xs]
        axes.plot(xs, ys, drawstyle="steps-post", zorder=2, **look.line)
        every = math.ceil((len(xs) - 1) / (MOST_MARKERS - 1))
        marks = sorted({*range(0, len(xs), every), len(xs) - 1})
        axes.plot(xs, ys, markevery=marks, linestyle="", clip_on=False, zorder=3, **look.points)


def _ratio_axis(axes: Axes, profiles: Sequence[Profile]) -> float:
    """A logarithmic abscissa from 1 to a little more than the largest ratio, which is returned."""
    largest = max((r for profile in profiles for r in profile.ratios if r < math.inf), default=1.0)
    most: float = max(largest, 2.0) ** 1.05
    if math.log2(most) > DOUBLINGS:
        log_axis(axes, "x", Range(1.0, most, 1.0, most))
        return most
    axes.set_xscale("log", base=2, subs=[])
    axes.set_xlim(1.0, most)
    axes.xaxis.set_major_locator(LogLocator(2, numticks=8))
    axes.xaxis.set_major_formatter("{x:.0f}")
    return most


def _growth(axes: Axes, panel: GrowthPanel, chosen: Looks) -> None:
    """Median run times with their quartiles, and on the right the exponents of n that were fitted, in their order.

    Lines are the fitted powers of n; times to which none is fitted are joined.
    """
    axes.set_title(fitted(panel.title, FONT, TITLE))
    axes.set(xlabel="$n$", ylabel="run time (s)")
    lines = [(one, chosen[one.name, one.label], _line(one)) for one in panel.growths]
    columns = math.ceil(sum(one.fit is not None for one in panel.growths) / EXPONENTS)
    across = times(n for one in panel.growths for n in one.n)
    right = across.high * (across.high / across.low) ** (ROOM * columns)
    across = replace(across, high=right, scale_high=right)
    up = times(t for one, _, line in lines for t in (*one.lower, *one.upper, *(y for _, y in line)))
    log_axis(axes, "x", across)
    log_axis(axes, "y", up)
    entries = []
    for one, look, line in lines:
        axes.plot(*zip(*line, strict=True), zorder=2, **look.line)
        axes.vlines(one.n, one.lower, one.upper, color=look.color, linewidth=look.width, zorder=2)
        points = inside(one.n, one.seconds, across, up)
        axes.plot([p.x for p in points], [p.y for p in points], linestyle="", clip_on=False, zorder=3, **look.points)
        if one.fit is not None:
            sample = Line2D([], [], linestyle="", **look.points)
            entries.append((line[-1][1], sample, rf"$n^{{{one.fit.exponent:.2f} \pm {one.fit.margin:.2f}}}$"))
    if entries:
        _, samples, exponents = zip(*sorted(entries, key=lambda entry: -entry[0]), strict=True)
        spaces: dict[str, Any] = {"handlelength": 1, "columnspacing": 1, "handletextpad": 0.4}
        axes.legend(samples, exponents, loc="center right", ncols=columns, **spaces)


def _line(one: Growth) -> list[tuple[float, float]]:
    """The ends of the fitted power of n, or the medians where none is fitted."""
    if one.fit is None:
        return list(zip(one.n, one.seconds, strict=True))
    return [(n, one.fit.coefficient * n**one.fit.exponent) for n in (min(one.n), max(one.n))]
