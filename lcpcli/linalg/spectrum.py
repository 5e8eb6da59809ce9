"""Rough extreme eigenvalues of symmetric positive definite matrices."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import factors, principal
from lcpcli.linalg.krylov import dot, norm
from lcpcli.typing import Matrix, Vector

STEPS = 8  # of power or inverse iteration from a random vector: enough for a factor 3 in an eigenvalue


def ends(M: Matrix) -> tuple[float, float] | None:
    """Rough smallest and largest eigenvalues of a symmetric positive definite M; None for any other M."""
    solve = principal.definite_solver(M)
    if solve is None:
        return None
    return float(1 / _rayleigh(solve, M.shape[0])), _rayleigh(lambda v: M @ v, M.shape[0])


def _rayleigh(product: factors.Solve, n: int) -> float:
    """The Rayleigh quotient of a symmetric positive definite operator after STEPS steps of power iteration."""
    v: Vector = np.random.default_rng(0).standard_normal(n)
    size = 0.0
    for _ in range(STEPS):
        v /= norm(v)
        image = product(v)
        size = dot(v, image)
        v = image
    return size
