"""Krylov methods: conjugate gradients and BiCGSTAB, preconditioned; rough eigenvalues and semidefiniteness.

M. R. Hestenes and E. Stiefel, Methods of conjugate gradients for solving linear systems, Journal of Research of the
National Bureau of Standards 49 (1952) 409-436; H. A. van der Vorst, Bi-CGSTAB: a fast and smoothly converging variant
of Bi-CG, SIAM Journal on Scientific and Statistical Computing 13 (1992) 631-644. scipy has both, but takes its inner
products from the BLAS, whose threads synchronize at each of them: on a busy two-core machine this made a run ten times
slower (measured, 90,000 unknowns). Here they are computed by one thread, as products with a sparse M are.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np

from lcpcli.linalg.doubles import EPS, generator
from lcpcli.linalg.entries import row_parts
from lcpcli.linalg.factors import MOST_NUMPY_ROWS, SingularMatrix, definite_solver
from lcpcli.linalg.matrices import absolute_product, dense, is_symmetric, plus_diagonal, row_maxima, scaled
from lcpcli.linalg.units import half_power
from lcpcli.typing import Matrix, Vector

EIGENVALUE_STEPS = 8  # of power or inverse iteration from a random vector: enough for a factor 3 in an eigenvalue
# Times n: how far rounding may push eigenvalues of a semidefinite M with diagonal 1 below 0.
SEMIDEFINITE_ROUNDING = 10 * EPS
Operator = Callable[[Vector], Vector]


def dot(u: Vector, v: Vector) -> float:
    """Return u'v without BLAS."""
    return float(np.einsum("i,i->", u, v))


def norm(v: Vector) -> float:
    """Return |v|_2 without BLAS."""
    return float(np.sqrt(dot(v, v)))


def conjugate_residuals(A: Operator, b: Vector, steps: int) -> Vector:
    """Return a rough solution of A x = b, shape (n,), after a few steps of the generalized conjugate residual method,
    each of which takes one product with A and leaves the least |b - A x|_2 in its Krylov space.

    S. C. Eisenstat, H. C. Elman, M. H. Schultz, Variational iterative methods for nonsymmetric systems of linear
    equations, SIAM Journal on Numerical Analysis 20 (1983) 345-357.
    """
    x, r, spanned = np.zeros(b.size), b.copy(), list[tuple[Vector, Vector, float]]()
    for _ in range(steps):
        direction = r.copy()
        image = A(direction)
        for other, other_image, square in spanned:
            share = dot(image, other_image) / square
            direction -= share * other
            image -= share * other_image
        square = dot(image, image)
        if not 0.0 < square < np.inf:
            break
        length = dot(r, image) / square
        x += length * direction
        r -= length * image
        spanned.append((direction, image, square))
    return x


def conjugate_gradients(
    A: Operator, b: Vector, x: Vector, target: float | Vector, max_iterations: int, precondition: Operator
) -> tuple[Vector, float]:
    """Solve A x = b for symmetric positive definite A from x, shape (n,), until |b - A x|_2 <= target or, for a target
    of shape (n,), until |b - A x| <= target.

    A, precondition : products with A and with a symmetric positive definite approximate inverse; they return new
        arrays; precondition may return its argument. Return the last x, and the size of its residual by the recursion:
        its norm or, for a target of shape (n,), its largest component relative to that.
    """
    x = x.copy()
    r = b - A(x)
    measure, most = _measure(target)
    size = measure(r)
    direction, rho = np.zeros(b.size), 1.0
    for _ in range(max_iterations):
        if not size > most:
            break
        y = precondition(r)
        rho, previous = dot(r, y), rho
        for part in row_parts(r.size):
            direction[part] *= rho / previous
            direction[part] += y[part]
        image = A(direction)
        curvature = dot(direction, image)
        if not (curvature > 0 and rho > 0):
            break
        step = rho / curvature
        for part in row_parts(r.size):
            r[part] -= step * image[part]
            x[part] += step * direction[part]
        size = measure(r)
    return x, size


