"""The verdict on one class of matrices: a word, and the evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np

from lcpcli.typing import Vector

YES, NO, UNDECIDED = "yes", "no", "not decided"
WIDEST = 2**53  # integers up to this are exactly representable
SHOWN = 6  # entries of a vector or index set shown in a sentence


@dataclass(frozen=True, eq=False)
class Verdict:
    """Whether a matrix belongs to a class, its entries taken as exact numbers.

    word : YES, NO or UNDECIDED.
    evidence : the evidence, or why it is not decided, as a clause; rows and columns in it are counted from 1.
    indices : the index set, counted from 0, in the evidence; None if there is none.
    vector : the vector, shape (n,), for which the evidence holds exactly; None if there is none.
    """

    word: str
    evidence: str
    indices: tuple[int, ...] | None = None
    vector: Vector | None = None


class Late(Exception):
    """The time for the tests is used up."""


def shown(numbers: Sequence[float] | Vector) -> str:
    """A vector or index set for a sentence: complete if it is short, else its beginning."""
    texts = [f"{number:.6g}" for number in numbers[:SHOWN]]
    return "(" + ", ".join(texts) + (", ...)" if len(numbers) > SHOWN else ")")


def index_set(indices: Sequence[int]) -> str:
    """An index set for a sentence, counted from 1."""
    return "{" + shown([i + 1 for i in indices])[1:-1] + "}"


def entry(i: int, j: int) -> str:
    """An entry of M for a sentence, counted from 1."""
    return f"M({i + 1}, {j + 1})"


def as_floats(v: Sequence[Fraction]) -> Vector | None:
    """A positive integer multiple of a rational vector, exactly representable in floats; None if there is none."""
    common = lcm(*(value.denominator for value in v))
    whole = [int(value * common) for value in v]
    divisor = gcd(*whole) or 1
    if max(map(abs, whole)) // divisor > WIDEST:
        return None
    return np.array([value // divisor for value in whole], dtype=np.float64)
