"""The obstacle problem for a membrane: R. Glowinski, Numerical Methods for Nonlinear Variational Problems, Springer
(1984), chapter II. The load is original to lcp.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.tridiagonal import second_difference
from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite, M"
SOURCE = "Glowinski 1984, chapter II, five-point differences"


def obstacle(n: int, _seed: int) -> Problem:
    """-Laplace z >= f, z >= 0 and complementarity on the unit square, z = 0 on its boundary, times h^2.

    Five-point differences on a grid of m x m interior points with m = sqrt(n), rounded; M is sparse.
    """
    from scipy.sparse import csr_array, eye_array, kron

    m = max(1, round(math.sqrt(n)))
    h = 1 / (m + 1)
    T, unit = second_difference(m, 2.0), eye_array(m)
    X, Y = np.meshgrid(*2 * [h * np.arange(1, m + 1)])
    load = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    M = csr_array(kron(T, unit) + kron(unit, T))
    return Problem(
        M,
        (-h * h * load).ravel(),
        name=f"obstacle-{m * m}",
        source=SOURCE,
        note="The membrane touches the obstacle where z = 0.",
    )
