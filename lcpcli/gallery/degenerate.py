"""A solution without strict complementarity (original to lcp): z_i = w_i = 0 for half of the indices."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

CLASS = "symmetric positive definite"
SOURCE = "random, original to lcp"


def degenerate(n: int, seed: int) -> Problem:
    """Integer M = A'A + I and q; z > 0 for a quarter of the indices and w > 0 for another, rounded down."""
    random = np.random.default_rng([seed, n])
    M = integer_matrix(random, n)
    places = random.permutation(n)
    z, w = np.zeros(n), np.zeros(n)
    quarter = (n + 2) // 4
    z[places[:quarter]] = random.integers(1, 10, quarter)
    w[places[quarter : n // 2]] = random.integers(1, 10, n // 2 - quarter)
    note = "The solution is exact: all numbers are integers. z_i = w_i = 0 for half of the indices."
    return Problem(M, w - M @ z, name=f"degenerate-{n}", solutions=[z], source=SOURCE, note=note)


def integer_matrix(random: Generator, n: int) -> Vector:
    """A'A + I with entries of A from -1, 0 and 1: symmetric positive definite, with integers of at most n + 1."""
    A = random.integers(-1, 2, (n, n)).astype(np.float64)
    M: Vector = A.T @ A + np.eye(n)
    return M
