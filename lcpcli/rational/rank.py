"""The rank of a matrix of integers, proved without long eliminations.

Let A_11, with r rows and columns, be nonsingular. Then A has the rank r if and only if
its Schur complement S = A_22 - A_21 A_11^-1 A_12 is 0. By Sylvester's identity
det(A_11) S_ij is a minor of A of order r + 1, an integer that Hadamard's inequality
bounds by the product of the lengths of its rows. If a prime p does not divide
det(A_11), and p^k is larger than that bound and divides all these integers, they are 0.
They are computed modulo p^k digit by digit, as A_11^-1 A_12 is (J. D. Dixon, Exact
solution of linear equations using p-adic expansions, Numerische Mathematik 40 (1982)
137-141): with C = A_11^-1 modulo p,

    x = C R modulo p,    R' = (R - A_11 x) / p,    T' = (T - A_21 x) / p,

starting from R = A_12 and T = A_22. p divides each R - A_11 x, and each T - A_21 x as
long as S is 0 modulo that power of p. All numbers fit in machine integers if the
entries of A are not long.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lcpcli.interrupts import raise_if_timed_out
from lcpcli.typing import Indices

PRIME = 2**27 - 39
# Limit on sums of products in machine integers, with one bit in reserve.
LARGEST = 2**62
# Limits on the number of products, for a fraction of a second.
MAX_WORK, MAX_WORK_OF_OBJECTS = 10**9, 10**7


def has_rank(A: Any, rows: Indices, columns: Indices) -> bool | None:
    """Return whether the rank of A, of shape (m, n), equals that of its submatrix with
    these rows and columns, which are equally many; None if that submatrix is singular
    modulo a prime, or if it takes too long.

    A : integers as floats, or an array of int objects, which takes longer.
    """
    others, rest = _without(A.shape[0], rows), _without(A.shape[1], columns)
    if not others.size or not rest.size:
        return True
    r, largest = rows.size, max(float(np.abs(A).max()), PRIME)
    digits = _digits(A, rows, others)
    whole: Any = A
    if A.dtype != object and (r + 1) * PRIME * largest < LARGEST:
        whole = A.astype(np.int64)
    elif A.dtype != object:
        whole = np.array([list(map(int, row)) for row in A.tolist()], dtype=object)
    work = digits * A.shape[0] * max(r, 1) * rest.size
    if work > (MAX_WORK if whole.dtype != object else MAX_WORK_OF_OBJECTS):
        return None
    upper, lower = whole[np.ix_(rows, columns)], whole[np.ix_(others, columns)]
    inverse = _inverse((upper % PRIME).astype(np.int64))
    if inverse is None:
        return None
    R, T = whole[np.ix_(rows, rest)], whole[np.ix_(others, rest)]
    for _ in range(digits):
        raise_if_timed_out()
        x = inverse @ (R % PRIME).astype(np.int64) % PRIME
        R = (R - upper @ x) // PRIME
        T = T - lower @ x
        if (T % PRIME).any():
            return False
        T = T // PRIME
    return True


def _without(n: int, indices: Indices) -> Indices:
    """Return the indices from 0 to n - 1 that are not among these."""
    is_other = np.ones(n, dtype=bool)
    is_other[indices] = False
    return np.flatnonzero(is_other)


def _digits(A: Any, rows: Indices, others: Indices) -> int:
    """Return the number of digits modulo PRIME that have to be 0 to prove that a minor
    of the rows with one of the others is 0, by Hadamard's inequality.
    """
    lengths = np.log2(np.maximum(np.linalg.norm(A.astype(float), axis=1), 1.0))
    bits = float(lengths[rows].sum() + lengths[others].max()) + 1
    return math.ceil(bits * (1 + 1e-9) / math.log2(PRIME))


def _inverse(A: Any) -> Any:
    """Return the inverse of a matrix of integers modulo PRIME, or None if it is
    singular.
    """
    n = len(A)
    system = np.hstack((A, np.eye(n, dtype=np.int64)))
    for k in range(n):
        nonzero = np.flatnonzero(system[k:, k])
        if not nonzero.size:
            return None
        other = k + int(nonzero[0])
        system[[k, other]] = system[[other, k]]
        system[k] = system[k] * pow(int(system[k, k]), -1, PRIME) % PRIME
        factors = system[:, k].copy()
        factors[k] = 0
        system = (system - np.outer(factors, system[k])) % PRIME
    return system[:, n:]
