"""Preconditioned Krylov methods (conjugate gradients, BiCGSTAB, GMRES), rough estimates
of extreme eigenvalues, and a test of positive semidefiniteness.

M. R. Hestenes and E. Stiefel, Methods of conjugate gradients for solving linear
systems, Journal of Research of the National Bureau of Standards 49 (1952) 409-436; H.
A. van der Vorst, Bi-CGSTAB: a fast and smoothly converging variant of Bi-CG, SIAM
Journal on Scientific and Statistical Computing 13 (1992) 631-644. scipy has both, but
computes inner products with the BLAS, whose threads synchronize at each of them: on a
busy machine with two processors this made a run ten times slower (measured with 90,000
unknowns). Here inner products are computed by one thread, as products with a sparse M
are.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from lcpcli.linalg.doubles import EPS, generator
from lcpcli.linalg.factors import MAX_NUMPY_ROWS, SingularMatrix, definite_solver
from lcpcli.linalg.matrices import (
    absolute_product,
    dense,
    is_symmetric,
    plus_diagonal,
    row_maxima,
    row_parts,
    scaled,
)
from lcpcli.typing import Matrix, Vector

# Steps of power or inverse iteration from a random vector: they estimate an extreme
# eigenvalue to a factor of 3.
EIGENVALUE_STEPS = 8
# Length of an inner product up to which OpenBLAS uses one thread.
MAX_IN_ONE_THREAD = 10_000
# Rounding moves the eigenvalues of a positive semidefinite M with diagonal 1 by at most
# n times this below 0.
SEMIDEFINITE_ROUNDING = 10 * EPS
Operator = Callable[[Vector], Vector]
Measure = Callable[[Vector], float]


def dot(u: Vector, v: Vector) -> float:
    """Return u'v, by one thread alone."""
    return float(u.dot(v) if u.size <= MAX_IN_ONE_THREAD else np.einsum("i,i->", u, v))


def norm(v: Vector) -> float:
    """Return |v|_2, by one thread alone."""
    return float(np.sqrt(dot(v, v)))


def safe_norm(v: Vector) -> float:
    """Return |v|_2 without overflow or underflow, by one thread alone."""
    largest = float(np.abs(v).max(initial=0.0))
    return largest * norm(v / largest) if 0 < largest < np.inf else largest


def gmres(
    A: Operator,
    b: Vector,
    steps: int,
    precondition: Operator = np.copy,
    enough: float = 0.0,
) -> Vector:
    """Return an approximate solution of A x = b, shape (n,), by at most `steps` steps
    of GMRES from 0. Each takes one product with A, and minimizes |b - A x|_2 over its
    Krylov space; the iteration stops once that norm is at most `enough`.

    H. F. Walker and L. Zhou, A simpler GMRES, Numerical Linear Algebra with
    Applications 1 (1994) 571-581.

    precondition : an approximate inverse of A; it returns new arrays.
    """
    x = np.zeros(b.size)
    r = b.copy()
    last = b
    spanned = list[tuple[Vector, Vector]]()
    for _ in range(steps):
        direction = precondition(last)
        image = A(direction)
        # Gram-Schmidt orthogonalization, twice against loss of orthogonality by
        # rounding
        for other, other_image in 2 * spanned:
            component = dot(image, other_image)
            direction -= component * other
            image -= component * other_image
        size = norm(image)
        if not 0.0 < size < np.inf:
            break
        direction /= size
        image /= size
        length = dot(r, image)
        x += length * direction
        r -= length * image
        if norm(r) <= enough:
            break
        spanned.append((direction, image))
        last = image
    return x


class StoppingCriterion(NamedTuple):
    """An iteration for A x = b stops when the residual b - A x is at most
    `max_residual` in this measure, or after `max_iterations`.
    """

    max_residual: float
    max_iterations: int
    measure: Measure = norm


def conjugate_gradients(
    A: Operator,
    b: Vector,
    x: Vector,
    stopping: StoppingCriterion,
    precondition: Operator,
) -> tuple[Vector, float]:
    """Solve A x = b for a symmetric positive definite A by conjugate gradients from x,
    shape (n,). Returns the last x, and the size of its residual as updated by the
    recursion.

    A, precondition : products with A and with a symmetric positive definite approximate
        inverse; they return new arrays; precondition may return its argument.
    """
    max_residual, max_iterations, measure = stopping
    x = x.copy()
    r = b - A(x) if np.count_nonzero(x) else b.copy()
    size = measure(r)
    direction, rho = np.zeros(b.size), 1.0
    views = [(rows, r[rows], x[rows], direction[rows]) for rows in row_parts(b.size)]
    for _ in range(max_iterations):
        if not size > max_residual:
            break
        y = precondition(r)
        rho, previous = dot(r, y), rho
        for rows, _, _, direction_part in views:
            direction_part *= rho / previous
            direction_part += y[rows]
        image = A(direction)
        curvature = dot(direction, image)
        if not (curvature > 0 and rho > 0):
            break
        step = rho / curvature
        for rows, r_part, x_part, direction_part in views:
            r_part -= step * image[rows]
            x_part += step * direction_part
        size = measure(r)
    return x, size


def relative_to(target: Vector) -> Measure:
    """Return a function that measures a residual r by max |r_i| / target_i."""
    row_slices = [*row_parts(target.size)]
    return lambda r: float(
        np.max(
            [(np.abs(r[rows]) / target[rows]).max() for rows in row_slices], initial=0.0
        )
    )


def bicgstab(
    A: Operator,
    b: Vector,
    x: Vector,
    stopping: StoppingCriterion,
    precondition: Operator,
) -> tuple[Vector, float]:
    """Solve A x = b for a nonsingular A by BiCGSTAB, with two products with A per
    iteration; parameters and return values are those of `conjugate_gradients`.
    """
    max_residual, max_iterations, measure = stopping
    x = x.copy()
    r = b - A(x) if np.count_nonzero(x) else b.copy()
    shadow, size = r.copy(), measure(r)
    direction, image = np.zeros(b.size), np.zeros(b.size)
    rho = alpha = omega = 1.0
    for _ in range(max_iterations):
        if not size > max_residual:
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
    """Return v, as the preconditioner that does nothing."""
    return v


def extreme_eigenvalues(M: Matrix) -> tuple[float, float] | None:
    """Return rough estimates of the smallest and the largest eigenvalue of a symmetric
    positive definite M; None for any other M.
    """
    solve = definite_solver(M)
    if solve is None:
        return None
    return float(1 / _rayleigh(solve, M.shape[0])), _rayleigh(
        lambda v: M @ v, M.shape[0]
    )


def _rayleigh(product: Operator, n: int) -> float:
    """Return the Rayleigh quotient of a symmetric positive definite operator after
    EIGENVALUE_STEPS of power iteration.
    """
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
    """Return whether v'Mv >= 0 for all v up to rounding: whether the symmetric part of
    M is positive semidefinite.

    A diagonally dominant M is semidefinite by Gershgorin's theorem, without a
    factorization. Otherwise M is first scaled to a diagonal of about 1, so that the
    answer does not depend on the scaling of the data.
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
    if used.size < n:  # as in a program, where the rows of the multipliers are 0
        M, diagonal = M[used][:, used], diagonal[used]
    C = np.exp2(-np.rint(0.5 * np.log2(diagonal)))  # powers of two: M stays symmetric
    M = plus_diagonal(scaled(M, C, C), SEMIDEFINITE_ROUNDING * n)
    if used.size > MAX_NUMPY_ROWS:
        return definite_solver(M) is not None
    with suppress(SingularMatrix):
        np.linalg.cholesky(dense(M))
        return True
    return False
