"""Solvable, yet Lemke's method ends on a ray (original to lcp), as it does for [0 1; 0 0] with q = (-1, 0)."""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.degenerate import integer_matrix
from lcpcli.model.problem import Problem

CLASS = "copositive"
SOURCE = "random, original to lcp"


def ray(n: int, seed: int) -> Problem:
    """[0 1; 0 0] and a symmetric positive definite integer block on the diagonal. n is at least 2.

    q_1 is the smallest component of q, so that z_1, whose column of M is zero, enters first in Lemke's method. In z_1
    and z_2 the solutions are (t, -q_1) and (0, -q_1 + t) for all t >= 0; the one given has t = 0.
    """
    n = max(2, n)
    random = np.random.default_rng([seed, n])
    M, q = np.zeros((n, n)), np.zeros(n)
    size, inside = random.integers(1, 10, n).astype(np.float64), random.integers(0, 2, n) == 1
    z, w = np.where(inside, size, 0), np.where(inside, 0, size)
    M[2:, 2:] = integer_matrix(random, n - 2)
    q[2:] = w[2:] - M[2:, 2:] @ z[2:]
    M[0, 1], q[0] = 1, q.min() - 1
    z[:2] = 0, -q[0]
    note = "It has infinitely many solutions, but Lemke's method from e ends on a ray at its first pivot."
    return Problem(M, q, name=f"ray-{n}", solutions=[z], source=SOURCE, note=note)
