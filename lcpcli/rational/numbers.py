"""Rational numbers: conversion from and to text and floating-point numbers, and exact
sums of floating-point numbers.

Text is converted by `decimal`, which unlike int and str has no limit on digits, and in
which an exponent costs nothing until it is expanded, so that too large ones can be
rejected first. To read a text with exact numbers through code that handles floats, it
is read twice: first with the nearest floats, then with a different float for each
number of the text (`Doubles`). Whatever moves these floats or changes their signs then
applies to the exact numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal, InvalidOperation
from fractions import Fraction
from typing import Any, Generic, TypeVar

import numpy as np

from lcpcli.errors import GIVE_FINITE, GIVE_NUMBER, ProblemError, quoted
from lcpcli.interrupts import in_time, raise_if_timed_out
from lcpcli.linalg.doubles import LARGEST_DOUBLE, SMALLEST_NORMAL, WIDEST
from lcpcli.typing import Mask, Vector

# Every integer up to this is exactly representable in double precision.
LARGEST_INTEGER = 2**53
# The largest decimal exponent that is expanded: arithmetic with longer integers is
# slow.
LARGEST_EXPONENT = 5000
MAX_SHOWN_DIGITS = 25  # digits of a fraction in a line of text
SCALE = "scale the data"
KEEP_DIGITS = f"{SCALE}; lcp solve --exact keeps all digits"
MANTISSA = 53  # binary digits of a double precision number
SUBNORMAL = 1074  # the smallest positive double precision number is 2^-1074
RATIO = re.compile(r"[-+]?[0-9]+/[0-9]+")
# A number as users write it where a format has texts: a decimal, a ratio, infinity.
NUMBER = re.compile(
    r"\s*[-+]?(?:(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
    r"|[0-9]+/0*[1-9][0-9]*|(?i:inf(?:inity)?))\s*"
)
# Every decimal of up to 15 digits is the shortest decimal of its nearest float.
SURE_DIGITS = 15
LARGEST_POWER = 22  # 10^22 is the largest power of ten that is exact as a float
FEW_NUMBERS = 1000  # the numbers of a matrix that are examined first

T = TypeVar("T")


def fraction(text: str) -> Fraction:
    """Return the rational number of a decimal text; raise ProblemError if it is no
    number, is not finite, or has too large an exponent.
    """
    raise_if_timed_out()
    try:
        if "_" in text:
            raise InvalidOperation
        value = Decimal(text.strip())
    except InvalidOperation:
        raise ProblemError(
            "", f"has {quoted(text)}, not a number", GIVE_NUMBER
        ) from None
    if not value.is_finite():
        raise ProblemError("", f"has {quoted(text)}, which is not finite", GIVE_FINITE)
    if not value:
        return Fraction(0)
    if abs(value.adjusted()) > LARGEST_EXPONENT + len(text):
        hint = f"keep exponents between -{LARGEST_EXPONENT} and {LARGEST_EXPONENT}"
        raise ProblemError("", f"has the number {quoted(text)}", hint)
    return Fraction(value)


def ratio(text: str) -> Fraction:
    """Return the rational number of a decimal text, or of two integers with a slash
    between them.
    """
    if "/" not in text:
        return fraction(text)
    numerator, _, denominator = text.strip().partition("/")
    if not RATIO.fullmatch(text.strip()) or not denominator.strip("0"):
        raise ProblemError(
            "", f"has {quoted(text)}, not a fraction", "give integers, as in 15/29"
        )
    return Fraction(int(Decimal(numerator)), int(Decimal(denominator)))


def double(text: str) -> float:
    """Return the double precision number nearest to the number of a text, of the form
    `NUMBER`.
    """
    return _rounded(ratio(text)) if "/" in text else float(text)


def double_unless_lost(text: str, hint: str) -> float:
    """Return `double` of a text; raise ProblemError, with this hint, if it is 0 and the
    number is not."""
    value = double(text)
    if value:
        return value
    # Not by its value, as an exponent may be beyond what Decimal takes.
    digits = re.split("[eE/]", text)[0]
    if any(digit in digits for digit in "123456789"):
        reason = f"has {quoted(text)}, which is 0 in double precision"
        try:
            ratio(text)
        except ProblemError:  # exact arithmetic does not take it either
            hint = SCALE
        raise ProblemError("", reason, hint)
    return value


def text(value: Fraction) -> str:
    """Return a rational number with all its digits, in the form that `ratio` reads."""
    numerator = str(Decimal(value.numerator))
    return (
        numerator
        if value.denominator == 1
        else f"{numerator}/{Decimal(value.denominator)}"
    )


def places(value: Fraction) -> int | None:
    """Return the number of decimals of a rational number; None if there are infinitely
    many."""
    twos = (value.denominator & -value.denominator).bit_length() - 1
    rest, fives = _without_fives(value.denominator >> twos)
    return max(twos, fives) if rest == 1 else None


def _without_fives(n: int) -> tuple[int, int]:
    """Return a positive integer without its factors 5, and their number."""
    if n % 5:
        return n, 0
    # 5 to the power of 1, 2, 4, ..., as one factor after another takes quadratic time.
    powers = [5]
    while 2 * powers[-1].bit_length() <= n.bit_length() + 1:
        powers.append(powers[-1] ** 2)
    fives = 0
    for k in reversed(range(len(powers))):
        quotient, remainder = divmod(n, powers[k])
        if not remainder:
            n, fives = quotient, fives + 2**k
    return n, fives


def decimal(value: Fraction) -> str:
    """Return a rational number with all its decimals, or raise ProblemError if it has
    infinitely many."""
    count = places(value)
    if count is None:
        raise ProblemError(
            "",
            f"has {text(value)}, which is not a decimal",
            "write it where fractions are read",
        )
    digits = Decimal(value.numerator * 10**count // value.denominator).as_tuple()
    return str(Decimal((digits.sign, digits.digits, -count)))


def in_decimals(value: Fraction) -> str:
    """Return a rational number with all its decimals if there are finitely many,
    otherwise the shortest decimal of the nearest float.
    """
    return decimal(value) if places(value) is not None else repr(_rounded(value))


def brief(value: Fraction, toward: int = 0) -> str:
    """Return a rational number for a line of text; one with more than MAX_SHOWN_DIGITS
    is shortened by `approximate` and marked by ~.
    """
    length = value.numerator.bit_length() + value.denominator.bit_length()
    return (
        text(value)
        if length * math.log10(2) <= MAX_SHOWN_DIGITS
        else f"~{approximate(value, toward)}"
    )


def approximate(value: Fraction, toward: int = 0, digits: int = 7) -> str:
    """Return a few digits of a rational number, which may be beyond the range of double
    precision. It is rounded upward if `toward` is 1 and downward if it is -1, so that a
    bound remains one; otherwise to the nearest.
    """
    if toward:
        context = Context(digits, ROUND_CEILING if toward > 0 else ROUND_FLOOR)
        value = Fraction(
            context.divide(Decimal(value.numerator), Decimal(value.denominator))
        )
    double = _rounded(value)
    if not value or SMALLEST_NORMAL <= abs(double) < math.inf:
        return f"{double:.{digits}g}"
    quotient = Decimal(value.numerator) / Decimal(value.denominator)
    return f"{quotient.normalize():.{digits}g}"


def zeros(n: int) -> list[Fraction]:
    """Return n rational zeros."""
    return [Fraction(0)] * n


def rounded(values: Iterable[Fraction | int]) -> Vector:
    """Return the nearest floats; infinities beyond their range."""
    return np.array([_rounded(value) for value in values])


def rounded_direction(values: Sequence[Fraction | int]) -> Vector:
    """Return a positive multiple of numbers in finite floats: the numbers themselves if
    they are integers that floats represent exactly, otherwise divided by the largest
    and rounded, or by less if the smallest would underflow.
    """
    sizes = [abs(Fraction(value)) for value in values if value] or [Fraction(1)]
    unit = max(sizes)
    if unit <= LARGEST_INTEGER and all(value.denominator == 1 for value in values):
        return rounded(values)
    highest, lowest = (
        size.numerator.bit_length() - size.denominator.bit_length()
        for size in (unit, min(sizes))
    )
    if highest - lowest > WIDEST:
        unit = Fraction(2) ** max((highest + lowest) // 2, highest - WIDEST)
    return rounded(Fraction(value) / unit for value in values)


def _rounded(value: Fraction | int) -> float:
    """Return the nearest float, infinite if the number overflows."""
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def rounded_sum(a: Vector, y: Vector, constant: float) -> float:
    """Return a'y + constant for finite floats, a and y of shape (n,), rounded once:
    infinite if it overflows, and away from 0 if it is subnormal, so that only 0 becomes
    0.
    """
    whole, power = in_integers(np.append(y, 1.0))
    exact = Fraction(2) ** power * product(np.append(a, constant), whole)
    value = _rounded(exact)
    if abs(value) >= SMALLEST_NORMAL:
        return value
    return math.copysign(
        math.ldexp(math.ceil(abs(exact) * 2**SUBNORMAL), -SUBNORMAL),
        1 if exact > 0 else -1,
    )


def product(a: Vector, y: Sequence[Fraction | int]) -> Fraction:
    """Return a'y for finite floats a and rational y, both of length n; fastest for
    integers y."""
    A, power = in_integers(a)
    return Fraction(2) ** power * Fraction(dot(A, y))


def integers(A: Vector) -> list[list[int]]:
    """Return the rows of A, floats of shape (m, n), multiplied by the power of two that
    makes all of them integers.
    """
    whole, _ = in_integers(A.ravel())
    return [whole[top : top + A.shape[1]] for top in range(0, len(whole), A.shape[1])]


def row_integers(A: Vector) -> tuple[list[list[int]], list[int]]:
    """Return integers V and exponents e with A_ij = V_ij 2^e_i, for finite floats of
    shape (m, n)."""
    fraction, exponent = np.frexp(A)
    whole, powers = np.ldexp(fraction, MANTISSA).astype(np.int64), exponent - MANTISSA
    min_powers = powers.min(axis=1, where=whole != 0, initial=0)
    rows = zip(
        whole.tolist(),
        np.maximum(powers - min_powers[:, np.newaxis], 0).tolist(),
        strict=True,
    )
    return [
        [value << shift for value, shift in zip(*row, strict=True)] for row in rows
    ], min_powers.tolist()


def in_integers(values: Vector) -> tuple[list[int], int]:
    """Return integers V and an exponent e with values = V 2^e, for finite floats of
    shape (n,).
    """
    (row,), (exponent,) = row_integers(values[np.newaxis])
    return row, exponent


def over_one_denominator(values: Sequence[Fraction]) -> tuple[list[int], int]:
    """Return integers V and d > 0 with values = V / d."""
    d = math.lcm(*(value.denominator for value in values))
    return [value.numerator * (d // value.denominator) for value in values], d


def whole_multiple(values: Sequence[Fraction]) -> list[int]:
    """Return the smallest integers that are a positive multiple of these numbers."""
    return primitive(over_one_denominator(values)[0])


def primitive(values: Sequence[int]) -> list[int]:
    """Return integers divided by their greatest common divisor."""
    common = math.gcd(*values)
    return [int(value) // common for value in values] if common else list(values)


def dot(a: Sequence[int], b: Sequence[Any]) -> Any:
    """Return a'b, skipping products with 0."""
    return sum(i * j for i, j in zip(a, b, strict=True) if i and j)


