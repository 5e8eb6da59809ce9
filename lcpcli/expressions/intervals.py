"""Interval arithmetic on arrays of shape (2, m), lower bounds before upper ones, rounded outward.

Sums, products, quotients and square roots are rounded correctly by IEEE 754, so that the neighbouring doubles bound
them; for other functions errors of up to ERROR in their last places are allowed, as numpy states at most 4. nan stands
for a function that is not defined everywhere (R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval
Analysis, 2009).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.expressions.graph import Functions
from lcpcli.expressions.tape import Arithmetic
from lcpcli.typing import Indices, Mask, Vector

EPS = float(np.finfo(float).eps)
ERROR = 8 * EPS  # relative, of functions that are not rounded correctly
LARGEST_ANGLE = 1e8  # whose place between extrema of the sine is known to six digits
MARGIN = 1e-6  # of places between extrema


def number(value: float) -> Vector:
    """Return the interval of a double."""
    return np.array([[value], [value]], dtype=float)


def hull(value: Any) -> Vector:
    """Return an interval, or the interval of a double."""
    return number(value) if np.ndim(value) == 0 else np.asarray(value)


def _outward(lower: Vector, upper: Vector) -> Vector:
    """Return bounds of numbers that are rounded to the nearest double."""
    return np.stack([np.nextafter(lower, -np.inf), np.nextafter(upper, np.inf)])


def _around(ends: Vector) -> Vector:
    """Return bounds of numbers with a relative error of at most ERROR."""
    signs = np.sign(ends) * ERROR
    return _outward(ends[0] * (1.0 - signs[0]), ends[1] * (1.0 + signs[1]))


def _unless(undefined: Any, found: Vector) -> Vector:
    return np.where(undefined, np.nan, found)


def add(a: Any, b: Any) -> Vector:
    """Return a + b."""
    a, b = hull(a), hull(b)
    return _outward(a[0] + b[0], a[1] + b[1])


def product(a: Any, b: Any) -> Vector:
    """Return a b, where 0 times infinity is 0."""
    a, b = hull(a), hull(b)
    ends = np.stack([a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]])
    zero = np.stack([(x == 0) | (y == 0) for x in a for y in b])
    ends = np.where(zero, 0.0, ends)
    undefined = np.isnan(a).any(axis=0) | np.isnan(b).any(axis=0)
    return _unless(undefined, _outward(ends.min(axis=0), ends.max(axis=0)))


def quotient(a: Any, b: Any) -> Vector:
    """Return a / b; the whole line where b may be 0."""
    a, b = hull(a), hull(b)
    ends = np.stack([a[0] / b[0], a[0] / b[1], a[1] / b[0], a[1] / b[1]])
    unbounded = ((b[0] <= 0) & (b[1] >= 0)) | np.isnan(ends).any(axis=0)
    lower, upper = _outward(ends.min(axis=0), ends.max(axis=0))
    undefined = np.isnan(a).any(axis=0) | np.isnan(b).any(axis=0)
    return _unless(undefined, np.stack([np.where(unbounded, -np.inf, lower), np.where(unbounded, np.inf, upper)]))


def absolute(a: Vector) -> Vector:
    """Return |a|."""
    crosses = (a[0] < 0) & (a[1] > 0)
    ends = np.abs(a)
    return np.stack([np.where(crosses, 0.0, ends.min(axis=0)), ends.max(axis=0)])


def power(a: Vector, exponent: int) -> Vector:
    """Return a to the power of an integer."""
    if exponent < 0:
        return quotient(1.0, power(a, -exponent))
    base = absolute(a) if exponent % 2 == 0 else a
    lower, upper = _around(np.power(base, float(exponent)))
    return np.stack([np.maximum(lower, 0.0) if exponent % 2 == 0 else lower, upper])


def general_power(a: Vector, b: Any) -> Vector:
    """Return a to the power of b, for a >= 0."""
    found: Vector = increasing(np.exp, least=0.0)(product(b, logarithm(np.log)(hull(a))))
    return found


def increasing(function: Callable[..., Any], least: float = -np.inf, greatest: float = np.inf) -> Callable[..., Any]:
    """Return an increasing function for intervals. least, greatest : bounds on its values."""

    def enclosed(a: Vector) -> Vector:
        found = _around(function(a))
        return np.clip(found, least, greatest)

    return enclosed


def logarithm(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a logarithm for intervals."""
    return lambda a: _unless(a[0] < 0, _around(function(np.maximum(a, 0.0))))


def within(function: Callable[..., Any], low: float, high: float, sign: int = 1) -> Callable[..., Any]:
    """Return a monotone function for intervals, with the sign of its derivative, that is defined from low to high."""

    def enclosed(a: Vector) -> Vector:
        found = function(np.clip(a, low, high))[::sign]
        return _unless((a[0] < low) | (a[1] > high), _around(found))

    return enclosed


def _passes(turns: Vector) -> Mask:
    """Return whether there may be an integer in an interval."""
    found: Mask = np.floor(turns[1] + MARGIN) > np.floor(turns[0] - MARGIN)
    return found


