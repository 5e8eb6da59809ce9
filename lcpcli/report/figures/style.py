"""What all figures share: one colour, marker and line style a method, fonts, and the way to bytes.

The colours are Okabe and Ito's (Color Universal Design, 2008) and Tol's (Colour schemes, SRON 2021), some darkened, so
that the methods' lightness rises in steps of about ten and they are told apart in grey. Peers have hollow markers.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any, cast

import matplotlib
from matplotlib import font_manager
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg, RendererAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

FONT = 8  # points, as in the captions of a journal
SMALL = 7
POINTS = 72  # points an inch; figures are laid out at this resolution, so that a pixel is a point
PNG_DPI = 300
GREY = "0.35"
BELOW, BESIDE = 0.32, 0.43  # inches from the frame to the names of the axes


@dataclass(frozen=True)
class Look:
    """How a method is drawn. dash: lengths of dashes and gaps in line widths, () for a solid line."""

    color: str
    marker: Any
    dash: tuple[float, ...]
    fill: str = "full"
    width: float = 1.3

    @property
    def line(self) -> dict[str, Any]:
        return {"color": self.color, "linestyle": (0, self.dash) if self.dash else "-", "linewidth": self.width}

    @property
    def points(self) -> dict[str, Any]:
        size = 4.2 if self.fill == "full" and self.marker != "*" else 5.2
        return {
            "marker": self.marker,
            "markersize": size,
            "fillstyle": self.fill,
            "color": self.color,
            "markerfacecoloralt": "white",
            "markeredgewidth": 0.8,
        }

    @property
    def text(self) -> str:
        """The colour of a label: the curve's, darkened until thin strokes of it are readable on white."""
        return matplotlib.colors.to_hex([0.8 * part for part in matplotlib.colors.to_rgb(self.color)])


Looks = dict[tuple[str, str], Look]  # by name and label

METHODS = {
    "auto": Look("#000000", "*", ()),
    "fixed-point": Look("#004b87", "s", (4, 1.5)),
    "newton": Look("#007d5b", "^", (1, 1)),
    "shi": Look("#d55e00", "o", (7, 1.5)),
    "lemke": Look("#cc79a7", "D", (5, 1.2, 1, 1.2)),
    "milp": Look("#e69f00", "P", (3, 1, 1, 1, 1, 1)),
}
PEERS = {
    "piqp": Look("#332288", "p", (8, 1, 1, 1), "none"),
    "clarabel": Look("#882255", (4, 1, 0), (2, 1), "none"),
    "quantecon": Look("#8c564b", "d", (6, 2), "none"),
    "osqp": Look("#999933", (6, 1, 0), (3, 2), "none"),
    "daqp": Look("#56b4e9", (3, 1, 0), (6, 1, 2, 1), "none"),
    "highspy": Look("#8a8a8a", "X", (1, 2), "none"),
    "siconos": Look("#117733", "8", (2, 2), "none"),
    "siconos-newton": Look("#aa3377", "+", (8, 1, 1, 1, 1, 1), "none"),
    "siconos-lemke": Look("#661100", "1", (4, 1, 4, 3), "none"),
    "siconos-pgs": Look("#6699cc", (5, 1, 180), (1, 3), "none"),
}
SPARE = (
    Look("#aa4499", "H", (12, 2), "none"),
    Look("#44aa99", "2", (7, 1, 2, 1, 2, 1), "none"),
    Look("#b8860b", (5, 0, 180), (2, 3), "none"),
    Look("#5b2a86", (4, 1, 45), (12, 2, 1, 2), "none"),
    Look("#6b6b6b", (3, 1, 180), (1, 4), "none"),
)
VARIANTS = ("left", "bottom", "right", "top")  # further runs of the same method: half a marker, and a thinner line


def looks(entries: Iterable[tuple[str, str]]) -> Looks:
    """The look of each (name, label): of its name, varied where one name has several labels.

    Other names than those of the methods and peers take the spare looks in the order in which they appear.
    """
    found: Looks = {}
    others: list[str] = []
    for name, label in entries:
        if (name, label) in found:
            continue
        look = METHODS.get(name) or PEERS.get(name)
        if look is None:
            if name not in others:
                others.append(name)
            look = SPARE[others.index(name) % len(SPARE)]
        earlier = sum(other == name for other, _ in found)
        if earlier:
            look = replace(look, fill=VARIANTS[(earlier - 1) % len(VARIANTS)], width=0.8)
        found[name, label] = look
    return found


