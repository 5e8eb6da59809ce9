"""The common style of all figures: one colour and marker per method, solid lines,
fonts, the legend below all axes, and the output as bytes.

The colours are Okabe and Ito's (Color Universal Design, 2008) and Tol's (Colour
schemes, SRON 2021), some darkened, so that the methods' lightness rises in steps of
about ten, which distinguishes them in grey. Peers have hollow markers.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import cycle
from typing import Any, TypeAlias

import matplotlib.style
import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.lines import Line2D
from matplotlib.textpath import text_to_path

from lcpcli.errors import visible

FONT = 8  # points, as in the captions of a journal
SMALL_FONT = 7  # points, of ticks, legends and notes: a point less than the titles
PNG_DPI = 300  # the resolution that journals require
FAMILY = "DejaVu Sans"  # comes with matplotlib: the same picture on every machine
GREY = "0.35"  # of notes, and of signs that represent any method
WIDTH = 7.0  # inches, as all lengths of figures here: two columns of a journal
PAGE_HEIGHT = 10.6  # the height of a page of A4, 11.69, less what a legend takes
ROW = 2.45  # the height of a row of axes, if all of them fit
# For each form: the metadata field of the provenance, and the field that would differ
# each time.
METADATA = {
    "png": ("Description", "Software"),
    "svg": ("Description", "Date"),
    "pdf": ("Subject", "CreationDate"),
}

TICKS = {
    "labelsize": SMALL_FONT,
    "direction": "in",
    "major.width": 0.6,
    "minor.width": 0.4,
}
SETTINGS: dict[str, Any] = {
    "font.family": FAMILY,
    "font.size": FONT,
    "text.hinting": "none",  # else widths depend on the resolution
    "figure.constrained_layout.use": True,
    "figure.constrained_layout.h_pad": 0.07,
    "figure.constrained_layout.w_pad": 0.06,
    "axes.titlesize": FONT,
    "axes.titlelocation": "left",
    "axes.labelsize": FONT,
    "legend.fontsize": SMALL_FONT,
    "legend.frameon": False,
    "legend.handlelength": 3.4,
    "legend.columnspacing": 1.6,
    "axes.linewidth": 0.6,
    "xtick.major.pad": 5,  # else the labels of two axes may touch in a corner
    "xtick.top": True,
    "ytick.right": True,
    **{f"{axis}tick.{key}": value for axis in "xy" for key, value in TICKS.items()},
    "path.simplify_threshold": 0.3,
    "svg.fonttype": "path",
    "svg.hashsalt": "lcpcli",
    "pdf.fonttype": 42,
}


@dataclass(frozen=True)
class LineStyle:
    """The line style of a method: a solid line, as dashes would put gaps into a curve
    that zigzags."""

    color: str
    marker: Any
    fill: str = "full"
    width: float = 1.3

    @property
    def line(self) -> dict[str, Any]:
        return {"color": self.color, "linewidth": self.width}

    @property
    def points(self) -> dict[str, Any]:
        return {
            "marker": self.marker,
            "markersize": 4.2 if self.fill == "full" and self.marker != "*" else 5.2,
            "fillstyle": self.fill,
            "color": self.color,
            "markerfacecoloralt": "white",
            "markeredgewidth": 0.8,
        }


LineStyles = dict[tuple[str, str], LineStyle]  # by name and label

METHODS = {
    "auto": LineStyle("#000000", "*"),
    "fixed-point": LineStyle("#004b87", "s"),
    "newton": LineStyle("#007d5b", "^"),
    "shi": LineStyle("#d55e00", "o"),
    "interior": LineStyle("#4d2600", "v"),
    "lemke": LineStyle("#cc79a7", "D"),
    "milp": LineStyle("#e69f00", "P"),
    "reflections": LineStyle("#7b3fa0", "h"),
}
SPARE = (  # of peers, and of methods of other packages
    LineStyle("#332288", "p", "none"),
    LineStyle("#882255", (4, 1, 0), "none"),
    LineStyle("#8c564b", "d", "none"),
    LineStyle("#999933", (6, 1, 0), "none"),
    LineStyle("#56b4e9", (3, 1, 0), "none"),
    LineStyle("#8a8a8a", "X", "none"),
    LineStyle("#117733", "8", "none"),
    LineStyle("#aa4499", "H", "none"),
    LineStyle("#44aa99", (7, 1, 0), "none"),
    LineStyle("#b8860b", (5, 0, 180), "none"),
)
# Markers for more than two runs of one method.
RAMP = ("o", "s", "^", "D", "v", "P", "X", "p", "<", "h", ">", "8")
# The lightness (CIE L*) of their first and last colour: light on white, and still a
# colour.
PALE, DEEP = 74.0, 22.0
# From white over a colour to black: neighbours differ by less than the 8 bits of a
# channel show.
SHADES = 1024


def styles_of(entries: Iterable[tuple[str, str]]) -> LineStyles:
    """Return the line style of each (name, label), which depends on the name; several
    labels of one name share its hue. Two have the same marker, full and half full; more
    have different markers, and colours from light to dark; the runs of a grid a colour
    for each value of one option, and a marker for each of the other one. Names that are
    not of methods take the spare styles in the order in which they appear."""
    labels: dict[str, list[str]] = {}
    for name, label in dict.fromkeys(entries):
        labels.setdefault(name, []).append(label)
    styles_of_methods = METHODS | dict(
        zip(
            (name for name in labels if name not in METHODS), cycle(SPARE), strict=False
        )
    )
    styles: LineStyles = {}
    for name, labels_of_name in labels.items():
        line_style = styles_of_methods[name]
        runs = [line_style, replace(line_style, fill="left", width=0.8)][
            : len(labels_of_name)
        ]
        if len(labels_of_name) > len(runs):
            grid_positions = grid_positions_of(labels_of_name)
            elsewhere = {
                styles_of_methods[other].marker for other in labels if other != name
            }
            colors_between = LinearSegmentedColormap.from_list(
                "", ["white", line_style.color, "black"], SHADES
            )
            ramp = colors_between(np.arange(SHADES))[:, :3]
            linear = np.where(
                ramp <= 0.04045, ramp / 12.92, ((ramp + 0.055) / 1.055) ** 2.4
            )
            lightness = 116 * np.cbrt(linear @ (0.2126, 0.7152, 0.0722)) - 16
            wanted = np.linspace(PALE, DEEP, 1 + max(row for row, _ in grid_positions))
            colors = [
                to_hex(ramp[np.abs(lightness - each).argmin()]) for each in wanted
            ]
            markers = [marker for marker in RAMP if marker not in elsewhere] or RAMP
            colored_markers = (
                (colors[row], markers[column % len(markers)])
                for row, column in grid_positions
            )
            runs = [
                replace(line_style, color=color, marker=marker, fill="full")
                for color, marker in colored_markers
            ]
        styles |= {
            (name, label): run for label, run in zip(labels_of_name, runs, strict=True)
        }
    return styles


def grid_positions_of(labels: Sequence[str]) -> list[tuple[int, int]]:
    """Return a row and a column for each run of one method: by the values of the two
    options that all labels set, if both vary, as in shi:p=100,k-star=5; else each run
    has another row and another column."""
    parts = (
        (
            part.partition("=")[::2]
            for part in label.partition(":")[2].split(",")
            if part
        )
        for label in labels
    )
    settings = list(map(dict, parts))
    if (
        len({tuple(settings_of_run) for settings_of_run in settings}) == 1
        and len(settings[0]) == 2
    ):
        values = [
            list(dict.fromkeys(column))
            for column in zip(
                *(settings_of_run.values() for settings_of_run in settings), strict=True
            )
        ]
        if min(map(len, values)) > 1:
            return [
                (values[0].index(one), values[1].index(other))
                for one, other in (o.values() for o in settings)
            ]
    return [(i, i) for i in range(len(labels))]


def context() -> AbstractContextManager[None]:
    return matplotlib.style.context(SETTINGS, after_reset=True)


def file(
    draw: Callable[[], Figure], file_format: str, title: str, provenance: Sequence[str]
) -> bytes:
    """Return the figure as a file, with its provenance as metadata; the same figure
    gives the same bytes."""
    subject, without = METADATA[file_format]
    metadata = {"Title": title, subject: "; ".join(provenance), without: None}
    buffer = BytesIO()
    with context():
        draw().savefig(buffer, format=file_format, dpi=PNG_DPI, metadata=metadata)
    return buffer.getvalue()


def fitted_text(text: str, size: float, inches: float) -> str:
    """Return a text on one line, cut to `inches`; ? replaces characters that the font
    lacks, and $ is literal."""
    font = FontProperties(family=FAMILY, size=size)
    glyphs = get_font(findfont(font)).get_charmap()
    text = "".join(c if ord(c) in glyphs else "?" for c in visible(text))

    def width(n: int) -> float:
        shown = text if n == len(text) else text[:n] + "..."
        return float(
            text_to_path.get_text_width_height_descent(shown, font, ismath=False)[0]
        )

    if width(len(text)) > 72 * inches:
        text = (
            text[: bisect_right(range(len(text)), 72 * inches, key=width) - 1].rstrip()
            + "..."
        )
    return text.replace("$", r"\$")


SAMPLE = 0.6  # inches that a sample takes in front of its label
BEYOND, UNSOLVED = "0 or beyond the axis", "not solved"
# By their labels, which no other artist in axes has.
SIGNS: dict[str, dict[str, Any]] = {
    BEYOND: {
        "linestyle": "",
        "marker": "o",
        "markersize": 8,
        "markerfacecolor": "none",
        "markeredgewidth": 0.7,
    },
    UNSOLVED: {"linestyle": "", "marker": "x", "markersize": 8, "markeredgewidth": 1.3},
}
Entry: TypeAlias = tuple[Line2D, str]


def add_legend(
    figure: Figure, styles: LineStyles, others: Sequence[Entry] = ()
) -> Figure:
    """Add a legend in as many columns as fit, by whose height the figure grows. others
    : further samples."""
    figure.align_labels()
    signs = {
        label for axes in figure.axes for label in axes.get_legend_handles_labels()[1]
    }
    entries = [
        (Line2D([], [], **(line_style.points | line_style.line)), run)
        for (_, run), line_style in styles.items()
    ]
    entries += [
        *others,
        *(
            (Line2D([], [], color=GREY, **sign), text)
            for text, sign in SIGNS.items()
            if text in signs
        ),
    ]
    handles, count = [handle for handle, _ in entries], len(entries)
    for columns in sorted(
        {math.ceil(count / rows) for rows in range(1, count + 1)}, reverse=True
    ):
        legend = figure.legend(
            handles, ["-" for _ in entries], loc="outside lower center", ncols=columns
        )
        for drawn, (_, text) in zip(legend.get_texts(), entries, strict=True):
            # matplotlib 3.7 leaves out a label of the legend that begins with _
            drawn.set_text(
                fitted_text(text, SMALL_FONT, figure.get_figwidth() - SAMPLE)
            )
        size = legend.get_window_extent()
        if size.width <= figure.bbox.width or columns == 1:
            figure.set_figheight(figure.get_figheight() + size.height / figure.dpi)
            break
        legend.remove()
    return figure
