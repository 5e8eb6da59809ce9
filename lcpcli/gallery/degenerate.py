"""A solution without strict complementarity, of this program: z_i = w_i = 0 in half of the places."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

CLASS = "symmetric positive definite"
SOURCE = "random, of this program"


def degenerate(n: int, seed: int) -> Problem:
    """M = A'A + I and q of integers; of the solution, a quarter is positive and a quarter has w > 0, rounded down."""
    random = np.random.default_rng([seed, n])
    M = integer_matrix(random, n)
    places = random.permutation(n)
    z, w = np.zeros(n), np.zeros(n)
    quarter = (n + 2) // 4
    z[places[:quarter]] = random.integers(1, 10, quarter)
    w[places[quarter : n // 2]] = random.integers(1, 10, n // 2 - quarter)
    note = "The solution is exact: all numbers are integers. z_i = w_i = 0 in half of the places."
    return Problem(M, w - M @ z, name=f"degenerate-{n}", solutions=[z], source=SOURCE, note=note)


def integer_matrix(random: Generator, n: int) -> Vector:
    """A'A + I with entries of A from -1, 0 and 1: symmetric positive definite, of integers of at most n + 1."""
    A = random.integers(-1, 2, (n, n)).astype(np.float64)
    M: Vector = A.T @ A + np.eye(n)
    return M
