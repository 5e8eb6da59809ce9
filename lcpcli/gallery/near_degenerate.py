"""Strict complementarity by a narrow margin (original to lcp): max(z_i, w_i) is 1 or epsilon."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.degenerate import integer_matrix
from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"
SOURCE = "random, original to lcp"


def near_degenerate(n: int, seed: int, *, epsilon: float = 1e-8) -> Problem:
    """Integer M = A'A + I; one of z_i and w_i is 0, the other is 1 for half of the indices and epsilon for the rest.

    epsilon : rounded to a power of two, so that q is exact and the solution is known (while n^2 < 2^51 epsilon; beyond,
        none is given); 1e-12 <= epsilon <= 1.
    """
    require("epsilon", epsilon, 1e-12 <= epsilon <= 1, "1e-12 <= epsilon <= 1")
    random = np.random.default_rng([seed, n])
    M = integer_matrix(random, n)
    power = 2.0 ** round(math.log2(epsilon))
    size = np.where(np.arange(n) % 2 == 0, 1.0, power)[random.permutation(n)]
    inside = random.integers(0, 2, n) == 1
    z, w = np.where(inside, size, 0), np.where(inside, 0, size)
    q = w - M @ z
    solutions = [z] if n * n < 2**51 * power else []
    note = f"Strictly complementary by only {power:.3g} (2^{round(math.log2(power))})."
    return Problem(M, q, name=f"near-degenerate-{n}", solutions=solutions, source=SOURCE, note=note)
