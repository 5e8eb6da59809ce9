"""The optimality conditions of a convex quadratic program: R. W. Cottle, G. B. Dantzig, Complementary pivot theory of
mathematical programming, Linear Algebra Appl. 1 (1968) 103-125. The random data are original to lcp.
"""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.degenerate import integer_matrix
from lcpcli.gallery.lp import constraints, pairs
from lcpcli.model.problem import Problem
from lcpcli.model.program import bordered

CLASS = "positive semidefinite"
SOURCE = "Cottle and Dantzig 1968, random program"


def qp(n: int, seed: int) -> Problem:
    """min x'Qx / 2 + c'x, Ax >= b, x >= 0: M = [Q -A'; A 0], q = (c, -b), z = (x, y). n is at least 2.

    n // 2 constraints, integer data, Q positive definite, M dense. The known solution is strictly complementary with
    independent active constraints, hence unique, and exact.
    """
    n = max(2, n)
    m = n // 2
    random = np.random.default_rng([seed, n])
    A, Q = constraints(random, m, n - m), integer_matrix(random, n - m)
    (x, r), (y, s) = pairs(random, n - m, m), pairs(random, m, m)
    q = np.concatenate((A.T @ y + r - Q @ x, s - A @ x))
    M = bordered(Q, A)
    return Problem(
        M,
        q,
        name=f"qp-{n}",
        solutions=[np.concatenate((x, y))],
        source=SOURCE,
        note="x solves the program, and y holds the multipliers of its constraints.",
    )
