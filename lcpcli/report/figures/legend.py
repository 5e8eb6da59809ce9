"""The legend below all axes of a figure of runs: it names every run once, and each value of a grid of runs once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lcpcli.report.figures.grids import Grid, grids
from lcpcli.report.figures.style import GREY, SMALL_FONT, Looks, fitted

SAMPLE = 0.6  # inches that a sample takes in front of its label
BEYOND, UNSOLVED, ROUNDING = "0 or beyond the axis", "not solved", "eps times the condition"
SIGNS: dict[str, dict[str, Any]] = {  # by their labels, which no other artist in axes has
    BEYOND: {"linestyle": "", "marker": "o", "markersize": 8, "markerfacecolor": "none", "markeredgewidth": 0.7},
    UNSOLVED: {"linestyle": "", "marker": "x", "markersize": 8, "markeredgewidth": 1.3},
    ROUNDING: {"linestyle": "--", "linewidth": 0.8},
}
Entry: TypeAlias = tuple[Line2D, str]
EMPTY: Entry = (Line2D([], [], linestyle=""), "")


def add_legend(figure: Figure, chosen: Looks, others: Sequence[Entry] = ()) -> Figure:
    """Add a legend in as many columns as there is room for, by whose height the figure grows.

    chosen : the looks of the runs that are drawn. others : further samples with their names.
    """
    figure.align_labels()
    signs = {label for axes in figure.axes for label in axes.get_legend_handles_labels()[1]}
    found = grids(chosen)
    blocks = [block for name, grid in found.items() for block in _blocks(name, grid, chosen)]
    entries = [(Line2D([], [], **(look.points | look.line)), run) for (name, run), look in chosen.items()]
    entries = [entry for (name, _), entry in zip(chosen, entries, strict=True) if name not in found]
    entries += [*others, *((Line2D([], [], color=GREY, **sign), text) for text, sign in SIGNS.items() if text in signs)]
    arrangements = _arrangements(blocks, entries)
    for arranged, columns in arrangements:
        legend = figure.legend(
            [handle for handle, _ in arranged], ["-"] * len(arranged), loc="outside lower center", ncols=columns
        )
        for drawn, (_, text) in zip(legend.get_texts(), arranged, strict=True):
            # matplotlib 3.7 leaves out a label given above that begins with _
            drawn.set_text(fitted(text, SMALL_FONT, figure.get_figwidth() - SAMPLE))
        size = legend.get_window_extent()
        if size.width <= figure.bbox.width or (arranged, columns) == arrangements[-1]:
            figure.set_figheight(figure.get_figheight() + size.height / figure.dpi)
            break
        legend.remove()
    return figure


def _blocks(name: str, grid: Grid, chosen: Looks) -> list[list[Entry]]:
    """Return two columns of the legend: the colours of the values of one option, the markers of those of the other."""
    looks = {place: chosen[name, label] for label, place in grid.places.items()}
    colors = {row: look for (row, _), look in looks.items()}
    markers = {column: look for (_, column), look in looks.items()}
    samples = [
        [Line2D([], [], **colors[row].line) for row in range(len(colors))],
        [Line2D([], [], linestyle="", **markers[column].points | {"color": GREY}) for column in range(len(markers))],
    ]
    titles = [(EMPTY[0], f"{name}: {option}") for option in grid.options]
    named = [list(zip(own, values, strict=True)) for own, values in zip(samples, grid.values, strict=True)]
    return [[title, *own] for title, own in zip(titles, named, strict=True)]


def _arrangements(blocks: Sequence[Sequence[Entry]], entries: Sequence[Entry]) -> list[tuple[list[Entry], int]]:
    """Return ways to arrange the legend, from many short columns to few long ones: the entries, column by column, and
    the number of columns. Each block is a column of its own."""
    if not blocks:
        numbers = {math.ceil(len(entries) / rows) for rows in range(1, len(entries) + 1)}
        return [(list(entries), number) for number in sorted(numbers, reverse=True)]
    least, ways = max(map(len, blocks)), []
    for rows in range(least, max(least, len(entries)) + 1):
        columns = [*blocks, *(entries[i : i + rows] for i in range(0, len(entries), rows))]
        padded = [[*column, *[EMPTY] * (rows - len(column))] for column in columns]
        ways.append(([entry for column in padded for entry in column], len(columns)))
    return ways
