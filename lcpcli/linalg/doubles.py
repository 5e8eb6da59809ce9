"""Constants of double precision arithmetic, among them the bounds on rounding errors in
w = M z + q; norms, ranges and scaling of vectors by powers of two; and the parts of
numpy that load further modules.
"""

from __future__ import annotations

import math
from collections import abc
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import numpy as np

from lcpcli.clock import imports
from lcpcli.typing import Indices, Mask, Vector

if TYPE_CHECKING:
    from numpy.random import Generator

Item = TypeVar("Item")
End = TypeVar("End")
Steps: TypeAlias = Callable[..., abc.Generator[Item, None, End]]

EPS = float(np.finfo(np.float64).eps)  # the distance from 1 to the next number
# An underflow causes an error below this.
SMALLEST_NORMAL = float(np.finfo(np.float64).smallest_normal)
LARGEST_DOUBLE = float(np.finfo(np.float64).max)
# All tolerances that represent rounding errors are defined here:
# The rounding error in a row of w = M z + q is assumed to be at most this times |q_i| +
# |M_i| |z|, however long the row is, as the errors of its terms largely cancel.
ROW_ROUNDING = 8 * EPS
# The solution of a linear system has errors of the size of its condition number times
# EPS; this is what they are assumed to be for systems of contacts, relative to the
# largest impulse, and to the terms of the rows.
SYSTEM_ROUNDING = 1e-12
# A number of this size relative to z_j, or to |q_i| + |M_i| |z|, may be the result of
# rounding z and w in what is exactly 0.
ROUNDING = 4 * EPS
# A number of this size relative to the largest one of its kind may be the result of
# rounding where it is exactly 0.
SMALL_DISTANCE = 1e-13
ROUNDED_ZERO = 1e-14  # the same for components that exact arithmetic checks afterwards
# A violation of this size relative to |q_i| + |M_i| |z|, or to the largest z_j, is
# treated as rounding where exact arithmetic checks the result.
SIGN_ROUNDING = 1e-12
# Ratio, as an exponent of 2, up to which numbers are normal if the largest is about 1.
WIDEST = 1020
# Products of up to five numbers between the inverse of this and this are finite and
# normal.
FAR_FROM_ONE = 2.0**200
# Entries up to which copying |v| costs less than two reductions of v.
MAX_COPIED_ENTRIES = 10_000
# Entries up to which a loop in Python takes less time than a reduction by numpy.
MAX_LOOPED_ENTRIES = 32


def largest(v: Vector) -> float:
    """Return the largest |v_i| of a vector, without warnings; 0 if v is empty, and NaN
    or infinity if v has such an entry.
    """
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
    """Return whether all entries are finite."""
    return largest(v) < math.inf


def least(v: Vector) -> float:
    """Return the smallest entry of a vector; infinity if v is empty, and NaN if an
    entry is NaN.
    """
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
    """Return the smallest nonzero |value| and the largest |value|. The smallest is
    infinite if all are 0; the largest is NaN or infinite if an entry is.
    """
    if values.size <= 2 * MAX_LOOPED_ENTRIES:  # one loop instead of two reductions
        nonzero_sizes = list(map(abs, filter(None, values.ravel().tolist())))
        if not nonzero_sizes:
            return math.inf, 0.0
        if math.isfinite(sum(nonzero_sizes)):
            return min(nonzero_sizes), max(nonzero_sizes)
    positive = np.abs(values)
    smallest = float(positive.min())
    if not smallest > 0:
        smallest = float(np.where(positive > 0, positive, math.inf).min())
    return smallest, float(positive.max())


# Entries of a mask that are counted as bytes: .65 of the time of numpy's function for
# one entry, .8 for 32, and as long for 128.
MAX_COUNTED = 64


def number_of(mask: Mask) -> int:
    """Return how many entries of a mask are true; of a small one faster than numpy's
    function does."""
    if mask.size <= MAX_COUNTED:
        return mask.tobytes().count(1)
    return int(np.count_nonzero(mask))


def row_sizes(values: Vector) -> tuple[Vector, Vector]:
    """Return the two numbers of `sizes` for each row of an array of shape (m, n)."""
    positive = np.abs(values)
    return positive.min(axis=1, where=positive > 0, initial=math.inf), positive.max(
        axis=1, initial=0.0
    )


def each_step(**faults: Any) -> Callable[[Steps[Item, End]], Steps[Item, End]]:
    """Return a decorator of generator functions that runs each step with numpy's
    `errstate(**faults)`, whatever the error state of the caller is. With `errstate`
    itself as the decorator of a generator function, the previous state would be
    restored before the first step.
    """

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
    """Return numpy's random number generator with this seed; some versions of numpy
    load its module only on first use.
    """
    with imports:
        from numpy.random import default_rng
    return default_rng(seed)


def generic(n: int) -> Vector:
    """Return n fixed numbers in generic position, of either sign and with sizes between
    1/2 and 3/2: no sum of a few of them with integer coefficients is close to 0.
    """
    waves = np.sin((np.arange(n) + 1.0) ** 2 * 1.234)
    return np.asarray(np.sign(waves) * (1.0 + 0.5 * np.cos(np.arange(n) * 2.718 + 0.3)))


def distinct(indices: Indices) -> Indices:
    """Return the distinct indices in increasing order, as np.unique does, which would
    load numpy's masked arrays.
    """
    ordered = np.sort(indices)
    different: Indices = ordered[
        np.append(True, ordered[1:] != ordered[:-1])[: ordered.size]
    ]
    return different


def in_range(y: Vector, R: Vector | float = 1.0) -> Vector:
    """Return R y times a power of two: the one that makes its largest absolute value
    lie between 1 and 2, or, if the smallest nonzero one would then underflow, the one
    that centres the exponents in the range of double precision.
    """
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
