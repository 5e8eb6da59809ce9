"""The bound of Mathias and Pang (1990) and Pang (1987) for positive definite M, symmetric or not, in its sharp form.

Let w = M z + q, and take rho and sigma so that y = z - rho and v = w - sigma are nonnegative with y'v = 0: where
z_i is the smaller one, rho_i = z_i and sigma_i = min(w_i, 0), elsewhere rho_i = min(z_i, 0) and sigma_i = w_i. For a
positive diagonal T, (y - z*)'T(v - w*) = -y'T w* - z*'T v <= 0. With e = z - z* this reads
(e - rho)'T(M e - sigma) <= 0, and as rho'T sigma >= 0,

    e'T M e <= g'e    with    g = T sigma + M'T rho.

With bounds, y lies within them and v has the signs that they ask for at y: at l_i, v_i = max(w_i, 0); at u_i, v_i =
min(w_i, 0); elsewhere y_i = mid(l, u, z)_i and v_i = 0. The rest is the same.

So if the symmetric part of T M has smallest eigenvalue lambda > 0, |e|_2 <= |g|_2 / lambda, which for T = I is at most
Pang's (1 + |M|_2) |min(z, w)|_2 / lambda. It is applied in units in which T M has a diagonal near 1, and around the
centre of the ellipsoid, c = S^-1 g / 2 for the symmetric part S: f = e - c has f'S f <= (g - 2 S c)'f + c'(g - S c) for
every c, so that c may be rounded.

lambda is verified by Cholesky's factorization of the shifted matrix, which runs to completion only if no eigenvalue is
below minus its rounding errors: S. M. Rump, Verification of positive definiteness, BIT Numerical Mathematics 46 (2006)
433-452.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.bounds.rounding import Theorem, factor, norm
from lcpcli.interrupts import interruptibly
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

LARGEST_DENSE = 2000  # n up to which a sparse M is converted to dense
LARGEST_UNIT = 2.0**250  # of T and of the units, so that products of these with M neither overflow nor underflow
RIDGE = 1e-9  # regularizes the least-squares problem


def theorems(problem: Problem) -> dict[str, Theorem]:
    """Bounds on |z - z*|_inf, for M in range with positive diagonal: with T = I and with T that makes T M symmetric.

    Empty if M is not proved to be positive definite, or is sparse with more than LARGEST_DENSE unknowns.
    """
    M = problem.M
    if is_sparse(M):
        if problem.n > LARGEST_DENSE:
            return {}
        M = M.toarray()
    scales = {"definite": np.ones(problem.n)}
    if not matrices.is_symmetric(M):
        scales["symmetrised"] = _symmetrising(M)
    found = {name: _theorem(M, T, problem.box) for name, T in scales.items()}
    return {name: theorem for name, theorem in found.items() if theorem is not None}


def _theorem(M: Matrix, T: Vector, box: Box) -> Theorem | None:
    """The bound in the units D in which A = D T M D has a diagonal between 1/2 and 2."""
    diagonal = M.diagonal()
    D = np.exp2(-np.rint(0.5 * np.log2(T * diagonal)))
    rows = D * T
    if not all(units.min() >= 1 / LARGEST_UNIT and units.max() <= LARGEST_UNIT for units in (T, D, rows)):
        return None
    A = matrices.scaled(M, rows, D)
    S = 0.5 * (A + A.T)
    least = least_eigenvalue(S)
    if least is None:
        return None

    def bound(z: Vector, w: Vector) -> float:
        sigma, rho = box.corrections(z, w, diagonal)
        first, second = rows * sigma, rho / D
        largest = max(float(np.abs(first).max()), float(np.abs(second).max()))
        if largest == 0:
            return 0.0
        power = 2.0 ** math.frexp(largest)[1]
        first, second = first / power, second / power
        g = first + second @ A
        off = factor(g.size) * (np.abs(first) + matrices.absolute_product(A.T, np.abs(second)) + SMALLEST_NORMAL)
        plain = float(D.max()) * norm(np.abs(g) + off) / least
        return power * min(plain, _around_centre(S, least, D, g, off)) * (1 + 16 * EPS) + SMALLEST_NORMAL

    return bound


def _symmetrising(M: Matrix) -> Vector:
    """T for which T M is as close to symmetric as possible: least squares on log |T_i M_ij / T_j M_ji|.

    If M comes from a symmetric matrix by scaling of rows and columns, T M is symmetric.
    """
    sizes = np.log2(np.abs(M), where=M != 0, out=np.zeros_like(M))
    pairs = (M != 0) & (M.T != 0)
    excess = np.where(pairs, sizes.T - sizes, 0.0).sum(axis=1)
    laplacian = np.diag(pairs.sum(axis=1) + RIDGE) - pairs
    T: Vector = np.exp2(np.linalg.solve(laplacian, excess))
    return T


def least_eigenvalue(S: Matrix) -> float | None:
    """A positive lower bound on the smallest eigenvalue of S, or None.

    S : shape (n, n), symmetric, of size one; each entry may have one rounding error.
    """
    n = S.shape[0]
    try:
        estimate = float(interruptibly(lambda: np.linalg.eigvalsh(S)[0]))
        size = float(np.abs(S).sum(axis=1).max())
        lost = factor(n) * (float(S.trace()) + size) + n * n * SMALLEST_NORMAL
        shift = estimate - 2 * lost
        if not shift > lost:
            return None
        interruptibly(lambda: np.linalg.cholesky(S - shift * np.eye(n)))
    except np.linalg.LinAlgError:
        return None
    return float(shift - lost) * (1 - 4 * EPS)


def _around_centre(S: Matrix, least: float, D: Vector, g: Vector, off: Vector) -> float:
    """An upper bound on all D_i |e_i|, from the ball around c = S^-1 g / 2 containing e; g is off by at most `off`."""
    c = 0.5 * np.linalg.solve(S, g)
    image = S @ c
    image_off = 2 * factor(c.size) * (matrices.absolute_product(S, np.abs(c)) + SMALLEST_NORMAL)
    left = norm(np.abs(g - 2 * image) + off + 2 * image_off + EPS * np.abs(g))
    gap = np.abs(c) @ (off + image_off + factor(c.size) * (np.abs(g) + np.abs(image)))
    square = max(float(c @ (g - image)) + float(gap) * (1 + factor(c.size)), 0.0)
    radius = (left + math.sqrt(left**2 + 4 * least * square)) / (2 * least) * (1 + 8 * EPS)
    return float((D * (np.abs(c) + radius)).max())