def key(look: Look) -> Line2D:
    """The sample of a look in a legend."""
    return Line2D([], [], **(look.points | look.line))


@contextmanager
def context() -> Iterator[None]:
    """The settings of these figures, whatever the user's own are; the user's are back afterwards."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(
            {
                "font.family": "DejaVu Sans",  # comes with matplotlib: the same picture on every machine
                "font.size": FONT,
                "axes.titlesize": FONT,
                "axes.labelsize": FONT,
                "xtick.labelsize": SMALL,
                "ytick.labelsize": SMALL,
                "legend.fontsize": SMALL,
                "axes.linewidth": 0.6,
                "xtick.direction": "in",
                "ytick.direction": "in",
                "xtick.top": True,
                "ytick.right": True,
                "xtick.major.width": 0.6,
                "ytick.major.width": 0.6,
                "xtick.minor.width": 0.4,
                "ytick.minor.width": 0.4,
                "lines.dash_capstyle": "butt",
                "path.simplify_threshold": 0.3,
                "svg.fonttype": "path",
                "svg.hashsalt": "lcpcli",
                "pdf.fonttype": 42,
            }
        )
        yield


def page(width: float, height: float) -> Figure:
    """An empty figure of that size in inches, whose text can be measured in points."""
    figure = Figure(figsize=(width, height), dpi=POINTS)
    FigureCanvasAgg(figure)
    return figure


def add_axes(figure: Figure, inches: tuple[float, float, float, float]) -> Axes:
    """Axes whose frame has its left and lower edges, width and height where the inches say."""
    left, bottom, width, height = inches
    page_width, page_height = figure.get_size_inches()
    return figure.add_axes((left / page_width, bottom / page_height, width / page_width, height / page_height))


def name_axes(axes: Axes, abscissa: str, ordinate: str) -> None:
    """Name both axes at fixed distances from the frame, so that the names of neighbours are on one line."""
    width, height = axes.bbox.width / POINTS, axes.bbox.height / POINTS
    axes.set_xlabel(abscissa, va="baseline")
    axes.xaxis.set_label_coords(0.5, -BELOW / height)
    axes.set_ylabel(ordinate, va="bottom")
    axes.yaxis.set_label_coords(-BESIDE / width, 0.5)


def save(figure: Figure, form: str) -> bytes:
    """The figure as a file; the same figure gives the same bytes."""
    undated: dict[str, dict[str, None]] = {
        "png": {"Software": None},
        "svg": {"Date": None},
        "pdf": {"CreationDate": None},
    }
    buffer = BytesIO()
    figure.savefig(buffer, format=form, dpi=PNG_DPI, metadata=undated[form])
    return buffer.getvalue()


def legible(text: str) -> str:
    """A text on one line, in which a question mark stands for what the font lacks."""
    font = font_manager.get_font(font_manager.findfont("DejaVu Sans"))
    return "".join(c if font.get_char_index(ord(c)) else "?" for c in " ".join(text.split()))


def renderer(figure: Figure) -> RendererAgg:
    """What measures the texts of a page."""
    canvas = cast(FigureCanvasAgg, figure.canvas)
    return canvas.get_renderer()


def width_of(figure: Figure, text: str, size: float) -> float:
    """The width of a plain text in points."""
    prop = font_manager.FontProperties(family="DejaVu Sans", size=size)
    width, _, _ = renderer(figure).get_text_width_height_descent(text, prop, False)
    return float(width)


def fitted(figure: Figure, text: str, size: float, room: float) -> str:
    """A text made legible and, if it is wider than the room in points, cut."""
    text = legible(text)
    if width_of(figure, text, size) <= room:
        return text
    while text and width_of(figure, text + "...", size) > room:
        text = text[:-1]
    return text.rstrip() + "..."
