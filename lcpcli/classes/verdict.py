"""What is found out about one class of matrices: a word, and what shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np

from lcpcli.typing import Vector

YES, NO, OPEN = "yes", "no", "not decided"
WIDEST = 2**53  # whole numbers up to this are floats
SHOWN = 6  # entries of a vector or index set that a sentence shows


@dataclass(frozen=True, eq=False)
class Verdict:
    """Whether a matrix belongs to a class, its entries taken as the exact numbers that they are.

    word : YES, NO or OPEN.
    evidence : what shows it, or why it is not decided, as a clause.
    indices : the index set, counted from 0, that the evidence speaks of; None where it speaks of none.
    vector : the vector, shape (n,), for which what the evidence says holds exactly; None where there is none.
    """

    word: str
    evidence: str
    indices: tuple[int, ...] | None = None
    vector: Vector | None = None


class Late(Exception):
    """The time for finding out is used up."""


def shown(numbers: Sequence[float] | Vector) -> str:
    """A vector or index set as a sentence shows it: whole if it is short, else its beginning."""
    texts = [f"{number:.6g}" for number in numbers[:SHOWN]]
    return "(" + ", ".join(texts) + (", ...)" if len(numbers) > SHOWN else ")")


def index_set(indices: Sequence[int]) -> str:
    """An index set as a sentence shows it."""
    return "{" + shown(indices)[1:-1] + "}"


def as_floats(v: Sequence[Fraction]) -> Vector | None:
    """A positive multiple of a rational vector that floats hold exactly, in whole numbers; None if there is none."""
    common = lcm(*(value.denominator for value in v))
    whole = [int(value * common) for value in v]
    divisor = gcd(*whole) or 1
    if max(map(abs, whole)) // divisor > WIDEST:
        return None
    return np.array([value // divisor for value in whole], dtype=np.float64)
