"""A nearly singular symmetric positive definite matrix (original to lcp): the effect of the smallest eigenvalue."""

from __future__ import annotations

import numpy as np

from lcpcli.gallery.ranges import require
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"
SOURCE = "random, original to lcp"


def near_singular(n: int, seed: int, *, epsilon: float = 1e-8) -> Problem:
    """M = HDH with a random reflection H and eigenvalues D equally spaced from 1 to 2, except one, epsilon.

    q = w - Mz, rounded, for z and w complementary and uniform in (0, 1); no solution is given, as that of the rounded
    data may differ from this z by about 1e-16 / epsilon.

    epsilon : the smallest eigenvalue of M, up to rounding, 1e-12 <= epsilon <= 1.
    """
    require("epsilon", epsilon, 1e-12 <= epsilon <= 1, "1e-12 <= epsilon <= 1")
    random = np.random.default_rng([seed, n])
    v, size = random.standard_normal(n), random.uniform(-1, 1, n)
    v /= np.sqrt(np.sum(v * v))
    eigenvalues = np.linspace(1, 2, n)
    eigenvalues[0] = epsilon
    scaled = eigenvalues * v
    M = 4 * np.sum(scaled * v) * np.outer(v, v) - 2 * (np.outer(v, scaled) + np.outer(scaled, v))
    M[np.diag_indices(n)] += eigenvalues
    q = np.maximum(-size, 0) - M @ np.maximum(size, 0)
    return Problem(M, q, name=f"near-singular-{n}", source=SOURCE, note=f"The condition of M is {2 / epsilon:.3g}.")
