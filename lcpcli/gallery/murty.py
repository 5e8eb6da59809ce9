"""K. G. Murty, Computational complexity of complementary pivot methods, Math. Programming Study 7 (1978) 61-73."""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

CLASS = "P, positive semidefinite"
SOURCE = "Murty 1978"


def murty(n: int, _seed: int) -> Problem:
    """M = U with 1 on the diagonal and 2 above it, q = -e; the solution is e_n."""
    z = np.zeros(n)
    z[-1] = 1
    note = f"Pivoting on the least index needs 2^{n} - 1 steps from z = 0."
    return Problem(triangle(n), -np.ones(n), name=f"murty-{n}", solutions=[z], source=SOURCE, note=note)


def triangle(n: int) -> Vector:
    """U, of shape (n, n): 1 on the diagonal, 2 above it."""
    U: Vector = np.triu(np.full((n, n), 2.0), 1)
    np.fill_diagonal(U, 1)
    return U
