"""One legend below all axes: every method once, and what rings and crosses mean where there are any."""

from __future__ import annotations

import math

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lcpcli.report.figures.curves import SIGNS
from lcpcli.report.figures.style import SMALL, Looks, fitted

GREY = "0.35"
SAMPLE = 0.6  # inches that a sample takes in front of its label


def add(figure: Figure, chosen: Looks) -> None:
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
