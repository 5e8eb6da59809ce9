"""The data of figures, and the ranges of the axes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Curve:
    """One run on one problem.

    name : the method or peer, which decides colour, marker and line style. label : the name of the run in the legend.
    k : the numbers of the iterates; an iterate whose number is None is left out where k is the abscissa.
    seconds, errors : of each iterate the run time, and the error or residual; None where it was not measured.
    solved : whether the run solved the problem; a cross marks the end of any other one.
    x : the iterates of a problem in two unknowns, if they were kept.
    """

    name: str
    label: str
    k: Sequence[int | None]
    seconds: Sequence[float]
    errors: Sequence[float | None]
    solved: bool
    x: Sequence[Sequence[float]] = ()

    @property
    def counts(self) -> list[int]:
        return [k for k, error in zip(self.k, self.errors, strict=True) if k is not None and error is not None]


@dataclass(frozen=True)
class Panel:
    """The runs on one problem. measure : "error" or "residual", whichever the curves have. provenance : a line on the
    program and its options, for the file's metadata. problem, solutions : of runs whose x were kept, the LCP and the
    x = (z - w) / 2 of its known solutions."""

    title: str
    measure: str
    curves: Sequence[Curve]
    provenance: str = ""
    problem: Any = None
    solutions: Sequence[Sequence[float]] = ()


@dataclass(frozen=True)
class Power:
    """The fit seconds = coefficient n^exponent, by least squares on the logarithms, for whose independent normal errors
    the exponent has a confidence interval of half-width `margin`. r_squared : the fraction of the variance
    explained."""

    exponent: float
    margin: float
    coefficient: float
    r_squared: float


@dataclass(frozen=True)
class Growth:
    """One solver's median run times in seconds on problems of n unknowns, with their quartiles, and the fitted power of
    n; None for too few sizes."""

    name: str
    label: str
    n: Sequence[int]
    seconds: Sequence[float]
    lower: Sequence[float]
    upper: Sequence[float]
    fit: Power | None


@dataclass(frozen=True)
class Profile:
    """One solver's times, one per problem, as multiples of the fastest solver's or in seconds; inf where it failed."""

    name: str
    label: str
    ratios: Sequence[float]
    in_seconds: bool = False


SMALLEST_ERROR = 1e-17  # relative to the start: a smaller error, below rounding, is drawn at the lower end, like 0
LARGEST_ERROR = 1e4  # relative to the start: a larger error, of a divergent run, is drawn at the upper end, like inf
MARGIN = 0.06  # of the length of the data, on both sides of them, where values off the scale are drawn
LEAST_MARGIN = 0.12  # decades: the margin of data that hardly vary
SMALLEST_END, LARGEST_END = 1e-250, 1e250  # no axis goes beyond, so that matplotlib has room in double precision


class Range(NamedTuple):
    """The places of values off the scale, below and above all others."""

    low: float
    high: float

    def place(self, value: float) -> float:
        return max(self.low, value) if value <= self.high else self.high


ALL_ZERO = Range(1e-17, 1e-15)  # at whose lower edge a point without any error stands


class DrawnPoint(NamedTuple):
    """The place of an iterate. is_beyond : whether its own value lies off the scale."""

    x: float
    y: float
    is_beyond: bool


def errors(curves: Iterable[Curve]) -> Range:
    """Return a range around the errors that are neither practically 0 nor those of a divergent run."""
    series = [[v for v in curve.errors if v is not None] for curve in curves]
    proper = [[v for v in values if 0 < v < math.inf] for values in series]
    if any(series) and not any(v for values in series for v in values):
        return ALL_ZERO
    starts = [values[0] for values in proper if len(values) > 1] or [v for values in proper for v in values]
    scale = max(starts, default=1.0)
    floor, ceiling = max(SMALLEST_ERROR * scale, SMALLEST_END), min(LARGEST_ERROR * scale, LARGEST_END)
    return times([v for values in series for v in values], floor, ceiling)


def times(values: Iterable[float], floor: float = SMALLEST_END, ceiling: float = LARGEST_END) -> Range:
    """Return a range around the values from floor to ceiling, of at least one decade."""
    shown = [math.log10(v) for v in values if floor <= v <= ceiling] or [0.0]
    margin = max(MARGIN * (max(shown) - min(shown)), LEAST_MARGIN)
    low, high = min(shown) - margin, max(shown) + margin
    if math.floor(high) - math.ceil(low) < 1:
        low, high = min(low, math.floor(low + 0.5)), max(high, math.floor(low + 0.5) + 1)
    return Range(10.0**low, 10.0**high)


def inside(xs: Sequence[float | None], ys: Sequence[float | None], across: Range, up: Range) -> list[DrawnPoint]:
    """Return the points where both x and y are measured, moved to the edge if they are off the axes."""
    measured = [(x, y) for x, y in zip(xs, ys, strict=True) if x is not None and y is not None]
    places = [(across.place(x), up.place(y)) for x, y in measured]
    return [DrawnPoint(*place, place != given) for place, given in zip(places, measured, strict=True)]
