"""C. E. Lemke, J. T. Howson, Equilibrium points of bimatrix games, J. SIAM 12 (1964) 413-423."""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "copositive"
SOURCE = "Lemke and Howson 1964, random costs"


def bimatrix(n: int, seed: int) -> Problem:
    """M = [0 A; B' 0] and q = -e with costs A and B of shape (n // 2, n - n // 2), uniform in (1, 2). n is at least 2.

    z = (x, y) solves it if x and y, each divided by its sum, are an equilibrium of the game.
    """
    n = max(2, n)
    m = n // 2
    A, B = np.random.default_rng([seed, n]).uniform(1, 2, (2, m, n - m))
    M = np.zeros((n, n))
    M[:m, m:], M[m:, :m] = A, B.T
    note = "Lemke's method from e ends on a ray at its first pivot, although every game has an equilibrium."
    return Problem(M, -np.ones(n), name=f"bimatrix-{n}", source=SOURCE, note=note)