def shortest_decimal(value: float) -> Fraction:
    """Return the shortest decimal whose nearest float is this value."""
    return Fraction(repr(value))


@np.errstate(all="ignore")
def are_rounded(values: Vector) -> Mask:
    """Return which finite floats are rounded numbers, as computed ones are: those that
    are no integers, and whose shortest decimal has SURE_DIGITS digits or more.

    A quotient m / 10^k of an integer m up to 2^53 and an exactly represented power of
    ten is rounded once: it equals the value if and only if m / 10^k is a decimal of it.
    """
    sizes = np.abs(values)
    power = SURE_DIGITS - 2 - np.floor(np.log10(sizes))
    # A logarithm just below an integer may be rounded to it.
    power -= np.rint(sizes * 10.0**power) >= 10.0 ** (SURE_DIGITS - 1)
    whole = np.rint(sizes * 10.0**power)
    above, below = 10.0 ** np.maximum(power, 0.0), 10.0 ** np.maximum(-power, 0.0)
    mask = (whole / above * below != sizes) & (sizes != np.rint(sizes))
    far = np.flatnonzero((np.abs(power) > LARGEST_POWER) & (sizes != 0))
    for i in far.tolist():
        digits = Decimal(repr(float(sizes.flat[i]))).normalize().as_tuple().digits
        is_whole = sizes.flat[i] == np.rint(sizes.flat[i])
        mask.flat[i] = len(digits) >= SURE_DIGITS and not is_whole
    return np.asarray(mask)


