"""Rational numbers from text and back, and rounded to doubles.

Text passes through `decimal`, which unlike int and str has no limit on digits, and where an exponent costs nothing
until it is expanded, so that it can be rejected first.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from decimal import Decimal, InvalidOperation
from fractions import Fraction

import numpy as np

from lcpcli.errors import ProblemError, quoted
from lcpcli.interrupts import check
from lcpcli.typing import Vector

LARGEST_INTEGER = 2**53  # up to here every integer is exactly representable in double precision
LARGEST_EXPONENT = 5000  # the largest decimal exponent that is expanded
MOST_DIGITS = 25  # digits of a fraction in a line of text
RATIO = re.compile(r"[-+]?[0-9]+/[0-9]+")


def fraction(text: str) -> Fraction:
    """The rational number of a decimal text; ProblemError if it is not a number, or its exponent is too large. Raises
    TimeIsUp too, as a file may have millions of them."""
    check()
    try:
        if "_" in text:
            raise InvalidOperation
        value = Decimal(text.strip())
    except InvalidOperation:
        raise ProblemError("", f"has {quoted(text)}, not a number", "give a number") from None
    if not value.is_finite():
        raise ProblemError("", f"has {quoted(text)}, which is not finite", "give a finite number")
    if not value:
        return Fraction(0)
    if abs(value.adjusted()) > LARGEST_EXPONENT + len(text):
        raise ProblemError(
            "", f"has the number {quoted(text)}", f"keep exponents between -{LARGEST_EXPONENT} and {LARGEST_EXPONENT}"
        )
    return Fraction(value)


def ratio(text: str) -> Fraction:
    """The rational number of a decimal text, or of two integers with a slash between them."""
    if "/" not in text:
        return fraction(text)
    numerator, _, denominator = text.strip().partition("/")
    if not RATIO.fullmatch(text.strip()) or not denominator.strip("0"):
        raise ProblemError("", f"has {quoted(text)}, not a fraction", "give whole numbers, as in 15/29")
    return Fraction(int(Decimal(numerator)), int(Decimal(denominator)))


def text(value: Fraction) -> str:
    """A rational number with all its digits, as `ratio` reads it."""
    numerator = str(Decimal(value.numerator))
    return numerator if value.denominator == 1 else f"{numerator}/{Decimal(value.denominator)}"


def places(value: Fraction) -> int | None:
    """How many decimals a rational number has; None if it has infinitely many."""
    twos = (value.denominator & -value.denominator).bit_length() - 1
    rest, fives = value.denominator >> twos, 0
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    return max(twos, fives) if rest == 1 else None


def decimal(value: Fraction) -> str:
    """A rational number with all its decimals, or a ProblemError if it has infinitely many."""
    count = places(value)
    if count is None:
        raise ProblemError("", f"has {text(value)}, which is no decimal", "write it where fractions are read")
    digits = Decimal(value.numerator * 10**count // value.denominator).as_tuple()
    return str(Decimal((digits.sign, digits.digits, -count)))


def brief(value: Fraction) -> str:
    """A rational number for a line of text: with more than MOST_DIGITS digits, rounded and marked by ~."""
    length = value.numerator.bit_length() + value.denominator.bit_length()
    return text(value) if length * math.log10(2) <= MOST_DIGITS else f"~{_rounded(value):.7g}"


def rounded(values: Iterable[Fraction]) -> Vector:
    """The nearest doubles; infinities beyond their range."""
    return np.array([_rounded(value) for value in values])


def rounded_direction(values: Sequence[Fraction]) -> Vector:
    """A positive multiple in doubles: the numbers themselves if they are integers that doubles represent, else rounded
    after division by the largest."""
    largest = max(map(abs, values)) or 1
    if largest <= LARGEST_INTEGER and all(value.denominator == 1 for value in values):
        return rounded(values)
    return rounded(value / largest for value in values)


def _rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf
