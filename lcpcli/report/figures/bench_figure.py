"""A benchmark in one figure: performance profile, error against run time, and growth of time over n."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from lcpcli.report.figures import curves, labels, ranges
from lcpcli.report.figures.convergence_figure import against_time
from lcpcli.report.figures.data import Curve, Growth, GrowthPanel, Panel, Profile
from lcpcli.report.figures.labels import Drawn, End
from lcpcli.report.figures.ranges import Range
from lcpcli.report.figures.style import FONT, POINTS, SMALL, Looks, add_axes, fitted, looks, name_axes, page

COLUMN = 3.5  # inches, as all lengths here: one column of a journal; two make the figure
ROW = 2.45
AXES = 1.72
TOP = 0.27
LEFT = 0.79
RIGHT = 0.16
EXPONENTS = 0.5  # on the right of axes with fitted lines, for their exponents
LINE = 10.8  # points from one exponent to the next
DOUBLINGS = 12  # up to how many doublings the abscissa of a profile is marked in powers of 2, else of 10


def draw(profiles: Sequence[Profile], panels: Sequence[Panel], growth_panels: Sequence[GrowthPanel]) -> Figure:
    """The figure: axes in two columns; an odd number of them begins with one as wide as the figure."""
    growths = [growth for panel in growth_panels for growth in panel.growths]
    runs = [curve for panel in panels for curve in panel.curves]
    entries: list[Profile | Curve | Growth] = [*profiles, *runs, *growths]
    chosen = looks((one.name, one.label) for one in entries)
    count = bool(profiles) + len(panels) + len(growth_panels)
    cells = _cells(count)
    figure = page(COLUMN * (2 if count > 1 else 1), ROW * math.ceil(count / 2))
    boxes = iter(cells)
    drawn = []
    if profiles:
        drawn.append(_profile(_axes(figure, next(boxes), _title(profiles)), profiles, chosen))
    for panel in panels:
        drawn.append(against_time(_axes(figure, next(boxes), panel.title), panel, chosen))
    for growth_panel in growth_panels:
        axes = _axes(figure, next(boxes), growth_panel.title, EXPONENTS)
        drawn.append(_growth(axes, growth_panel.growths, chosen))
    labels.identify(figure, [[one] for one in drawn], chosen, curves.remarks(drawn))
    return figure


def _cells(count: int) -> list[tuple[float, float, float]]:
    """Left edge, lower edge and width of each cell in inches, in reading order."""
    rows = math.ceil(count / 2)
    wide = count % 2
    cells = [(0.0, (rows - 1) * ROW, COLUMN * (2 if count > 1 else 1))] if wide else []
    for i in range(count - wide):
        row, column = divmod(i, 2)
        cells.append((column * COLUMN, (rows - 1 - row - wide) * ROW, COLUMN))
    return cells


def _axes(figure: Figure, cell: tuple[float, float, float], title: str, right: float = RIGHT) -> Axes:
    left, bottom, width = cell
    axes = add_axes(figure, (left + LEFT, bottom + ROW - TOP - AXES, width - LEFT - right, AXES))
    axes.set_title(fitted(figure, title, FONT, (width - LEFT - RIGHT) * POINTS), loc="left", parse_math=False)
    return axes


def _title(profiles: Sequence[Profile]) -> str:
    return f"Performance profile, {max(len(profile.ratios) for profile in profiles)} problems"


def _profile(axes: Axes, profiles: Sequence[Profile], chosen: Looks) -> Drawn:
    """The share of problems that each solver solves within a multiple of the fastest solver's time."""
    name_axes(axes, "time / time of the fastest solver", "share of problems solved")
    most = _ratio_axis(axes, profiles)
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_locator(FixedLocator([0, 0.2, 0.4, 0.6, 0.8, 1]))
    drawn = Drawn(axes)
    for profile in profiles:
        look = chosen[profile.name, profile.label]
        xs = sorted({1.0, *(ratio for ratio in profile.ratios if ratio < math.inf), most})
        ys = [sum(ratio <= x for ratio in profile.ratios) / max(len(profile.ratios), 1) for x in xs]
        axes.plot(xs, ys, drawstyle="steps-post", zorder=2, **look.line)
        every = math.ceil((len(xs) - 1) / (curves.MOST_MARKERS - 1))
        marks = sorted({*range(0, len(xs), every), len(xs) - 1})
        axes.plot(xs, ys, markevery=marks, linestyle="", clip_on=False, zorder=3, **look.points)
        drawn.ends.append(End(most, ys[-1], profile.label, look))
    return drawn


