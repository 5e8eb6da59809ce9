"""Places for labels in a drawing: clear of what is drawn already. All lengths are in points."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from lcpcli.report.figures.style import FAMILY

STEP = 2.0  # between the points that stand for a line or an area
CLEAR = 2.0  # at least, around a label


@dataclass(frozen=True)
class Place:
    """The centre of a label, and its rotation in radians."""

    x: float
    y: float
    rotation: float = 0.0


class Drawing:
    """What is drawn in axes whose unit is the point, as points that labels avoid."""

    def __init__(self, axes: Axes) -> None:
        self.axes = axes
        self._taken = np.empty((0, 2))

    def take(self, points: Iterable[Sequence[float]]) -> None:
        """Keep labels off these points."""
        self._taken = np.vstack([self._taken, *points])

    def take_line(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Keep labels off a line."""
        shares = np.linspace(0, 1, max(2, math.ceil(math.dist(start, end) / STEP)))
        self.take(np.outer(1 - shares, start) + np.outer(shares, end))

    def label(self, text: str, size: float, places: Iterable[Place], free: float = CLEAR) -> None:
        """Write a text at the first place with that much free space around it, or else where there is most."""
        self._write(text, size, max(places, key=lambda place: min(self._space(place, *extent(text, size)), free)))

    def label_if_free(self, text: str, size: float, places: Sequence[Place], free: float) -> bool:
        """The same, but not where the text would cover or touch anything; whether there was a place."""
        fitting = [place for place in places if self._space(place, *extent(text, size)) >= CLEAR]
        if fitting:
            self.label(text, size, fitting, free)
        return bool(fitting)

    def _write(self, text: str, size: float, place: Place) -> None:
        width, height = extent(text, size)
        style: dict[str, Any] = {"fontsize": size, "ha": "center", "va": "center", "zorder": 8}
        self.axes.text(place.x, place.y, text, rotation=math.degrees(place.rotation), **style)
        across, up = np.meshgrid(
            np.linspace(-width / 2, width / 2, math.ceil(width / STEP) + 1),
            np.linspace(-height / 2, height / 2, math.ceil(height / STEP) + 1),
        )
        cos, sin = math.cos(place.rotation), math.sin(place.rotation)
        box = np.column_stack((across.ravel(), up.ravel())) @ [[cos, sin], [-sin, cos]]
        self.take(np.add(box, [place.x, place.y]))

    def _space(self, place: Place, width: float, height: float) -> float:
        """How far a label is from all that is drawn, across or along it; negative if it covers any of that."""
        cos, sin = math.cos(place.rotation), math.sin(place.rotation)
        across, up = np.abs((self._taken - [place.x, place.y]) @ [[cos, -sin], [sin, cos]]).T
        return float(np.max([across - width / 2, up - height / 2], axis=0).min())


@lru_cache
def extent(text: str, size: float) -> tuple[float, float]:
    """The width and height of a text in which $ begins a formula."""
    font = FontProperties(family=FAMILY, size=size)
    width, height, _ = text_to_path.get_text_width_height_descent(text, font, ismath="$" in text)
    return float(width), float(height)
