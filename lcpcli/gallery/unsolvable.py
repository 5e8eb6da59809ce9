"""Feasible, yet without a solution (original to lcp): M contains [0 1; 1 0] with q = (-1, 1), which has none."""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.degenerate import integer_matrix
from lcpcli.model.problem import Problem

CLASS = "none"
SOURCE = "random, original to lcp"


def unsolvable(n: int, seed: int) -> Problem:
    """[0 1; 1 0] with q = (-1, 1) in two random rows that involve no other unknown. n is at least 2.

    The other rows have a symmetric positive definite block, whose solvability makes the whole problem feasible, and
    random integers in the two columns.
    """
    n = max(2, n)
    random = np.random.default_rng([seed, n])
    M, q = np.zeros((n, n)), random.integers(-5, 6, n).astype(np.float64)
    M[:2, :2], q[:2] = [[0, 1], [1, 0]], [-1, 1]
    M[2:, :2], M[2:, 2:] = random.integers(-2, 3, (n - 2, 2)), integer_matrix(random, n - 2)
    order = random.permutation(n)
    note = "Feasible, but no complementary set yields a solution."
    M = np.ascontiguousarray(M[order][:, order])
    return Problem(M, q[order], name=f"unsolvable-{n}", verdict="unsolvable", source=SOURCE, note=note)
