"""The ends of the spectrum of M, roughly, and the parameter of the modulus iteration that follows from them."""

from __future__ import annotations

import numpy as np

from lcpcli import linalg, principal
from lcpcli.conjugate import dot, norm
from lcpcli.typing import Matrix, Vector

STEPS = 8  # of power or inverse iteration from a random vector: enough for a factor 3 in an eigenvalue


def best_omega(M: Matrix) -> float:
    """The omega > 0 by which the modulus iteration (omega I + M) x' = (omega I - M) |x| - q does best, roughly.

    M symmetric positive definite: sqrt(lambda_min lambda_max) minimises the contraction factor
    max |omega - lambda| / |omega + lambda|; both ends by a few steps of power and of inverse iteration, for which M is
    factorized. Rough ends do: the factor is flat around its minimum.
    Any other M: the largest diagonal entry, the least scalar omega for which Bai (2010) proves
    convergence for H-matrices with positive diagonal; if no diagonal entry is positive, the largest row sum of |M|.
    """
    found = ends(M)
    if found is not None:
        omega = float(np.sqrt(found[0]) * np.sqrt(found[1]))
        if 0 < omega < np.inf:
            return omega
    diagonal = float(M.diagonal().max())
    return diagonal if diagonal > 0 else linalg.norm_inf(M) or 1.0


def ends(M: Matrix) -> tuple[float, float] | None:
    """Roughly the smallest and the largest eigenvalue of a symmetric positive definite M; None of any other M."""
    solve = principal.definite_solver(M)
    if solve is None:
        return None
    return float(1 / _rayleigh(solve, M.shape[0])), _rayleigh(lambda v: M @ v, M.shape[0])


def _rayleigh(product: linalg.Solve, n: int) -> float:
    """The Rayleigh quotient of a symmetric positive definite operator after STEPS steps of power iteration."""
    v: Vector = np.random.default_rng(0).standard_normal(n)
    size = 0.0
    for _ in range(STEPS):
        v /= norm(v)
        image = product(v)
        size = dot(v, image)
        v = image
    return size
