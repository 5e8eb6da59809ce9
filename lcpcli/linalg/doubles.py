"""Constants of double precision, the common bound on the rounding error in a row of w,
the sizes of vectors, and what numpy may load further modules for."""

from __future__ import annotations

import math
from collections import abc
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import numpy as np

from lcpcli.clock import imports
from lcpcli.typing import Indices, Vector

if TYPE_CHECKING:
    from numpy.random import Generator

Item = TypeVar("Item")
End = TypeVar("End")
Steps: TypeAlias = Callable[..., abc.Generator[Item, None, End]]

EPS = float(np.finfo(np.float64).eps)  # from 1 to the next number
# Bounds the error of an underflow.
SMALLEST_NORMAL = float(np.finfo(np.float64).smallest_normal)
LARGEST_DOUBLE = float(np.finfo(np.float64).max)
# What counts as rounding, in this file alone:
# Relative to the terms of a row: a bound on the rounding error in w = M z + q.
ROW_ROUNDING = 8 * EPS
# Relative to a number, or to the terms of a row: what rounding of z, and of w, may
# leave of it.
ROUNDING = 4 * EPS
# Relative to the largest number of its kind: what rounding may have made of 0.
SMALL_DISTANCE = 1e-13
ROUNDED_ZERO = 1e-14  # the same of components that exact arithmetic may decide
# Relative to the terms of a row, or the largest z_j: no violation where exact
# arithmetic looks.
SIGN_ROUNDING = 1e-12
# Binary digits by which doubles may differ and be of full precision, if the largest is
# near 1.
WIDEST = 1020
# Beyond it, or below its inverse, products of a few numbers may over- or underflow.
FAR_FROM_ONE = 2.0**200
MAX_COPIED_ENTRIES = 10_000  # up to which a copy costs less than a second reduction
# Up to which Python's own loop is faster than a reduction by numpy.
MAX_LOOPED_ENTRIES = 32


def largest(v: Vector) -> float:
    """Return the largest |v_i| of a vector, without warnings; 0 if it is empty, NaN or
    infinity if an entry is NaN."""
    if v.size > MAX_LOOPED_ENTRIES:
        return (
            float(np.abs(v).max())
            if v.size <= MAX_COPIED_ENTRIES
            else float(np.maximum(v.max(), -v.min()))
        )
    values = v.tolist()
    return (
        max(map(abs, values), default=0.0)
        if math.isfinite(sum(values))
        else float(np.abs(v).max(initial=0.0))
    )


def size(v: Vector) -> float:
    """Return the largest |v_i|, infinite if an entry is NaN."""
    value = largest(v)
    return value if value < math.inf else math.inf


def is_finite(v: Vector) -> bool:
    return largest(v) < math.inf


def least(v: Vector) -> float:
    """Return the smallest entry, infinite if there is none, NaN if any entry is NaN."""
    if v.size > MAX_LOOPED_ENTRIES:
        return float(v.min())
    values = v.tolist()
    return (
        min(values, default=math.inf) if math.isfinite(sum(values)) else float(v.min())
    )


def are_moderate(values: Vector) -> bool:
    """Return whether every nonzero |value| lies between 1 / FAR_FROM_ONE and
    FAR_FROM_ONE."""
    smallest, largest = sizes(values)
    return largest <= FAR_FROM_ONE and smallest >= 1 / FAR_FROM_ONE


def sizes(values: Vector) -> tuple[float, float]:
    """Return the least nonzero |value|, infinite if there is none, and the largest, NaN
    or infinity if an entry is."""
    if values.size <= 2 * MAX_LOOPED_ENTRIES:  # in place of two reductions
        nonzero_sizes = list(map(abs, filter(None, values.ravel().tolist())))
        if not nonzero_sizes:
            return math.inf, 0.0
        if math.isfinite(sum(nonzero_sizes)):
            return min(nonzero_sizes), max(nonzero_sizes)
    positive = np.abs(values)
    smallest = float(positive.min())
    if not smallest > 0:
        smallest = float(positive.min(where=positive > 0, initial=math.inf))
    return smallest, float(positive.max())


def row_sizes(values: Vector) -> tuple[Vector, Vector]:
    """Return `sizes` of each row of an array of shape (m, n)."""
    positive = np.abs(values)
    return positive.min(axis=1, where=positive > 0, initial=math.inf), positive.max(
        axis=1, initial=0.0
    )


def each_step(**faults: Any) -> Callable[[Steps[Item, End]], Steps[Item, End]]:
    """Return a decorator of generator functions under which each step has numpy's
    `errstate(**faults)`, whatever the caller's is; as a decorator of these, `errstate`
    itself ends before the first step."""

    def decorated(function: Steps[Item, End]) -> Steps[Item, End]:
        @wraps(function)
        def stepping(
            *arguments: Any, **keywords: Any
        ) -> abc.Generator[Item, None, End]:
            steps = function(*arguments, **keywords)
            while True:
                with np.errstate(**faults):
                    try:
                        item = next(steps)
                    except StopIteration as stop:
                        return cast(End, stop.value)
                yield item

        return stepping

    return decorated


def generator(seed: int) -> Generator:
    """Return numpy's generator of random numbers from a seed, which some versions of
    numpy have to load first."""
    with imports:
        from numpy.random import default_rng
    return default_rng(seed)


def generic(n: int) -> Vector:
    """Return numbers of either sign that look random, with sizes between 1/2 and 3/2,
    shape (n,): no sum of a few of them with whole coefficients is nearly 0."""
    waves = np.sin((np.arange(n) + 1.0) ** 2 * 1.234)
    return np.asarray(np.sign(waves) * (1.0 + 0.5 * np.cos(np.arange(n) * 2.718 + 0.3)))


def distinct(indices: Indices) -> Indices:
    """Return the different indices in increasing order; np.unique would load the masked
    arrays of numpy."""
    ordered = np.sort(indices)
    different: Indices = ordered[
        np.append(True, ordered[1:] != ordered[:-1])[: ordered.size]
    ]
    return different


def in_range(y: Vector, R: Vector | float = 1.0) -> Vector:
    """Return R y times the power of two that puts its largest entry between 1 and 2, or
    its entries in the middle of the range of doubles, if the least would be lost."""
    mantissas, powers = np.frexp(y)
    factors, R_powers = np.frexp(R)
    mantissas, carried = np.frexp(mantissas * factors)
    powers = powers + R_powers + carried
    used = powers[mantissas != 0]
    if not used.size:
        return y
    highest, lowest = int(used.max()), int(used.min())
    middle = (
        highest - 1
        if highest - lowest < WIDEST
        else max((highest + lowest) // 2, highest - WIDEST)
    )
    with np.errstate(all="ignore"):
        return np.asarray(np.ldexp(mantissas, powers - middle) + 0.0)