def _ratio_axis(axes: Axes, profiles: Sequence[Profile]) -> float:
    """A logarithmic abscissa from 1 to a little more than the largest ratio, which is returned."""
    largest = max((r for profile in profiles for r in profile.ratios if r < math.inf), default=1.0)
    most: float = max(largest, 2.0) ** 1.05
    doublings = math.log2(most)
    if doublings > DOUBLINGS:
        curves.log_axis(axes, "x", Range(1.0, most, 1.0, most))
        return most
    axes.set_xscale("log", base=2)
    axes.set_xlim(1.0, most)
    step = math.ceil(doublings / 7)
    axes.xaxis.set_major_locator(FixedLocator([2.0**e for e in range(0, math.floor(doublings) + 1, step)]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda ratio, _: f"{ratio:.0f}"))
    return most


def _growth(axes: Axes, growths: Sequence[Growth], chosen: Looks) -> Drawn:
    """Run times as markers, fitted powers of n as lines, and the exponents on the right."""
    name_axes(axes, "$n$", "run time (s)")
    fits = [[(n, one.coefficient * n**one.exponent) for n in (min(one.n), max(one.n))] for one in growths]
    across = ranges.times(n for one in growths for n in one.n)
    up = ranges.times(t for one, fit in zip(growths, fits, strict=True) for t in (*one.seconds, fit[0][1], fit[1][1]))
    curves.log_axis(axes, "x", across)
    curves.log_axis(axes, "y", up)
    drawn = Drawn(axes)
    for one, fit in zip(growths, fits, strict=True):
        look = chosen[one.name, one.label]
        axes.plot(*zip(*fit, strict=True), zorder=2, **look.line)
        points = ranges.inside(one.n, one.seconds, across, up)
        axes.plot([p.x for p in points], [p.y for p in points], linestyle="", clip_on=False, zorder=3, **look.points)
        drawn.ends.append(End(points[-1].x, points[-1].y, one.label, look))
    heights = [axes.transData.transform(fit[1])[1] - axes.bbox.y0 for fit in fits]
    _exponents(axes, growths, heights, chosen)
    return drawn


def _exponents(axes: Axes, growths: Sequence[Growth], heights: Sequence[float], chosen: Looks) -> None:
    """The fitted exponents on the right of the axes, each with its marker, near the ends of the lines in points."""
    width, height = axes.bbox.width, axes.bbox.height
    for growth, y in zip(growths, _spread(heights, height), strict=True):
        look = chosen[growth.name, growth.label]
        beside: dict[str, Any] = {"transform": axes.transAxes, "clip_on": False}
        axes.text(
            1 + 13 / width,
            y / height,
            f"$n^{{{growth.exponent:.2f}}}$",
            va="center",
            color=look.text,
            fontsize=SMALL,
            **beside,
        )
        axes.add_line(Line2D([1 + 8 / width], [y / height], linestyle="", **beside, **look.points))


def _spread(heights: Sequence[float], most: float) -> list[float]:
    """Heights in the same order, as near to the given ones as texts of one line allow."""
    order = sorted(range(len(heights)), key=lambda i: heights[i])
    spread = [min(max(height, 0.0), most) for height in heights]
    for lower, upper in pairwise(order):
        spread[upper] = max(spread[upper], spread[lower] + LINE)
    room = most
    for i in reversed(order):
        spread[i] = min(spread[i], room)
        room = spread[i] - LINE
    return spread
