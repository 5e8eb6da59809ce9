"""The obstacle problem for a membrane: R. Glowinski, Numerical Methods for Nonlinear Variational Problems, Springer
(1984), chapter II. The load is original to lcp.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.gallery.tridiagonal import second_difference
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

CLASS = "symmetric positive definite, M"
SOURCE = "Glowinski 1984, chapter II, five-point differences"


def obstacle(n: int, _seed: int) -> Problem:
    """-Laplace z >= f, z >= 0 and complementarity on the unit square, z = 0 on its boundary, times h^2.

    Five-point differences on a grid of m x m interior points with m = sqrt(n), rounded; M is sparse.
    """
    M, q = membrane(n)
    note = "The membrane touches the obstacle where z = 0."
    return Problem(M, q, name=f"obstacle-{q.size}", source=SOURCE, note=note)


def membrane(n: int) -> tuple[Matrix, Vector]:
    """M and q of -Laplace z = f, times h^2."""
    m, h, X, Y = grid(n)
    load = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    return laplacian(m), (-h * h * load).ravel()


def grid(n: int) -> tuple[int, float, Vector, Vector]:
    """m, h and the coordinates of the interior points of the unit square, each of shape (m, m)."""
    m = max(1, round(math.sqrt(n)))
    h = 1 / (m + 1)
    X, Y = np.meshgrid(*2 * [h * np.arange(1, m + 1)])
    return m, h, X, Y


def laplacian(m: int) -> Matrix:
    """Five-point differences for -h^2 Laplace on m x m points."""
    from scipy.sparse import csr_array, eye_array, kron

    T, unit = second_difference(m, 2.0), eye_array(m)
    return csr_array(kron(T, unit) + kron(unit, T))