@np.errstate(all="ignore")
def as_written(values: Vector) -> tuple[Vector, float]:
    """Return the shortest decimals of finite floats multiplied by the smallest power of
    ten that makes all of them integers, and this power; the floats, and 1, if some of
    them are rounded numbers, or such integers are too large.
    """
    # The first numbers show most computed matrices to be rounded.
    first_values = values.ravel()[:FEW_NUMBERS]
    if are_rounded(first_values).any() or are_rounded(values).any():
        return values, 1.0
    for power in range(LARGEST_POWER + 1):
        whole = np.rint(values * 10.0**power)
        if np.abs(whole).max(initial=0.0) > LARGEST_INTEGER:
            break
        if np.array_equal(whole / 10.0**power, values):
            return (np.asarray(whole), 10.0**power) if power else (values, 1.0)
    return values, 1.0


@dataclass(frozen=True)
class Written(Generic[T]):
    """The content of a text. rounded : with the nearest floats. distinct : with a
    different float for each number.

    exact : the exact numbers of the floats of `distinct` that are not their shortest
        decimals.
    """

    rounded: T
    distinct: T
    exact: Mapping[float, Fraction]

    def number(self, double: float) -> Fraction:
        """Return the number that a float of `distinct` represents."""
        return self.exact[double] if double in self.exact else shortest_decimal(double)


