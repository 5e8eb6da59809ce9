"""Heat maps of a grid of runs: the iterations and the time of each, as numbers in cells, darker if larger."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import TypeAlias

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from lcpcli.report.figures.data import Panel
from lcpcli.report.figures.grids import Grid
from lcpcli.report.figures.style import FONT, GREY, METHODS, SMALL_FONT, WIDTH, extent, fitted, shades
from lcpcli.report.wording import common_unit, digits

ROW_HEIGHT, SURROUNDINGS = 0.22, 0.75  # inches: the height of a row, and of the title and the labels
SPACE = 1.0  # inches beside a map for its labels, and between the two
LIGHTNESS = 95.0, 40.0  # (CIE L*) of the smallest and the largest number
SHADES = 64  # of a colour: neighbours differ by less than the eye sees
DARK = SHADES * (LIGHTNESS[0] - 60) / (LIGHTNESS[0] - LIGHTNESS[1])  # the level above which numbers are white
SMALLEST_FONT = 4.5  # points: smaller numbers, of a grid with many columns, are left out
HATCH = "/////"
Place: TypeAlias = tuple[int, int]  # row and column
UNSOLVED = ", hatched where not solved"


def height(grid: Grid) -> float:
    """Return the height of the heat maps of a grid, in inches."""
    return SURROUNDINGS + ROW_HEIGHT * len(grid.values[0])


def draw(axes: Sequence[Axes], panel: Panel, name: str, grid: Grid) -> None:
    """Draw the iterations and the time of a method's runs on a problem, in two axes that share their ordinates."""
    runs = {grid.places[curve.label]: curve for curve in panel.curves if curve.name == name and curve.counts}
    iterations = {place: float(max(curve.counts)) for place, curve in runs.items()}
    times = {place: curve.total or curve.seconds[-1] for place, curve in runs.items()}
    length, unit = common_unit(times.values())
    texts = [{place: f"{k:.0f}" for place, k in iterations.items()}]
    texts.append({place: digits(seconds / length) for place, seconds in times.items()})
    solved = {place for place, curve in runs.items() if curve.solved}
    note = UNSOLVED * (len(solved) < len(runs))
    for own, values, shown, title in zip(
        axes, (iterations, times), texts, ("iterations", f"time ({unit})"), strict=True
    ):
        _map(own, grid, values, shown, solved, METHODS[name].color if name in METHODS else GREY)
        own.set_title(fitted(f"{name}: {title}{note}", FONT, WIDTH / 2 - 0.4))
        own.set_xlabel(grid.options[1])
    axes[0].set_ylabel(grid.options[0])


def _map(
    axes: Axes,
    grid: Grid,
    values: Mapping[Place, float],
    texts: Mapping[Place, str],
    solved: Collection[Place],
    color: str,
) -> None:
    """Draw the cells of a map, of one colour from light to dark by the logarithms of the values."""
    rows, columns = map(len, grid.values)
    levels = {place: math.log(values[place] or 1.0) for place in solved}
    least = min(levels.values(), default=0.0)
    span = max(levels.values(), default=0.0) - least or 1.0
    colors = shades(color, SHADES, *LIGHTNESS)
    size = _font(list(texts.values()), columns)
    for (row, column), text in texts.items():
        at = row, column
        level = round((levels[at] - least) / span * (SHADES - 1)) if at in solved else 0
        cell = Rectangle((column - 0.5, row - 0.5), 1, 1, linewidth=0.8, facecolor="white", edgecolor="0.8")
        if at in solved:
            cell.set(facecolor=colors[level], edgecolor="white")
        else:
            cell.set(hatch=HATCH)
        axes.add_patch(cell)
        if size >= SMALLEST_FONT:
            back = None if at in solved else {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
            ink = "white" if level > DARK else "black"
            axes.text(column, row, text, fontsize=size, color=ink, ha="center", va="center", bbox=back)
    axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    axes.set_xticks(range(columns), [fitted(own, SMALL_FONT, (WIDTH / 2 - SPACE) / columns) for own in grid.values[1]])
    axes.set_yticks(range(rows), [fitted(own, SMALL_FONT, SPACE / 2) for own in grid.values[0]])
    axes.tick_params(length=0)


def _font(texts: Sequence[str], columns: int) -> float:
    """Return the size, in points, in which the texts fit into their cells, SMALL_FONT at most."""
    room = 72 * 0.9 * (WIDTH / 2 - SPACE) / columns
    return min(SMALL_FONT, SMALL_FONT * room / max((extent(text, SMALL_FONT)[0] for text in texts), default=1.0))
