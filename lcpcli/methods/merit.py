"""The merit function of Fischer and Burmeister, half the square of Phi, whose zeros are the solutions.

With phi(a, b) = a + b - (a^2 + b^2 + 2 mu)^(1/2) and mu = 0, Phi_i is phi(z_i - l_i, F_i) where z_i has a lower bound
only, -phi(u_i - z_i, -F_i) with an upper bound only, phi(z_i - l_i, -phi(u_i - z_i, -F_i)) with both, F_i with neither,
and z_i - l_i where these are equal. A. Fischer, A special Newton-type optimization method, Optimization 24 (1992)
269-284; S. C. Billups, Algorithms for complementarity problems and generalized equations, thesis (1995). A zero of its
gradient may be no solution. With mu > 0, Phi is smooth, and its zeros tend to a solution as mu tends to 0: C. Kanzow,
Some noninterior continuation methods for linear complementarity problems, SIAM J. Matrix Anal. Appl. 17 (1996) 851-868.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import is_finite
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import is_sparse, plus_diagonal, row_maxima
from lcpcli.model.box import Box
from lcpcli.typing import Matrix, Vector

DAMPING = 1e-6  # of Newton steps where their matrix is singular, relative to it


def phi(box: Box, z: Vector, F: Vector, mu: float = 0.0) -> Vector:
    """Return Phi at an admissible z, shape (n,)."""
    below, above = np.isfinite(box.lower), np.isfinite(box.upper)
    upper = np.where(above, -_phi(np.where(above, box.upper - z, 0.0), -F, mu), F)
    both = np.where(below, _phi(np.where(below, z - box.lower, 0.0), upper, mu), upper)
    return np.where(box.fixed, z - box.lower, both)


def slopes(box: Box, z: Vector, F: Vector, J: Matrix, mu: float = 0.0) -> Matrix:
    """Return the Jacobian of Phi, where mu = 0 an element of the generalized one, dense or a csr array."""
    below, above = np.isfinite(box.lower), np.isfinite(box.upper)
    gap = np.where(above, box.upper - z, 0.0)
    upper = np.where(above, -_phi(gap, -F, mu), F)
    by_gap, by_F = (
        np.where(above, slope, other) for slope, other in zip(_slopes(gap, -F, mu), (0.0, 1.0), strict=True)
    )
    by_z, by_upper = _slopes(np.where(below, z - box.lower, 0.0), upper, mu)
    by_z, by_upper = np.where(below, by_z, 0.0), np.where(below, by_upper, 1.0)
    a = np.where(box.fixed, 1.0, by_z + by_upper * by_gap)
    b = np.where(box.fixed, 0.0, by_upper * by_F)
    if is_sparse(J):
        with imports:
            from scipy.sparse import diags_array
        return (diags_array(b) @ J + diags_array(a)).tocsr()
    return b[:, np.newaxis] * J + np.diag(a)


def _root(a: Vector, b: Vector, mu: float) -> Vector:
    root: Vector = np.hypot(a, b)
    return np.hypot(root, (2 * mu) ** 0.5) if mu else root


def _phi(a: Vector, b: Vector, mu: float) -> Vector:
    """Return phi(a, b), for a, b > 0 without cancellation."""
    root = _root(a, b, mu)
    both = (a > 0) & (b > 0)
    sums = np.where(both, a + b + root, 1.0)
    return np.where(both, 2 * a * (b / sums) - 2 * mu / sums, a + b - root)


def _slopes(a: Vector, b: Vector, mu: float) -> tuple[Vector, Vector]:
    """Return the derivatives of phi by a and b; where both are 0, those in the direction (1, 1)."""
    root = _root(a, b, mu)
    zero = root == 0
    root = np.where(zero, 1.0, root)
    kink = 1.0 - 0.5**0.5
    return np.where(zero, kink, 1.0 - a / root), np.where(zero, kink, 1.0 - b / root)


@np.errstate(all="ignore")
def newton_direction(G: Matrix, values: Vector, gradient: Vector) -> Vector | None:
    """Return the Newton step of Phi or, where its matrix is singular or the step is not one of descent, the step of
    Levenberg and Marquardt; None if neither exists."""
    everything = np.arange(values.size)
    with suppress(SingularMatrix):
        d = PrincipalSolver(G).solve(everything, -values)
        if float(gradient @ d) < 0:
            return d
    H = G.T @ G
    shift = DAMPING * float(row_maxima(H).max(initial=0.0))
    with suppress(SingularMatrix):
        d = PrincipalSolver(plus_diagonal(H.tocsr() if is_sparse(H) else H, shift)).solve(everything, -gradient)
        return d if is_finite(d) and float(gradient @ d) < 0 else None
    return None