class Doubles:
    """The floats for the numbers of a text that is read twice: first the nearest ones,
    then a different one for each number.
    """

    def __init__(self) -> None:
        # The absolute values of floats whose shortest decimals are the numbers.
        self._sizes: set[float] = set()
        # The absolute values of all other numbers.
        self._others: set[Fraction] = set()
        # The float of each absolute value; None during the first reading.
        self._distinct_doubles: dict[Fraction, float] | None = None

    def __call__(self, text: str) -> float:
        """Return the float for a text of the form `NUMBER`; infinities and NaN remain
        unchanged. May raise TimeIsUp.
        """
        raise_if_timed_out()
        if "/" in text:
            return self.of(ratio(text))
        double = float(text)
        is_short = len(text) <= SURE_DIGITS and "e" not in text.casefold()
        return self._of(
            None if is_short or repr(double) == text else fraction(text), double
        )

    def of(self, value: Fraction | float) -> float:
        """Return the float that represents a number; infinities and NaN remain
        unchanged.
        """
        if isinstance(value, float):
            return value
        return self._of(value, float(rounded([value])[0]))

    def _of(self, value: Fraction | None, nearest: float) -> float:
        """Return the float that represents a number; None means the shortest decimal of
        the nearest float.
        """
        if not math.isfinite(nearest):
            return nearest
        if self._distinct_doubles is not None:
            return math.copysign(
                self._distinct_doubles[
                    abs(shortest_decimal(nearest) if value is None else value)
                ],
                nearest,
            )
        if value is None or shortest_decimal(nearest) == value:
            self._sizes.add(abs(nearest))
        else:
            self._others.add(abs(value))
        return nearest

    def assign_distinct(self) -> Mapping[float, Fraction] | None:
        """Return the exact numbers that floats represent in the second reading; None if
        the nearest floats already differ.
        """
        if not self._others:
            return None
        numbers = {*self._others, *map(shortest_decimal, in_time(self._sizes))}
        # Comparing floats first takes less time than comparing fractions.
        sizes = sorted(in_time(numbers), key=lambda number: (_rounded(number), number))
        self._distinct_doubles = dict(zip(sizes, _distinct_doubles(sizes), strict=True))
        exact_pairs = [
            (double, size)
            for size, double in self._distinct_doubles.items()
            if shortest_decimal(double) != size
        ]
        return dict(exact_pairs) | {-double: -size for double, size in exact_pairs}


def _distinct_doubles(sizes: list[Fraction]) -> list[float]:
    """Return distinct floats for these increasing numbers, in the same order; integers,
    which may be indices, remain exact.
    """
    doubles: list[float] = []
    for size in in_time(sizes):
        nearest = float(size)
        is_exact_integer = size.denominator == 1 and size <= LARGEST_INTEGER
        above = math.nextafter(doubles[-1] if doubles else 0.0, math.inf)
        doubles.append(
            nearest if is_exact_integer else min(max(nearest, above), LARGEST_DOUBLE)
        )
        i = len(doubles) - 1
        while i and doubles[i - 1] >= doubles[i]:
            doubles[i - 1] = math.nextafter(doubles[i], 0.0)
            i -= 1
    return doubles


def written(parse: Callable[[Doubles], T]) -> Written[T]:
    """Return the results of `parse` for both readings of a text; its argument is the
    function that converts numbers.
    """
    doubles = Doubles()
    nearest = parse(doubles)
    exact = doubles.assign_distinct()
    return (
        Written(nearest, nearest, {})
        if exact is None
        else Written(nearest, parse(doubles), exact)
    )
