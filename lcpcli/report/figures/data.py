"""The data of figures, and the ranges of the axes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Curve:
    """One run on one problem.

    name : the method or peer, which decides colour, marker and line style.
    label : the name of the run in the legend.
    k : the numbers of the iterates; an iterate whose number is None is left out where k is the abscissa.
    seconds : the run time until each iterate.
    errors : the error or residual of each iterate; None where it was not measured.
    solved : whether the run solved the problem; a cross marks the end of any other one.
    """

    name: str
    label: str
    k: Sequence[int | None]
    seconds: Sequence[float]
    errors: Sequence[float | None]
    solved: bool


@dataclass(frozen=True)
class Panel:
    """The runs on one problem.

    measure : "error" or "residual", whichever the curves have.
    provenance : a line on the program and its options, for the file's metadata.
    """

    title: str
    measure: str
    curves: Sequence[Curve]
    provenance: str = ""


@dataclass(frozen=True)
class Power:
    """The fit seconds = coefficient n^exponent, by least squares on the logarithms.

    margin : the half-width of the exponent's confidence interval, for independent normal errors in the logarithms.
    r_squared : the fraction of the variance explained by the fit.
    """

    exponent: float
    margin: float
    coefficient: float
    r_squared: float


@dataclass(frozen=True)
class Growth:
    """One solver's median run times in seconds on problems of n unknowns, with their quartiles.

    fit : the fitted power of n; None for too few sizes.
    """

    name: str
    label: str
    n: Sequence[int]
    seconds: Sequence[float]
    lower: Sequence[float]
    upper: Sequence[float]
    fit: Power | None


@dataclass(frozen=True)
class GrowthPanel:
    """The growth of time over n for several solvers on one family of problems."""

    title: str
    growths: Sequence[Growth]


@dataclass(frozen=True)
class Profile:
    """One solver's times as multiples of the fastest solver's time, one per problem; inf where the solver failed."""

    name: str
    label: str
    ratios: Sequence[float]


@dataclass(frozen=True)
class Cones:
    """The complementary cones of an LCP with two unknowns, and which of them contain q.

    M : two rows of two numbers. q : two numbers.
    holding : whether q lies in the cone of each set of unknowns that may be positive: none, first, second, both.
    count : the number of solutions, in words.
    names : the names of the unknowns; "" for an unknown without a name.
    provenance : lines on the problem and the program, for the file's metadata.
    """

    title: str
    M: Sequence[Sequence[float]]
    q: Sequence[float]
    holding: Sequence[bool]
    count: str
    names: Sequence[str] = ("", "")
    provenance: Sequence[str] = ()


SMALLEST_ERROR = 1e-17  # relative to the start: a smaller error, below rounding, is drawn at the lower end, like 0
LARGEST_ERROR = 1e4  # relative to the start: a larger error, of a divergent run, is drawn at the upper end, like inf
MARGIN = 0.06  # of the length of an axis, on both sides of the data, so that markers stay inside
LEAST_MARGIN = 0.12  # decades: the margin of data that hardly vary
STRIP = 0.1  # of the length of the scale: the strip at an end with the values off the scale, wide enough for a ring
SMALLEST_END, LARGEST_END = 1e-250, 1e250  # no axis goes beyond, so that matplotlib has room in double precision


@dataclass(frozen=True)
class Range:
    """The ends of an axis, and between them the ends of its scale. A strip beyond the scale shows values off it."""

    low: float
    high: float
    scale_low: float
    scale_high: float

    def place(self, value: float, below: str, above: str) -> tuple[float, str]:
        """Return the place of a value, in the middle of a strip if it is off the scale, and the word for that side, or
        ""."""
        if self.scale_low <= value <= self.scale_high:
            return value, ""
        if value < self.scale_low:
            return math.sqrt(self.low) * math.sqrt(self.scale_low), below
        return math.sqrt(self.scale_high) * math.sqrt(self.high), above


@dataclass(frozen=True)
class Point:
    """The place of an iterate. beyond : the side on which its value is out of range; "" for none."""

    x: float
    y: float
    beyond: str


def errors(curves: Iterable[Curve]) -> Range:
    """Return a range around the errors that are neither practically 0 nor those of a divergence."""
    series = [[v for v in curve.errors if v is not None] for curve in curves]
    proper = [[v for v in values if 0 < v < math.inf] for values in series]
    starts = [values[0] for values in proper if len(values) > 1] or [v for values in proper for v in values]
    scale = max(starts, default=1.0)
    floor, ceiling = max(SMALLEST_ERROR * scale, SMALLEST_END), min(LARGEST_ERROR * scale, LARGEST_END)
    return times([v for values in series for v in values], floor, ceiling)


def times(values: Iterable[float], floor: float = SMALLEST_END, ceiling: float = LARGEST_END) -> Range:
    """Return a range around the values from floor to ceiling, of at least one decade, with strips for values beyond."""
    values = list(values)
    shown = [math.log10(v) for v in values if floor <= v <= ceiling] or [0.0]
    margin = max(MARGIN * (max(shown) - min(shown)), LEAST_MARGIN)
    low, high = min(shown) - margin, max(shown) + margin
    if math.floor(high) - math.ceil(low) < 1:
        low, high = min(low, math.floor(low + 0.5)), max(high, math.floor(low + 0.5) + 1)
    strip = STRIP * (high - low)
    under = strip if any(v < floor for v in values) else 0.0
    over = strip if any(not v <= ceiling for v in values) else 0.0
    return Range(10.0 ** (low - under), 10.0 ** (high + over), 10.0**low, 10.0**high)


def inside(xs: Sequence[float | None], ys: Sequence[float | None], across: Range, up: Range) -> list[Point]:
    """Return the points of the measured values; a value outside of the ranges is placed near their ends."""
    points = []
    for given_x, given_y in zip(xs, ys, strict=True):
        if given_x is not None and given_y is not None:
            x, side = across.place(given_x, "left", "right")
            y, end = up.place(given_y, "below", "above")
            points.append(Point(x, y, end or side))
    return points


def decades(span: Range, most: int) -> tuple[list[float], list[float]]:
    """Return major ticks at powers of ten, at most `most` of them, and the minor ticks between them."""
    first, last = math.ceil(math.log10(span.scale_low)), math.floor(math.log10(span.scale_high))
    step = max(math.ceil((last - first + 1) / most), 1)
    majors = [10.0**e for e in range(first, last + 1) if e % step == 0]
    if step > 1:
        return majors, [10.0**e for e in range(first, last + 1) if e % step]
    minors = [digit * 10.0**e for e in range(first - 1, last + 1) for digit in range(2, 10)]
    return majors, [v for v in minors if span.scale_low <= v <= span.scale_high]