def _measure(target: float | Vector) -> tuple[Callable[[Vector], float], float]:
    """Return how the size of a residual is measured, and how large it may be."""
    if isinstance(target, np.ndarray):
        parts = [*row_parts(target.size)]
        return lambda r: float(np.max([(np.abs(r[part]) / target[part]).max() for part in parts], initial=0.0)), 1.0
    return norm, target


def bicgstab(
    A: Operator, b: Vector, x: Vector, target: float | Vector, max_iterations: int, precondition: Operator
) -> tuple[Vector, float]:
    """Solve A x = b for any nonsingular A, as `conjugate_gradients` does, with two products with A per iteration."""
    x = x.copy()
    r = b - A(x)
    measure, most = _measure(target)
    shadow, size = r.copy(), measure(r)
    direction, image = np.zeros(b.size), np.zeros(b.size)
    rho = alpha = omega = 1.0
    for _ in range(max_iterations):
        if not size > most:
            break
        rho, previous = dot(shadow, r), rho
        direction -= omega * image
        direction *= rho / previous * (alpha / omega)
        direction += r
        preconditioned = precondition(direction)
        image = A(preconditioned)
        curvature = dot(shadow, image)
        if curvature == 0 or rho == 0:
            break
        alpha = rho / curvature
        r -= alpha * image
        x += alpha * preconditioned
        preconditioned = precondition(r)
        change = A(preconditioned)
        square = dot(change, change)
        omega = dot(change, r) / square if square > 0 else 0.0
        x += omega * preconditioned
        r -= omega * change
        size = measure(r)
        if omega == 0:
            break
    return x, size


def identity(v: Any) -> Any:
    """Return v, in place of a preconditioner."""
    return v


def ends(M: Matrix) -> tuple[float, float] | None:
    """Return rough estimates of the extreme eigenvalues of a symmetric positive definite M; None for any other M."""
    solve = definite_solver(M)
    if solve is None:
        return None
    return float(1 / _rayleigh(solve, M.shape[0])), _rayleigh(lambda v: M @ v, M.shape[0])


def _rayleigh(product: Operator, n: int) -> float:
    """Return the Rayleigh quotient of a symmetric positive definite operator after EIGENVALUE_STEPS of power
    iteration."""
    v: Vector = generator(0).standard_normal(n)
    size = 0.0
    for _ in range(EIGENVALUE_STEPS):
        v /= norm(v)
        image = product(v)
        size = dot(v, image)
        v = image
    return size


@np.errstate(all="ignore")
def is_semidefinite(M: Matrix) -> bool:
    """Return whether v'Mv >= 0 for all v up to rounding: whether the symmetric part of M is positive semidefinite.

    Diagonal dominance settles the question without a factorization. Otherwise M is scaled to a diagonal of about 1
    first, so that the answer does not depend on units.
    """
    diagonal, n = M.diagonal(), M.shape[0]
    if diagonal.min(initial=0.0) < 0:
        return False
    M = M if is_symmetric(M) else (M + M.T) / 2
    maxima = row_maxima(M)
    if maxima[diagonal == 0].any():
        return False
    if (absolute_product(M, np.ones(n)) <= 2 * diagonal).all():
        return True
    used = maxima.nonzero()[0]
    if used.size < n:  # as for a program, where the rows of its multipliers are 0
        M, diagonal = M[used][:, used], diagonal[used]
    C = np.exp2(-half_power(diagonal))  # powers of two: M stays symmetric
    M = plus_diagonal(scaled(M, C, C), SEMIDEFINITE_ROUNDING * n)
    if used.size > MOST_NUMPY_ROWS:
        return definite_solver(M) is not None
    with suppress(SingularMatrix):
        np.linalg.cholesky(dense(M))
        return True
    return False
