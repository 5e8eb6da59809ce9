"""Rational numbers: from text and back, from doubles and back, and exact sums of
doubles.

Text passes through `decimal`, which unlike int and str has no limit on digits, and
where an exponent costs nothing until it is expanded, so that it can be rejected first.
Doubles that were read from text can each stand for only one number of the text
(`Doubles`): what is made of them by moving them or changing signs then applies to these
numbers.
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

# Up to here every integer is exactly representable in double precision.
LARGEST_INTEGER = 2**53
# The largest decimal exponent that is expanded: integers of more digits slow everything
# down.
LARGEST_EXPONENT = 5000
MAX_SHOWN_DIGITS = 25  # of a fraction in a line of text
KEEP_DIGITS = "scale the data; lcp solve --exact keeps all digits"
MANTISSA = 53  # binary digits of a double
SUBNORMAL = 1074  # the smallest positive double is 2 to the minus this
RATIO = re.compile(r"[-+]?[0-9]+/[0-9]+")
# A number as users write it where a format has texts: a decimal, a ratio, infinity.
NUMBER = re.compile(
    r"\s*[-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
    r"|[0-9]+/0*[1-9][0-9]*|(?i:inf(?:inity)?))\s*"
)
# What a text has if a number in it may be 0 in double precision without being 0: an
# exponent of three digits, many zeros, or a long denominator.
MAY_UNDERFLOW = re.compile(rb"[eE]-0*[1-9][0-9]{2}|[.,]0{200}|/[0-9]{200}")
SURE_DIGITS = 15  # decimal ones that every double has
LARGEST_POWER = 22  # of ten that a double represents
FEW_NUMBERS = 1000  # of a matrix that are looked at first

T = TypeVar("T")


def fraction(text: str) -> Fraction:
    """Return the rational number of a decimal text; raise ProblemError if it has none,
    or too large an exponent."""
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
    """Return the rational number that a decimal text, or two integers with a slash
    between them, stand for."""
    if "/" not in text:
        return fraction(text)
    numerator, _, denominator = text.strip().partition("/")
    if not RATIO.fullmatch(text.strip()) or not denominator.strip("0"):
        raise ProblemError(
            "", f"has {quoted(text)}, not a fraction", "give whole numbers, as in 15/29"
        )
    return Fraction(int(Decimal(numerator)), int(Decimal(denominator)))


def double(text: str) -> float:
    """Return the double nearest to the number in a text, as `NUMBER` has them."""
    return _rounded(ratio(text)) if "/" in text else float(text)


def double_unless_lost(text: str) -> float:
    """Return `double` of a text; raise ProblemError if it is 0 and the number is
    not."""
    value = double(text)
    if not value and (ratio(text) if "/" in text else Decimal(text)):
        raise ProblemError(
            "", f"has {quoted(text)}, which is 0 in double precision", KEEP_DIGITS
        )
    return value


def text(value: Fraction) -> str:
    """Return a rational number with all its digits, as `ratio` reads it."""
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
    rest, fives = value.denominator >> twos, 0
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    return max(twos, fives) if rest == 1 else None


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
    """Return a rational number with all its decimals if it has finitely many, else
    those of the nearest double."""
    return decimal(value) if places(value) is not None else repr(_rounded(value))


def brief(value: Fraction, toward: int = 0) -> str:
    """Return a rational number for a line of text, of more than MAX_SHOWN_DIGITS by
    `approximate`, marked by ~."""
    length = value.numerator.bit_length() + value.denominator.bit_length()
    return (
        text(value)
        if length * math.log10(2) <= MAX_SHOWN_DIGITS
        else f"~{approximate(value, toward)}"
    )


def approximate(value: Fraction, toward: int = 0, digits: int = 7) -> str:
    """Return a few digits of a rational number, which may be beyond the range of
    doubles, rounded upward if `toward` is 1, downward if it is -1, so that a bound
    remains one, and else to the nearest."""
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


def rounded(values: Iterable[Fraction | int]) -> Vector:
    """Return the nearest doubles; infinities beyond their range."""
    return np.array([_rounded(value) for value in values])


def rounded_direction(values: Sequence[Fraction | int]) -> Vector:
    """Return a positive multiple of numbers in finite doubles: the numbers themselves
    if they are integers that doubles represent, else divided by the largest and
    rounded, or by less if the least would be lost."""
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
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def rounded_sum(a: Vector, y: Vector, constant: float) -> float:
    """Return a'y + constant for finite floats, a and y of shape (n,), rounded once,
    infinite beyond the largest number, and away from 0 if it is subnormal, so that only
    0 becomes 0."""
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
    """Return the rows of A, floats of shape (m, n), times the one power of two that
    makes them integers."""
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
    shape (n,)."""
    (row,), (exponent,) = row_integers(values[np.newaxis])
    return row, exponent


