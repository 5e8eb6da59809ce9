"""Exact arithmetic on floats as rational numbers, without intermediate rounding or overflow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from lcpcli.linalg.doubles import SMALLEST_NORMAL
from lcpcli.typing import Vector

MANTISSA = 53
SUBNORMAL = 1074  # the smallest positive number is 2 to the minus this


def sign_of_product(a: Vector, y: Vector) -> int:
    """An integer with the sign of a'y, for finite floats a and y of shape (n,)."""
    used = np.flatnonzero((a != 0) & (y != 0))
    if not used.size:
        return 0
    a_whole, a_power = _whole(a[used])
    y_whole, y_power = _whole(y[used])
    power = a_power + y_power
    shifts: list[int] = (power - power.min()).tolist()
    return sum((i * j) << shift for i, j, shift in zip(a_whole, y_whole, shifts, strict=True))


def rounded_sum(a: Vector, y: Vector, constant: float) -> float:
    """a'y + constant for finite floats, a and y of shape (n,), rounded once; infinite beyond the largest number.

    A subnormal result is rounded away from 0, so that only 0 becomes 0.
    """
    a_whole, a_power = _whole(np.append(a, constant))
    y_whole, y_power = _whole(np.append(y, 1.0))
    powers = (a_power + y_power).tolist()
    least = min(powers)
    total = sum((i * j) << power - least for i, j, power in zip(a_whole, y_whole, powers, strict=True) if i and j)
    exact = Fraction(total << max(least, 0), 1 << max(-least, 0))
    try:
        rounded = float(exact)
    except OverflowError:
        return math.inf if total > 0 else -math.inf
    if abs(rounded) >= SMALLEST_NORMAL:
        return rounded
    return math.copysign(math.ldexp(math.ceil(abs(exact) * 2**SUBNORMAL), -SUBNORMAL), 1 if total > 0 else -1)


def product(a: Vector, y: Sequence[Fraction | int]) -> Fraction:
    """a'y for finite floats a and rational y, both of length n; fastest for integers y."""
    terms = [(*value.as_integer_ratio(), factor) for value, factor in zip(a.tolist(), y, strict=True) if value]
    common = max((power for _, power, _ in terms), default=1)
    total: Fraction | int = sum(whole * (common // power) * factor for whole, power, factor in terms)
    return Fraction(1, common) * total


def sign_of_form(M: Vector, v: Vector) -> int:
    """An integer with the sign of v'Mv, for finite floats M of shape (n, n) and v of shape (n,)."""
    rows = integers(M)
    whole, power = _whole(v)
    used = [i for i, value in enumerate(whole) if value]
    least = min((int(power[i]) for i in used), default=0)
    x = {i: whole[i] << int(power[i]) - least for i in used}
    return sum(x[i] * sum(rows[i][j] * x[j] for j in used if rows[i][j]) for i in used)


def integers(A: Vector) -> list[list[int]]:
    """The rows of A, finite floats of shape (m, n), all multiplied by the one power of two that makes them integers."""
    whole, power = _whole(A.ravel())
    least = int(min((e for i, e in zip(whole, power.tolist(), strict=True) if i), default=0))
    shifted = [i << e - least if i else 0 for i, e in zip(whole, power.tolist(), strict=True)]
    width = A.shape[1]
    return [shifted[top : top + width] for top in range(0, len(shifted), width)]


def row_integers(A: Vector) -> list[list[int]]:
    """The rows of A, finite floats of shape (m, n), each times the power of two that makes its entries integers."""
    return [integers(row[np.newaxis])[0] for row in A]


def over_one_denominator(values: Sequence[Fraction]) -> tuple[list[int], int]:
    """Integers V and d > 0 with values = V / d."""
    d = math.lcm(*(value.denominator for value in values))
    return [value.numerator * (d // value.denominator) for value in values], d


def whole_multiple(values: Sequence[Fraction]) -> list[int]:
    """The smallest integers that are a positive multiple of some numbers."""
    return primitive(over_one_denominator(values)[0])


def primitive(values: Sequence[int]) -> list[int]:
    """Integers divided by what they have in common."""
    common = math.gcd(*values)
    return [int(value) // common for value in values] if common else list(values)


def _whole(values: Vector) -> tuple[list[int], NDArray[np.int64]]:
    """Integers i and exponents e with values = i 2^e, e an integer array."""
    fraction, exponent = np.frexp(values)
    whole: list[int] = np.ldexp(fraction, MANTISSA).astype(np.int64).tolist()
    return whole, exponent.astype(np.int64) - MANTISSA
