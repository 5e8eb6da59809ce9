"""Rational numbers from text and back, and rounded to doubles.

Text passes through `decimal`, which has no limit on digits as int and str have, and an exponent there costs nothing
until it is expanded: so it can be refused first.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from decimal import Decimal, InvalidOperation
from fractions import Fraction

import numpy as np

from lcpcli.errors import ProblemError, quoted
from lcpcli.typing import Vector

EXTENT = 5000  # the largest decimal exponent that is expanded
SHORT = 25  # digits of a fraction in a line of text
RATIO = re.compile(r"[-+]?[0-9]+/[0-9]+")


def fraction(text: str) -> Fraction:
    """The rational number that a decimal text stands for; ProblemError if it is none, or its exponent is too large."""
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
    if abs(value.adjusted()) > EXTENT + len(text):
        raise ProblemError("", f"has the number {quoted(text)}", f"keep exponents between -{EXTENT} and {EXTENT}")
    return Fraction(value)


def ratio(text: str) -> Fraction:
    """The rational number that a decimal text, or two whole numbers with a slash between them, stands for."""
    if "/" not in text:
        return fraction(text)
    above, _, below = text.strip().partition("/")
    if not RATIO.fullmatch(text.strip()) or not below.strip("0"):
        raise ProblemError("", f"has {quoted(text)}, not a fraction", "give whole numbers, as in 15/29")
    return Fraction(int(Decimal(above)), int(Decimal(below)))


def text(value: Fraction) -> str:
    """A rational number with all its digits, as `ratio` reads it."""
    above = str(Decimal(value.numerator))
    return above if value.denominator == 1 else f"{above}/{Decimal(value.denominator)}"


def brief(value: Fraction) -> str:
    """A rational number as a line of text has room for it: with more than SHORT digits, rounded and marked by ~."""
    length = value.numerator.bit_length() + value.denominator.bit_length()
    return text(value) if length * math.log10(2) <= SHORT else f"~{_rounded(value):.7g}"


def rounded(values: Iterable[Fraction]) -> Vector:
    """The nearest doubles; infinities beyond their range."""
    return np.array([_rounded(value) for value in values])


def _rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf
