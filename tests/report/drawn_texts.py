"""The texts of a figure as they are drawn, and whether they lie on one another."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.text import Text

from lcpcli.report.figures import style


def texts(figure: Figure) -> list[Text]:
    """All texts that are drawn, in their places."""
    FigureCanvasAgg(figure).draw()
    found = list(figure.texts)
    for axes in figure.axes:
        found += axes.texts
        if axes.axison:
            found += [axes._left_title, axes.title]  # type: ignore[attr-defined]
            for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
                ticks = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)  # no labels if hidden
                found += [axis.label, axis.offsetText, *(label for at, label in ticks if low <= at <= high)]
    for legend in [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]:
        found += legend.get_texts()
    return [text for text in found if text.get_text() and text.get_visible()]


def corners(text: Text) -> np.ndarray:
    """Those of the box around a text, turned as it is."""
    around = text.get_window_extent()
    middle = np.array([(around.x0 + around.x1) / 2, (around.y0 + around.y1) / 2])
    angle = math.radians(text.get_rotation())
    text.set_rotation(0)
    flat = text.get_window_extent()
    text.set_rotation(math.degrees(angle))
    box = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * np.array([flat.width, flat.height]) / 2
    cos, sin = math.cos(angle), math.sin(angle)
    return box @ [[cos, sin], [-sin, cos]] + middle


def assert_no_text_is_on_another_or_leaves(figure: Figure) -> None:
    with style.context():
        boxes = [(text.get_text(), corners(text)) for text in texts(figure)]
        page = figure.bbox
    for text, box in boxes:
        assert page.x0 <= box[:, 0].min() <= box[:, 0].max() <= page.x1, text
        assert page.y0 <= box[:, 1].min() <= box[:, 1].max() <= page.y1, text
    for (text, box), (other_text, other) in combinations(boxes, 2):
        if (box.min(axis=0) < other.max(axis=0)).all() and (other.min(axis=0) < box.max(axis=0)).all():
            assert not Path(box).intersects_path(Path(other), filled=True), (text, other_text)