def over_one_denominator(values: Sequence[Fraction]) -> tuple[list[int], int]:
    """Return integers V and d > 0 with values = V / d."""
    d = math.lcm(*(value.denominator for value in values))
    return [value.numerator * (d // value.denominator) for value in values], d


def whole_multiple(values: Sequence[Fraction]) -> list[int]:
    """Return the smallest integers that are a positive multiple of some numbers."""
    return primitive(over_one_denominator(values)[0])


def primitive(values: Sequence[int]) -> list[int]:
    """Return integers divided by their greatest common divisor."""
    common = math.gcd(*values)
    return [int(value) // common for value in values] if common else list(values)


def dot(a: Sequence[int], b: Sequence[Any]) -> Any:
    return sum(i * j for i, j in zip(a, b, strict=True) if i and j)


def shortest_decimal(value: float) -> Fraction:
    """Return the shortest decimal whose nearest double is the value."""
    return Fraction(repr(value))


@np.errstate(all="ignore")
def are_rounded(values: Vector) -> Mask:
    """Return which finite doubles stand for rounded numbers, as computed ones do: those
    that are not whole, and whose shortest decimal has SURE_DIGITS digits or more.

    A quotient m / 10^k of a whole m up to 2^53 and a power that doubles represent is
    rounded once: it is the value if and only if m / 10^k is a decimal of it.
    """
    sizes = np.abs(values)
    power = SURE_DIGITS - 2 - np.floor(np.log10(sizes))
    # A logarithm just below a whole number may be rounded to it.
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
    """Return the shortest decimals of finite doubles times the least power of ten with
    which all are whole, and this power; the doubles, and 1, if some are rounded, or
    doubles do not represent all of these."""
    first_values = values.ravel()[:FEW_NUMBERS]  # which tell most computed numbers
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
    """The content of a text. rounded : with the nearest doubles. distinct : with a
    different double for each number.
    exact : the numbers for which doubles of `distinct` stand, where these are not their
        shortest decimals."""

    rounded: T
    distinct: T
    exact: Mapping[float, Fraction]

    def number(self, double: float) -> Fraction:
        """Return the number for which a double of `distinct` stands."""
        return self.exact[double] if double in self.exact else shortest_decimal(double)


class Doubles:
    """The doubles for the numbers in a text that is read twice: at first the nearest,
    then a different one for each."""

    def __init__(self) -> None:
        # Of those that are the shortest decimals of their doubles.
        self._sizes: set[float] = set()
        self._others: set[Fraction] = set()
        # The doubles of all sizes; None when read at first.
        self._distinct_doubles: dict[Fraction, float] | None = None

    def __call__(self, text: str) -> float:
        """Return the double for a text, as `NUMBER` has them; infinities and NaN remain
        unchanged. May raise TimeIsUp."""
        raise_if_timed_out()
        if "/" in text:
            return self.of(ratio(text))
        double = float(text)
        is_short = len(text) <= SURE_DIGITS and "e" not in text.casefold()
        return self._of(
            None if is_short or repr(double) == text else fraction(text), double
        )

    def of(self, value: Fraction | float) -> float:
        """Return the double that stands for a number; infinities and NaN remain
        unchanged."""
        if isinstance(value, float):
            return value
        return self._of(value, float(rounded([value])[0]))

    def _of(self, value: Fraction | None, nearest: float) -> float:
        """Return the double that stands for a number; None means the shortest decimal
        of the nearest double."""
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
        """Return the numbers that the doubles stand for from now on; None if the
        nearest ones already differ."""
        if not self._others:
            return None
        numbers = {*self._others, *map(shortest_decimal, in_time(self._sizes))}
        # Doubles compare faster.
        sizes = sorted(in_time(numbers), key=lambda number: (_rounded(number), number))
        self._distinct_doubles = dict(zip(sizes, _distinct_doubles(sizes), strict=True))
        exact_pairs = [
            (double, size)
            for size, double in self._distinct_doubles.items()
            if shortest_decimal(double) != size
        ]
        return dict(exact_pairs) | {-double: -size for double, size in exact_pairs}


def _distinct_doubles(sizes: list[Fraction]) -> list[float]:
    """Return distinct doubles for these numbers, in the same order; integers, which may
    be indices, are kept."""
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
    """Return what `parse` makes of a text, given the function that makes doubles of its
    numbers."""
    doubles = Doubles()
    nearest = parse(doubles)
    exact = doubles.assign_distinct()
    return (
        Written(nearest, nearest, {})
        if exact is None
        else Written(nearest, parse(doubles), exact)
    )
