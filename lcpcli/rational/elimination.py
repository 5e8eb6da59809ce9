"""Fraction-free Gaussian elimination on integers, in exact arithmetic.

E. H. Bareiss, Sylvester's identity and multistep integer-preserving Gaussian elimination, Mathematics of Computation 22
(1968) 565-578: after the pivots of an index set P, entry (i, j) is the minor of rows P + i and columns P + j.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

Rows = list[list[int]]


@dataclass(frozen=True)
class Definiteness:
    """Index sets of principal minors that prove a symmetric matrix not to be positive definite or semidefinite.

    zero : a set whose minor is zero. negative : one whose minor is negative. None if there is none.
    """

    zero: tuple[int, ...] | None
    negative: tuple[int, ...] | None


def eliminated(A: Rows, k: int, previous: int) -> Rows:
    """The matrix after pivot k, which is A[k][k] != 0, without its row and column; previous : the preceding pivot."""
    pivot, top = A[k][k], A[k]
    result = []
    for i, row in enumerate(A):
        if i != k:
            factor = row[k]
            result.append(
                [(pivot * v - factor * t) // previous for j, (v, t) in enumerate(zip(row, top, strict=True)) if j != k]
            )
    return result


def definiteness(A: Rows, check: Callable[[], None]) -> Definiteness:
    """Whether the symmetric A is positive definite (both None) or semidefinite (negative None), pivot by pivot.

    `check` is called before each pivot and may raise.
    """
    labels, previous = list(range(len(A))), 1
    chosen: list[int] = []
    zero: tuple[int, ...] | None = None
    while labels:
        check()
        label, pivot = labels.pop(0), A[0][0]
        if pivot < 0:
            return Definiteness(zero, (*chosen, label))
        if pivot == 0:
            zero = zero or (*chosen, label)
            other = next((j for j, value in enumerate(A[0]) if value), None)
            if other is not None:
                return Definiteness(zero, (*chosen, label, labels[other - 1]))
            A = [row[1:] for row in A[1:]]
            continue
        A, previous = eliminated(A, 0, previous), pivot
        chosen.append(label)
    return Definiteness(zero, None)


def first_nonpositive(A: Rows, check: Callable[[], None]) -> int | None:
    """The order of the first leading principal minor that is not positive; None if all are positive."""
    previous = 1
    for order in range(1, len(A) + 1):
        check()
        pivot = A[0][0]
        if pivot <= 0:
            return order
        A, previous = eliminated(A, 0, previous), pivot
    return None


def principal_minors(A: Rows, check: Callable[[], None]) -> Iterator[tuple[tuple[int, ...], int]]:
    """Every principal minor with its index set, by Schur complements with shared elimination steps.

    M. J. Tsatsomeros and L. Li, A recursive test for P-matrices, BIT Numerical Mathematics 40 (2000) 410-414. There are
    2^n - 1. `check` is called before each and may raise.
    """
    pending: list[tuple[Rows, tuple[int, ...], tuple[int, ...], int]] = [(A, tuple(range(len(A))), (), 1)]
    while pending:
        block, labels, chosen, previous = pending.pop()
        check()
        own, rest, pivot = (*chosen, labels[0]), labels[1:], block[0][0]
        yield own, pivot
        if not rest:
            continue
        pending.append(([row[1:] for row in block[1:]], rest, chosen, previous))
        if pivot:
            pending.append((eliminated(block, 0, previous), rest, own, pivot))
            continue
        for size in range(1, len(rest) + 1):
            for more in combinations(rest, size):
                check()
                yield (*own, *more), determinant([[A[i][j] for j in (*own, *more)] for i in (*own, *more)])


def determinant(A: Rows) -> int:
    """The determinant of a square integer A."""
    sign, previous = 1, 1
    while len(A) > 1:
        k = next((i for i, row in enumerate(A) if row[0]), None)
        if k is None:
            return 0
        if k:
            A = [A[k], *A[:k], *A[k + 1 :]]
            sign = -sign if k % 2 else sign
        pivot = A[0][0]
        A, previous = eliminated(A, 0, previous), pivot
    return sign * A[0][0]
