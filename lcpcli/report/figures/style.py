"""What all figures share: one colour, marker and line style a method, fonts, and the way to bytes.

The colours are Okabe and Ito's (Color Universal Design, 2008) and Tol's (Colour schemes, SRON 2021), some darkened, so
that the methods' lightness rises in steps of about ten and they are told apart in grey. Peers have hollow markers.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.textpath import text_to_path

FONT = 8  # points, as in the captions of a journal
SMALL = 7
PNG_DPI = 300
FAMILY = "DejaVu Sans"  # comes with matplotlib: the same picture on every machine
WIDTH = 7.0  # inches, as all lengths of figures here: two columns of a journal
ROW = 2.45  # the height of a row of axes


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
    "highs": Look("#8a8a8a", "X", (1, 2), "none"),
    "siconos-newton": Look("#aa3377", "+", (8, 1, 1, 1, 1, 1), "none"),
    "siconos-lemke": Look("#661100", "1", (4, 1, 4, 3), "none"),
    "siconos-pgs": Look("#6699cc", (5, 1, 180), (1, 3), "none"),
}
SPARE = (
    Look("#117733", "8", (2, 2), "none"),
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


@contextmanager
def context() -> Iterator[None]:
    """The settings of these figures, whatever the user's own are; the user's are back afterwards."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(
            {
                "font.family": FAMILY,
                "font.size": FONT,
                "text.hinting": "none",  # else widths depend on the resolution
                "figure.constrained_layout.use": True,
                "figure.constrained_layout.h_pad": 0.07,
                "figure.constrained_layout.w_pad": 0.06,
                "axes.titlesize": FONT,
                "axes.titlelocation": "left",
                "axes.labelsize": FONT,
                "xtick.labelsize": SMALL,
                "ytick.labelsize": SMALL,
                "legend.fontsize": SMALL,
                "legend.frameon": False,
                "legend.handlelength": 3.4,
                "legend.columnspacing": 1.6,
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


def save(figure: Figure, form: str, title: str, provenance: Sequence[str]) -> bytes:
    """The figure as a file, with its provenance as metadata; the same figure gives the same bytes."""
    told = "; ".join(provenance)
    metadata: dict[str, dict[str, str | None]] = {
        "png": {"Title": title, "Description": told, "Software": None},
        "svg": {"Title": title, "Description": told, "Date": None},
        "pdf": {"Title": title, "Subject": told, "CreationDate": None},
    }
    buffer = BytesIO()
    figure.savefig(buffer, format=form, dpi=PNG_DPI, metadata=metadata[form])
    return buffer.getvalue()


def fitted(text: str, size: float, inches: float) -> str:
    """A text on one line, cut to that length, in which ? stands for what the font lacks and $ begins no formula."""
    font = FontProperties(family=FAMILY, size=size)
    glyphs = get_font(findfont(font)).get_charmap()
    text = "".join(c if ord(c) in glyphs else "?" for c in " ".join(text.split()))

    def width(part: str) -> float:
        points, _, _ = text_to_path.get_text_width_height_descent(part, font, ismath=False)
        return float(points) / 72

    if width(text) > inches:
        most = bisect_right(range(len(text)), inches, key=lambda n: width(text[:n] + "..."))
        text = text[: most - 1].rstrip() + "..."
    return text.replace("$", r"\$")
