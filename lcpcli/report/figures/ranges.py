"""From the data of curves to the ranges of logarithmic axes, and to points that lie inside them, none lost."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from lcpcli.report.figures import Curve

NEGLIGIBLE = 1e-17  # relative to the start: what is less is drawn at the lower end, like 0
GROWN = 1e4  # relative to the start: what is more is drawn at the upper end, like inf
INSET = 0.045  # of the length of an axis
MARGIN = 0.06  # of the length of an axis, on both sides of the data
APART = 0.5  # decades from the data to what is beyond, at least
DECADES = 300  # powers of ten beyond which no axis goes


@dataclass(frozen=True)
class Range:
    """The ends of an axis. What lies beyond them is drawn a little inside of them, clear of frame and tick labels."""

    low: float
    high: float

    @property
    def inner(self) -> tuple[float, float]:
        inset = (self.high / self.low) ** INSET
        return self.low * inset, self.high / inset


@dataclass(frozen=True)
class Point:
    """Where an iterate is drawn. beyond: "", or the side on which its value is out of range."""

    x: float
    y: float
    beyond: str


def errors(curves: Iterable[Curve]) -> Range:
    """Around the errors that can be told from 0 and from a divergence."""
    series = [[v for v in curve.errors if v is not None] for curve in curves]
    proper = [[v for v in values if 0 < v < math.inf] for values in series]
    starts = [values[0] for values in proper if len(values) > 1] or [v for values in proper for v in values]
    scale = max(starts, default=1.0)
    return _around([v for values in series for v in values], NEGLIGIBLE * scale, GROWN * scale)


def times(values: Iterable[float]) -> Range:
    """Around the positive values."""
    return _around(list(values), 0.0, math.inf)


def _around(values: Sequence[float], floor: float, ceiling: float) -> Range:
    """A little more than the values from floor to ceiling, and one decade at least; more on a side with others."""
    shown = [math.log10(v) for v in values if 0 < v < math.inf and floor <= v <= ceiling] or [0.0]
    low, high = min(shown), max(shown)
    margin = max(MARGIN * (high - low), 0.12)
    room = max(2.5 * margin, APART)
    low -= room if any(v < floor or v <= 0 for v in values) else margin
    high += room if any(not v <= ceiling or v == math.inf for v in values) else margin
    if math.floor(high) - math.ceil(low) < 1:
        low, high = min(low, math.floor(low + 0.5)), max(high, math.floor(low + 0.5) + 1)
    return Range(10.0 ** max(low, -DECADES), 10.0 ** min(high, DECADES))


def inside(xs: Sequence[float], ys: Sequence[float | None], across: Range, up: Range) -> list[Point]:
    """The points of the measured values; what lies outside of the ranges is near their ends."""
    return [_point(x, y, across, up) for x, y in zip(xs, ys, strict=True) if y is not None]


def _point(x: float, y: float, across: Range, up: Range) -> Point:
    beyond = ""
    if not across.low <= x <= across.high:
        beyond = "left" if x < across.low else "right"
        x = across.inner[beyond == "right"]
    if not up.low <= y <= up.high:
        beyond = "below" if y < up.low else "above"
        y = up.inner[beyond == "above"]
    return Point(x, y, beyond)


def decades(span: Range, most: int) -> tuple[list[float], list[float]]:
    """Major ticks at powers of ten, `most` of them at most, and the minor ticks between them."""
    first, last = math.ceil(math.log10(span.low)), math.floor(math.log10(span.high))
    step = max(math.ceil((last - first + 1) / most), 1)
    majors = [10.0**e for e in range(first, last + 1) if e % step == 0]
    if step > 1:
        return majors, [10.0**e for e in range(first, last + 1) if e % step]
    minors = [digit * 10.0**e for e in range(first - 1, last + 1) for digit in range(2, 10)]
    return majors, [v for v in minors if span.low <= v <= span.high]
