"""Error against run time, with logarithmic axes, and solutions along a path, as text for a terminal: a letter for each
curve, drawn by plotext."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from string import ascii_letters, digits
from textwrap import wrap
from typing import Any

from lcpcli.errors import visible
from lcpcli.report.figures.data import Panel, Point, Range, Response, errors, inside, times

COLORS = ("red", "green", "magenta", "blue+", "orange", "cyan")  # legible on light and dark backgrounds
FAILED = "x"
MARK, MOST_NAMED = "*", 12  # of each of more components than have letters
LETTERS = [c for c in ascii_letters + digits if c.lower() != FAILED]
SMALLEST_FIGURE = (30, 8)  # columns and lines; curves could not be told apart in fewer
UNBROKEN = "\N{NO-BREAK SPACE}"
TICK = 10  # columns that a tick of the abscissa takes with its label
TICK_LINES = 3  # lines that a tick of the ordinate takes, so that there is a gap between labels
MEASURES = {"error": "error ||z - z*||_inf", "residual": "residual ||min(z, Mz + q)||_inf"}


def render(panels: Sequence[Panel], width: int, height: int, color: bool) -> str:
    """Return the panels as text, each `width` columns wide and `height` lines high, with its title and legend."""
    width, height = max(width, SMALLEST_FIGURE[0]), max(height, SMALLEST_FIGURE[1])
    names = list(dict.fromkeys(curve.name for panel in panels for curve in panel.curves))
    colors = {name: COLORS[i % len(COLORS)] for i, name in enumerate(names)}
    return "\n".join(_panel(panel, width, height, colors if color else {}) for panel in panels)


def letters(labels: Sequence[str]) -> list[str]:
    """Return a character for each label, a different one while there are enough, from the label if possible."""
    chosen: list[str] = []
    for label in labels:
        free = [letter for letter in LETTERS if letter not in chosen] or LETTERS
        chosen.append(next((letter for letter in label if letter in free), free[0]))
    return chosen


def _panel(panel: Panel, width: int, height: int, colors: dict[str, str]) -> str:
    """Return a panel with its title and legend. colors : the colours by name; empty for none."""
    marks = letters([curve.label for curve in panel.curves])
    across = times(second for curve in panel.curves for second in curve.seconds)
    up = errors(panel.curves)
    runs = [inside(curve.seconds, curve.errors, across, up) for curve in panel.curves]
    drawn = [(mark, curve) for mark, curve in zip(marks, panel.curves, strict=True) if curve.is_measured]
    entries = [f"{mark} {visible(curve.label)}" for mark, curve in drawn]
    if any(not curve.solved for _, curve in drawn):
        entries.append(f"{FAILED} not solved")
    if any(point.is_beyond for points in runs for point in points):
        entries.append("at the edge: 0 or beyond the axis")
    legend = _legend(entries, width)
    measure = wrap(f"{MEASURES[panel.measure]}, against run time (s)", width)
    rows = max(height - len(legend) - len(measure) - 1, SMALLEST_FIGURE[1])
    axes = _draw(panel, runs, marks, (across, up), (width, rows), colors)
    return "\n".join([_cut(visible(panel.title), width), *measure, axes, *legend, ""])


def _legend(entries: Sequence[str], width: int) -> list[str]:
    """Return the lines of a legend, in which no entry is broken."""
    whole = (_cut(entry, width).replace(" ", UNBROKEN) for entry in entries)
    lines = wrap("   ".join(whole), width, break_on_hyphens=False) or [""]
    return [line.replace(UNBROKEN, " ") for line in lines]


def _draw(
    panel: Panel,
    runs: Sequence[Sequence[Point]],
    marks: Sequence[str],
    spans: tuple[Range, Range],
    size: tuple[int, int],
    colors: dict[str, str],
) -> str:
    """Return the axes with their curves. colors : the colours by name; empty for none."""
    import plotext

    with _plot(size) as figure:
        for side, span, most in zip(("x", "y"), spans, (size[0] // TICK, size[1] // TICK_LINES), strict=True):
            low, high = math.log10(span.low), math.log10(span.high)
            step = math.ceil((high - low) / most)
            exponents = [e for e in range(math.ceil(low), math.floor(high) + 1) if e % step == 0]
            figure.ruler(side).lim(low, high)
            figure.ruler(side).ticks(exponents, [f"1e{e}" for e in exponents])
        for curve, points, mark in zip(panel.curves, runs, marks, strict=True):
            xs, ys = [math.log10(p.x) for p in points], [math.log10(p.y) for p in points]
            own, failed = (plotext.marker(letter, pixel=colors.get(curve.name)) for letter in (mark, FAILED))
            figure.draw(figure.signal(xs, ys, marker=own).lines())
            if points and not curve.solved:
                figure.draw(figure.signal(xs[-1:], ys[-1:], marker=failed))
        return _text(figure, not colors)


@contextmanager
def _plot(size: tuple[int, int]) -> Iterator[Any]:
    """Open a context with an empty figure of plotext, which has only one."""
    import plotext

    plotext.terminal.limit(False, False)  # the size is the caller's to choose
    plotext.figure.clear()
    plotext.figure.theme("colorless")
    plotext.figure.plot_size(*size)
    yield plotext.figure
    plotext.figure.clear()
    plotext.terminal.limit()


def _text(figure: Any, is_plain: bool) -> str:
    return str(figure.build().string(is_plain)).rstrip("\n")


def response(picture: Response, width: int, height: int, color: bool) -> str:
    """Return the solutions along a path as text; of many components all have the same mark."""
    import plotext

    width, height = max(width, SMALLEST_FIGURE[0]), max(height, SMALLEST_FIGURE[1])
    is_named = len(picture.names) <= MOST_NAMED
    marks = letters(picture.names) if is_named else [MARK] * len(picture.names)
    entries = [f"{mark} {visible(name)}" for mark, name in zip(marks, picture.names, strict=True)] * is_named
    legend = _legend(entries or [f"{len(picture.names)} components"], width)
    size = width, max(height - len(legend) - 2, SMALLEST_FIGURE[1])
    with _plot(size) as figure:
        for i, (values, mark) in enumerate(zip(picture.lines, marks, strict=True)):
            own = plotext.marker(mark, pixel=COLORS[i % len(COLORS)] if color else None)
            figure.draw(figure.signal(list(picture.across), list(values), marker=own).lines())
        axes = _text(figure, not color)
    subject = f"{'z' if picture.objective is None else 'x'} against {visible(picture.abscissa)}"
    return "\n".join([_cut(f"{visible(picture.title)}: {subject}", width), axes, *legend, ""])


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 3] + "..."
