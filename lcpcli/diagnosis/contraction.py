"""The convergence rate of Schäfer's fixed point iteration, from theory and measured.

With T = (omega I + M)^-1 (omega I - M), the iteration is x' = T |x| - (omega I + M)^-1 q. As | |x| - |y| | <= |x - y|,
each step reduces the Euclidean distance to the solution at least by the factor |T|_2, which for symmetric M is the
maximum of |omega - lambda| / |omega + lambda| over its eigenvalues (van Bokhoven 1981). Near a solution
without x*_i = 0 the iteration is linear, and the asymptotic factor is the spectral radius of T S, S = diag(sign x*).
With bounds, z - x for mid(l, u, 2x) is in place of |x|: S_ii is 1 where l_i < 2x*_i < u_i, else -1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

MOST_FORMED = 1000  # n up to which the matrix T is formed
FEWEST = 8  # iterates needed to determine a rate


@dataclass(frozen=True)
class Contraction:
    """Convergence factors: the reduction of the error per iteration.

    bound : |T|_2. local : the spectral radius of T S; None if some 2x*_i is at a bound, where the iteration has a kink.
    """

    bound: float
    local: float | None


def contraction(problem: Problem, x: Vector, omega: float = 1.0) -> Contraction | None:
    """The theoretical factors at the solution x = (z - w) / 2, shape (n,), in units of z.

    None if n is above MOST_FORMED or omega I + M is singular. It computes the eigenvalues and singular values of an
    n-by-n matrix.
    """
    if problem.n > MOST_FORMED:
        return None
    try:
        T = _iteration_matrix(problem.M, omega)
        signs = _signs(problem.box, x)
        local = float(np.abs(np.linalg.eigvals(T * signs)).max()) if signs.all() else None
        return Contraction(float(np.linalg.norm(T, 2)), local)
    except np.linalg.LinAlgError:
        return None


def _signs(box: Box, x: Vector) -> Vector:
    """The diagonal of S, 0 at kinks."""
    if not isinstance(box, Box):
        return np.sign(x)
    kinks = ((2 * x == box.lower) | (2 * x == box.upper)) & ~box.fixed
    return np.where(kinks, 0.0, np.where(box.basis_of(x).basic, 1.0, -1.0))


def bound(M: Matrix, omega: float) -> float | None:
    """|T|_2 for M of shape (n, n), n up to MOST_FORMED; None if omega I + M is singular or T overflows."""
    try:
        T = _iteration_matrix(M, omega)
        return float(np.linalg.norm(T, 2)) if np.isfinite(T).all() else None
    except np.linalg.LinAlgError:
        return None


def _iteration_matrix(M: Matrix, omega: float) -> Vector:
    dense = matrices.dense(M)
    shift = omega * np.eye(M.shape[0])
    return np.asarray(np.linalg.solve(shift + dense, shift - dense))


def measured(k: Sequence[int], errors: Sequence[float], largest: float, smallest: float) -> float | None:
    """The reduction of the error per iteration, by least squares on the logarithms of the errors.

    From the first error below `largest` to the last one above `smallest`, to exclude the initial phase and rounding;
    None for fewer than FEWEST iterates.
    """
    below = next((i for i, error in enumerate(errors) if error < largest), len(errors))
    above = max((i for i, error in enumerate(errors) if error > smallest), default=-1)
    kept = [i for i in range(below, above + 1) if errors[i] > 0]
    if len(kept) < FEWEST:
        return None
    slope = float(np.polyfit([k[i] for i in kept], [math.log(errors[i]) for i in kept], 1)[0])
    return math.exp(slope)
