"""The solutions along a path: z(t), or x of a program, as lines that break at the breakpoints, and the objective.

If there are few lines, the legend names them; if there are many, all are thin. A jump, where t is constant, is dashed;
a ring marks a turn. If the side of a row of a quadratic program varies, the second panel shows the frontier: the side
against the objective.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from lcpcli.report.figures.data import Response
from lcpcli.report.figures.style import FONT, GREY, METHODS, PEERS, RAMP, ROW, WIDTH, Entry, Look, add_legend, fitted

COLORS = [look.color for name, look in (*METHODS.items(), *PEERS.items()) if name != "auto"][:12]
MOST_NAMED = len(COLORS)  # lines in the legend
MOST_RULES = 60  # breakpoints with a vertical rule and markers; more would be a grey area
TICKS = 6  # intervals on an axis at most
RULE: dict[str, Any] = {"color": "0.85", "linewidth": 0.5, "zorder": 0}
JUMP: dict[str, Any] = {"linestyle": (0, (3, 2))}
TURN: dict[str, Any] = {"marker": "o", "markersize": 7, "markerfacecolor": "none", "markeredgewidth": 0.8}
THIN: dict[str, Any] = {"linewidth": 0.5, "alpha": 0.8}


def draw(picture: Response) -> Figure:
    """Draw the figure: one panel, or two for a program."""
    has_objective = picture.objective is not None
    figure = Figure(figsize=(WIDTH, ROW + 0.15))
    panels = figure.subplots(1, 1 + has_objective, squeeze=False)[0]
    entries = _solutions(panels[0], picture)
    panels[0].set_title(fitted(picture.title, FONT, WIDTH - 1.0))
    if has_objective:
        _objective(panels[1], picture)
    return add_legend(figure, {}, entries) if entries else figure


def _solutions(axes: Axes, picture: Response) -> list[Entry]:
    """Draw the components; return the entries of the legend."""
    across, is_named = np.array(picture.across), len(picture.lines) <= MOST_NAMED
    is_marked = is_named and len(across) <= MOST_RULES
    entries, turns = list[Entry](), list(picture.turns)
    for i, (name, values) in enumerate(zip(picture.names, picture.lines, strict=True)):
        look = Look(COLORS[i % len(COLORS)], RAMP[i % len(RAMP)])
        style = look.line if is_named else look.line | THIN
        _line(axes, across, np.array(values), picture.jumps, style)
        points = {**look.points, "markersize": 3, "linestyle": ""} if is_marked else {}
        if is_marked:
            axes.plot(across, values, zorder=3, **points)
        if is_named:
            entries.append((Line2D([], [], **{**points, **look.line, "linestyle": "-"}), name))
        if turns:
            axes.plot(across[turns], np.array(values)[turns], linestyle="", color=GREY, **TURN)
    if len(across) <= MOST_RULES:
        for place in np.unique(across):
            axes.axvline(place, **RULE)
    symbol = "x" if picture.objective is not None else "z"
    axes.set(xlabel=_label(picture), ylabel=symbol if is_named else f"{symbol}, {len(picture.lines)} components")
    _ticks(axes)
    jump, turn = Line2D([], [], color=GREY, **JUMP), Line2D([], [], linestyle="", color=GREY, **TURN)
    signs = ((jump, "jump", picture.jumps), (turn, "turn", picture.turns))
    return entries + [(sign, text) for sign, text, places in signs if len(places)]


def _line(axes: Axes, across: Any, values: Any, jumps: Any, style: dict[str, Any]) -> None:
    """Draw a component; the pieces on which t stands still are dashed."""
    whole = np.insert(np.stack((across, values)), np.array(jumps, dtype=int) + 1, math.nan, axis=1)
    axes.plot(*whole, zorder=2, **style)
    for k in jumps:
        axes.plot(across[k : k + 2], values[k : k + 2], zorder=2, **{**style, **JUMP})


def _objective(axes: Axes, picture: Response) -> None:
    places, values = np.array(picture.objective).reshape(-1, 2).T
    pairs = [(places, values), (np.array(picture.across), values[:: _stride(picture)])]
    names = {"xlabel": _label(picture), "ylabel": "objective"}
    if picture.is_frontier:
        pairs = [(y, x) for x, y in pairs]
        names = {"xlabel": names["ylabel"], "ylabel": names["xlabel"]}
    axes.plot(*pairs[0], zorder=2, color="black", linewidth=1.3)
    if len(picture.across) <= MOST_RULES:
        axes.plot(*pairs[1], zorder=3, color="black", linestyle="", marker="o", markersize=3)
    axes.set(**names)
    _ticks(axes)


def _stride(picture: Response) -> int:
    """Return the number of points of the objective on a piece."""
    assert picture.objective is not None
    return max((len(picture.objective) - 1) // max(len(picture.across) - 1, 1), 1)


def _label(picture: Response) -> str:
    return f"${picture.abscissa}$" if picture.abscissa == "t" else fitted(picture.abscissa, FONT, WIDTH / 3)


def _ticks(axes: Axes) -> None:
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(TICKS, steps=[1, 2, 5, 10]))