def _wave(a: Vector, greatest: float, function: Callable[..., Any]) -> Vector:
    """Return sine or cosine. greatest : an angle at which it is 1."""

    def reaches(angle: float) -> Mask:  # an interval that contains the angle, or one that differs by full turns
        return _passes((a - angle) / (2 * np.pi))

    lower, upper = np.clip(_around(np.sort(function(a), axis=0)), -1.0, 1.0)
    far = ~(np.abs(a).max(axis=0) < LARGEST_ANGLE)
    lower = np.where(far | reaches(greatest + np.pi), -1.0, lower)
    upper = np.where(far | reaches(greatest), 1.0, upper)
    return _unless(np.isnan(a).any(axis=0), np.stack([lower, upper]))


def tangent(a: Vector) -> Vector:
    """Return the tangent; the whole line where there may be a pole."""
    pole = ~(np.abs(a).max(axis=0) < LARGEST_ANGLE) | _passes((a + np.pi / 2) / np.pi)
    lower, upper = _around(np.tan(a))
    return np.stack([np.where(pole, -np.inf, lower), np.where(pole, np.inf, upper)])


def angle(y: Vector, x: Vector) -> Vector:
    """Return the angle of the point (x, y), in detail only where x > 0."""
    right = increasing(np.arctan)(quotient(y, x))
    circle = _around(np.broadcast_to([[-np.pi], [np.pi]], right.shape))
    return np.where(x[0] > 0, right, _unless(np.isnan(y).any(axis=0) | np.isnan(x).any(axis=0), circle))


def _relation(sure: Callable[..., Any], possible: Callable[..., Any]) -> Callable[..., Any]:
    """Return a relation: 1 where it holds, 0 where it does not, between them where it is open."""
    return lambda a, b: np.stack([sure(a, b), possible(a, b)]).astype(float)


def _equal(a: Vector, b: Vector) -> tuple[Mask, Mask]:
    return (a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0]), (a[0] <= b[1]) & (b[0] <= a[1])


def _chosen(condition: Vector) -> Vector:
    """Return 1 or 0; where the condition is open the whole line, as the function may jump."""
    is_open = (condition[0] == 0) & (condition[1] != 0)
    return np.stack([np.where(is_open, -np.inf, condition[0]), np.where(is_open, np.inf, condition[1])])


def _if(condition: Vector, a: Vector, b: Vector) -> Vector:
    either = np.stack([np.minimum(a[0], b[0]), np.maximum(a[1], b[1])])
    return np.where(condition[0] > 0, a, np.where(condition[1] == 0, b, either))


FUNCTIONS: Functions = {
    "number": number,
    "add": add,
    "product": product,
    "quotient": quotient,
    "power": power,
    "^": general_power,
    "abs": absolute,
    "min": np.minimum,
    "max": np.maximum,
    "exp": increasing(np.exp, least=0.0),
    "log": logarithm(np.log),
    "log10": logarithm(np.log10),
    "sqrt": within(np.sqrt, 0.0, np.inf),
    "sin": lambda a: _wave(a, np.pi / 2, np.sin),
    "cos": lambda a: _wave(a, 0.0, np.cos),
    "tan": tangent,
    "sinh": increasing(np.sinh),
    "cosh": lambda a: increasing(np.cosh, least=1.0)(absolute(a)),
    "tanh": increasing(np.tanh, -1.0, 1.0),
    "asin": within(np.arcsin, -1.0, 1.0),
    "acos": within(np.arccos, -1.0, 1.0, sign=-1),
    "atan": increasing(np.arctan),
    "asinh": increasing(np.arcsinh),
    "acosh": within(np.arccosh, 1.0, np.inf),
    "atanh": within(np.arctanh, -1.0, 1.0),
    "atan2": angle,
    "<": _relation(lambda a, b: a[1] < b[0], lambda a, b: a[0] < b[1]),
    "<=": _relation(lambda a, b: a[1] <= b[0], lambda a, b: a[0] <= b[1]),
    ">=": _relation(lambda a, b: a[0] >= b[1], lambda a, b: a[1] >= b[0]),
    ">": _relation(lambda a, b: a[0] > b[1], lambda a, b: a[1] > b[0]),
    "=": _relation(lambda a, b: _equal(a, b)[0], lambda a, b: _equal(a, b)[1]),
    "!=": _relation(lambda a, b: ~_equal(a, b)[1], lambda a, b: ~_equal(a, b)[0]),
    "sign": lambda a: np.stack([np.where(a[0] > 0, 1.0, -1.0), np.where(a[1] < 0, -1.0, 1.0)]),
    "if": _if,
    "chosen": _chosen,
    "rejected": lambda condition: _chosen(1.0 - condition[::-1]),
}


class Intervals(Arithmetic):
    """Intervals, which bound the constants of a graph, Fractions or doubles."""

    functions = FUNCTIONS

    def constants(self, values: Sequence[Any]) -> Vector:
        nearest = np.array([float(value) for value in values])
        is_exact = [
            not np.isfinite(double) or Fraction(double) == value for double, value in zip(nearest, values, strict=True)
        ]
        return np.where(is_exact, nearest, _outward(nearest, nearest))

    def sums(self, terms: Vector, starts: Indices) -> Vector:
        sizes = np.diff(np.append(starts, terms.shape[-1]))
        lower, upper = np.add.reduceat(terms, starts, axis=-1)
        error = sizes * EPS * np.add.reduceat(np.abs(terms), starts, axis=-1)
        return _outward(lower - error[0], upper + error[1])
