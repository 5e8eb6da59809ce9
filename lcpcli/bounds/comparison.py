"""The bound of Chen and Xiang (2006) for H+ matrices, componentwise and independent of scaling.

Let w = M z + q, r = min(z, w) and <M> the comparison matrix of M: |M_ii| on the diagonal, -|M_ij| off it. There is a
diagonal D, 0 <= D <= I, with r = (I - D + D M)(z - z*), because the change of the minimum of two numbers is a convex
combination of their changes. M being H+, |(I - D + D M)^-1| <= <I - D + D M>^-1 <= <M>^-1 max(L, I) with L the diagonal
of M, which is their theorem. Rows may be scaled beforehand; the best scaling is by 1 / L, for which L becomes I and the
bound

    |z - z*| <= <M>^-1 |min(L z, w)|.

So it is with bounds, where min(z, w) is z - mid(l, u, z - w), as mid(l, u, t) increases with t and by no more than t.
M is H+ if and only if its diagonal is positive and <M> u > 0 for some u > 0; then <M>^-1 >= 0. So <M> t >= s yields
t >= <M>^-1 s, and an approximate t is corrected by adding a multiple of u: no system has to be solved exactly.
"""

from __future__ import annotations

import numpy as np

from lcpcli.bounds.neighbour import solver
from lcpcli.bounds.rounding import Theorem, factor, terms
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.model import scaled
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

POWER_STEPS = 20  # after which <M> is factorized
SLOW = 0.9  # the rate above which Jacobi's iteration is too slow
JACOBI_STEPS = 60
INVERSE_STEPS = 3


def theorem(problem: Problem) -> Theorem | None:
    """A bound on |z - z*|_inf, for M in range with positive diagonal; None if M is not recognized as H+."""
    M, diagonal = problem.M, problem.M.diagonal()
    units = scaled.scale(problem)
    found = _certificate(units.problem.M)
    if found is None:
        return None
    v, solve = found
    u = v * units.C
    gain = at_least(M, diagonal, u)
    if not (u.min() > SMALLEST_NORMAL and gain.min() > 0 and np.isfinite(gain).all()):
        return None

    def bound(z: Vector, w: Vector) -> float:
        s = np.abs(problem.box.gaps(z, w, diagonal)) * (1 + 4 * EPS)
        if not s.any():
            return 0.0
        t = _jacobi(M, diagonal, s, (s / gain).max() * u) if solve is None else np.abs(units.C * solve(units.R * s))
        missing = np.maximum(s - at_least(M, diagonal, t), 0.0)
        multiple = (missing / gain).max() * (1 + 8 * EPS) + SMALLEST_NORMAL
        return float((t + multiple * u).max()) * (1 + 8 * EPS) + SMALLEST_NORMAL

    return bound


def at_least(M: Matrix, diagonal: Vector, u: Vector) -> Vector:
    """A lower bound on <M> u for u >= 0: 2 L u - |M| u minus a bound on the rounding errors."""
    own, all_terms = 2 * diagonal * u, matrices.absolute_product(M, u)
    lost = factor(terms(M)) * (own + all_terms) + (terms(M) + 4) * SMALLEST_NORMAL
    result: Vector = own - all_terms - lost
    return result


def _certificate(M: Matrix) -> tuple[Vector, Solve | None] | None:
    """u > 0 of shape (n,) for which <M> u appears to be positive, and the solver for <M> if one was needed.

    With L the diagonal and B = L - <M>, M is H+ if and only if the spectral radius of L^-1 B is below 1. The ratios
    (B u)_i / (L u)_i enclose it for every u > 0 (Collatz and Wielandt), and a few power steps often suffice.
    """
    diagonal = M.diagonal()
    if not diagonal.min() > 0:
        return None
    u = np.ones(diagonal.size)
    for _ in range(POWER_STEPS):
        ratios = (matrices.absolute_product(M, u) / diagonal - u) / u
        if ratios.max() < SLOW:
            return u, None
        if not 0 < ratios.max() < np.inf or ratios.min() > 1:
            return None
        u *= 0.5 * (1 + ratios)
        u /= u.max()
        u = np.maximum(u, SMALLEST_NORMAL)
    try:
        solve = solver(matrices.comparison(M))
    except SingularMatrix:
        return None
    for _ in range(INVERSE_STEPS):
        u = solve(diagonal * u)
        if not u.min() > 0:
            return None
        u /= u.max()
    return u, solve


def _jacobi(M: Matrix, diagonal: Vector, s: Vector, t: Vector) -> Vector:
    """Jacobi's iteration from t >= <M>^-1 s down to nearly <M>^-1 s."""
    for _ in range(JACOBI_STEPS):
        t = np.maximum((matrices.absolute_product(M, t) + s) / diagonal - t, 0.0)
    return t
