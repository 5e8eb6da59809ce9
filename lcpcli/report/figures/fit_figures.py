"""Measurements with the curve that fits them and its parts above, and the residuals
below."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from lcpcli.report.figures.style import (
    FONT,
    GREY,
    ROW,
    SPARE,
    WIDTH,
    Entry,
    add_legend,
    fitted_text,
)
from lcpcli.report.plotting import Fitted

MAX_PARTS = len(SPARE)  # that have different colours
MAX_POINTS_AS_DOTS = 400  # measurements; more of them would cover the curve
DATA, CURVE = "#000000", "#d55e00"


def draw(data: Fitted) -> Figure:
    """Return the figure, over the numbers of the measurements, from 1."""
    figure = Figure(figsize=(WIDTH, 1.5 * ROW))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    numbers = np.arange(1, data.measured.size + 1)
    dots: dict[str, Any] = {
        "color": DATA,
        "marker": ".",
        "linestyle": "",
        "markersize": 4.0,
    }
    if numbers.size > MAX_POINTS_AS_DOTS:
        dots = {"color": DATA, "linewidth": 0.5}
    curve: dict[str, Any] = {"color": CURVE, "linewidth": 1.3}
    entries: list[Entry] = [
        (Line2D([], [], **dots), "b"),
        (Line2D([], [], **curve), "A x"),
    ]
    above.plot(numbers, data.measured, **dots)
    shown = list(data.parts.items())[:MAX_PARTS]
    for (name, part), line_style in zip(shown, SPARE, strict=False):
        line: dict[str, Any] = {"color": line_style.color, "linewidth": 0.8}
        above.plot(numbers, part, **line)
        entries.append((Line2D([], [], **line), name))
    above.plot(numbers, data.curve, **curve)
    above.set_title(fitted_text(data.title, FONT, WIDTH - 1))
    above.set_ylabel("b, A x")
    below.plot(numbers, data.measured - data.curve, **dots)
    below.axhline(0, color=GREY, linewidth=0.6)
    below.set_ylabel("b - A x")
    below.set_xlabel("measurement")
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    return add_legend(figure, {}, entries)
