"""Validation of bounds: infinity means no bound; no lower one exceeds the upper one, or a ProblemError says where."""

from __future__ import annotations

import math
from numbers import Rational
from typing import Any

import numpy as np

from lcpcli.errors import ProblemError, count, kind
from lcpcli.model.arrays import (
    FROM_0,
    NUMBERS,
    as_floats,
    flat,
    is_number_in_array,
    own,
    plain,
    refuse_other_than_numbers,
)
from lcpcli.options import INFINITY
from lcpcli.typing import Vector


def as_bounds(lower: Any, upper: Any, n: int, infinity: float) -> tuple[Vector, Vector] | None:
    """Return l and u, each of shape (n,), or None if they are the bounds 0 and infinity of an LCP; else raise
    ProblemError."""
    low, high = as_intervals(("lower", "upper"), lower, upper, n, infinity=infinity)
    is_orthant = not np.count_nonzero(low) and np.count_nonzero(high == math.inf) == n
    return None if is_orthant else (own(low, lower), own(high, upper))


def has_columns(field: str, bound: Any) -> bool:
    """Return whether a bound has rows and is not an array of a single column, which would count as a vector."""
    given = plain(field, bound, NUMBERS)
    if isinstance(given, (list, tuple)):
        return any(isinstance(row, (list, tuple)) or np.ndim(row) for row in given)
    return np.ndim(given) > 1 and np.shape(given)[1] != 1


def as_intervals(
    fields: tuple[str, str], lower: Any, upper: Any, n: int, of: str = "unknown", infinity: float = math.inf
) -> tuple[Vector, Vector]:
    """Return lower and upper bounds for each of n things of a kind, infinite if absent, or raise ProblemError for their
    fields.

    infinity : a bound of at least this size counts as infinite.
    """
    if infinity == math.inf and _are_plain(lower, n) and _are_plain(upper, n):
        if np.count_nonzero(lower < upper) == n:  # so that neither is infinite on the wrong side
            return lower, upper
        valid = (lower <= upper) & (lower < math.inf) & (upper > -math.inf)
        if np.count_nonzero(valid) == n:
            return lower, upper
    below, above = fields
    ends = as_bound(below, lower, n, of, -math.inf), as_bound(above, upper, n, of, math.inf)
    low, high = (with_infinity(end, infinity) for end in ends)
    for field, end, wrong, fault, none in (
        (below, ends[0], low == math.inf, "is infinite", "-inf"),
        (above, ends[1], high == -math.inf, "is minus infinity", "inf"),
    ):
        if wrong.any():
            i = int(np.argmax(wrong))
            size = "" if math.isinf(end[i]) else f", as it is {end[i]:g} and infinity begins at {infinity:g}"
            raise ProblemError(f"{field}[{i}]", f"{fault}{size}", f"give a number, or {none} for no bound {FROM_0}")
    crossed = low > high
    if crossed.any():
        i = int(np.argmax(crossed))
        fault = f"is {low[i]:g}, above {above}[{i}] = {high[i]:g}"
        raise ProblemError(f"{below}[{i}]", fault, f"make every lower bound at most the upper one {FROM_0}")
    return low, high


def _are_plain(values: Any, n: int) -> bool:
    """Return whether values are an array of n doubles, of which only the sizes remain to be looked at."""
    return type(values) is np.ndarray and values.dtype == np.float64 and values.shape == (n,)


def with_infinity(bound: Vector, infinity: float) -> Vector:
    """Return a bound whose entries of at least the size `infinity` are made infinite."""
    if infinity == math.inf:
        return bound
    INFINITY.check(infinity)
    return np.where(np.abs(bound) >= infinity, np.copysign(np.inf, bound), bound)


def as_bound(field: str, values: Any, n: int, of: str, absent: float) -> Vector:
    """Return a bound of shape (n,) from one number for all or a number for each, possibly infinite; None stands for
    `absent`, no bound."""
    if values is None:
        return np.full(n, absent)
    expected = "a number, or a list of numbers"
    if isinstance(values, (bool, np.bool_, str)):
        raise ProblemError(field, f"is {kind(values)}", f"give {expected}")
    values = values if isinstance(values, (int, float)) else plain(field, values, expected)
    if isinstance(values, (int, float, Rational)) or is_number_in_array(values):
        with np.errstate(over="ignore"):
            values = np.full(n, as_floats(field, [values])[0])
    if isinstance(values, (list, tuple)):
        values = [absent if value is None else value for value in values]
        refuse_other_than_numbers(field, values)
    v = flat(as_floats(field, values, expected))
    if v.ndim != 1:
        raise ProblemError(field, f"has {count(v.ndim, 'dimension')}", "give a number, or a flat list of numbers")
    if v.size != n:
        raise ProblemError(field, f"has {count(v.size, 'entry')} for {count(n, of)}", "make them agree")
    if (wrong := np.flatnonzero(np.isnan(v))).size:
        raise ProblemError(f"{field}[{wrong[0]}]", "is not a number", f"give inf for no bound {FROM_0}")
    return v
