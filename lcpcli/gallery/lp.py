"""A linear program and its dual: G. B. Dantzig, R. W. Cottle, Positive (semi-)definite programming, in: Nonlinear
Programming, North-Holland (1967) 55-73. The random data are original to lcp.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator

from lcpcli.model.problem import Problem
from lcpcli.model.program import bordered
from lcpcli.typing import Vector

CLASS = "skew-symmetric"
SOURCE = "Dantzig and Cottle 1967, random program"
A_ROW = 10
DENSE = 200


def lp(n: int, seed: int) -> Problem:
    """min c'x, Ax >= b, x >= 0 with its dual: M = [0 -A'; A 0], q = (c, -b), z = (x, y). n is at least 2.

    n // 2 constraints with integer data, up to ten entries per row; M is sparse above n = 200. x and y are known at a
    strictly complementary vertex, so the solution is unique, and exact.
    """
    n = max(2, n)
    m = n // 2
    random = np.random.default_rng([seed, n])
    A = constraints(random, m, n - m)
    (x, r), (y, s) = pairs(random, n - m, m), pairs(random, m, m)
    q = np.concatenate((A.T @ y + r, s - A @ x))
    M = bordered(None, A, sparse=n > DENSE)
    return Problem(
        M,
        q,
        name=f"lp-{n}",
        solutions=[np.concatenate((x, y))],
        source=SOURCE,
        note="The diagonal of M is zero; x solves the program and y its dual.",
    )


def constraints(random: Generator, m: int, k: int) -> Any:
    """A of shape (m, k), m <= k, sparse, of integers, up to ten per row; its leading square is diagonally dominant."""
    from scipy.sparse import csr_array

    count = min(A_ROW, k) - 1
    rows, columns = np.repeat(np.arange(m), count), random.integers(0, k, m * count)
    values = random.integers(-2, 3, m * count).astype(np.float64)
    sums = np.bincount(rows, abs(values), m) + 1
    corner = np.arange(m)
    A = csr_array((np.concatenate((values, sums)), (np.concatenate((rows, corner)), np.concatenate((columns, corner)))))
    A.resize(m, k)
    return A


def pairs(random: Generator, length: int, m: int) -> tuple[Vector, Vector]:
    """Complementary vectors of integers: the first is positive in (m + 1) // 2 entries, the second in all others."""
    size = random.integers(1, 10, length).astype(np.float64)
    inside = np.arange(length) < (m + 1) // 2
    return np.where(inside, size, 0), np.where(inside, 0, size)
