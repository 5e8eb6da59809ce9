"""Exact solutions of linear systems close to floating-point ones, proved to exist in
floating-point arithmetic with bounds on the rounding errors.

If R is an approximate inverse of B with |I - R B| <= a < 1 in the maximum norm, B is
nonsingular, and the c with B c = -g has |c| <= |R g| + a |c|: S. M. Rump, Verification
methods: rigorous results using floating-point arithmetic, Acta Numerica 19 (2010)
287-449, section 10. For proofs that a linear program is infeasible: C. Keil and C.
Jansson, Computational experience with rigorous error bounds for the Netlib linear
programming library, Reliable Computing 12 (2006) 303-321.

For a solution z* close to a z, with the basic variables B of z and the others at their
bounds, M_BB z*_B = -(q + M z_N)_B has a unique solution if M_BB is nonsingular. One
correction of z_B, stored separately as z_B plus the correction may not be
representable, leaves a small residual g. An M_BB without positive entries off its
diagonal has a nonnegative inverse if some v > 0 has M_BB v > 0 (A. Berman and R. J.
Plemmons, Nonnegative Matrices in the Mathematical Sciences, 1979, theorem 6.2.3); the
correction then has an error of at most t v if |g| <= t M_BB v. Any other M_BB needs an
approximate inverse. If the signs of z*_B and w*_N are right within these bounds, z*
solves the problem.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING, SMALLEST_NORMAL
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import (
    TINY_TERMS,
    absolute_product,
    accurate_residual,
    dense,
    is_sparse,
    may_be_stiff,
    product,
)
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Matrix, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS

if TYPE_CHECKING:
    from lcpcli.verify.definite_enclosure import Enclosed

# Limits on the equations, and on their square times the unknowns: about a second.
LARGEST_ENCLOSED, MAX_WORK = 1000, 2e9
# If the last pivot is below this times the first one, the equations may be dependent.
DEPENDENT = 1e-10


def is_enclosable(equations: int, unknowns: int) -> bool:
    """Return whether a system of this size is small enough for an enclosure, which then
    takes at most about a second.
    """
    return (
        equations <= min(unknowns, LARGEST_ENCLOSED)
        and equations**2 * unknowns <= MAX_WORK
    )


@np.errstate(all="ignore")
def enclosure(G: Vector, y: Vector) -> Vector | None:
    """Return d >= 0, such that some y' with |y' - y| <= d has G y' = 0 exactly; None if
    that is not proved.

    G : dense, of shape (k, n). Only k entries of y change, preferably large ones.
    """
    d = np.zeros(y.size)
    if not G.shape[0]:
        return d
    if not is_enclosable(*G.shape) or not np.isfinite(G).all():
        return None
    rows, columns = _units(np.abs(G).max(axis=1)), 1 / _units(np.abs(y))
    # rows and columns are powers of two, so that nothing is rounded.
    G = rows[:, np.newaxis] * G * columns
    with imports:
        from scipy.linalg import qr
    R, order = qr(G, mode="r", pivoting=True, check_finite=False)
    pivots = np.abs(R.diagonal())
    chosen = order[: G.shape[0]]
    scaled = y / columns
    if not pivots[-1] > DEPENDENT * pivots[0]:
        return None
    rounding = 4 * (y.size + 2) * (EPS * (np.abs(G) @ np.abs(scaled)) + SMALLEST_NORMAL)
    d[chosen] = (
        regular_change(G[:, chosen], np.abs(G @ scaled) + rounding) * columns[chosen]
    )
    return d if np.isfinite(d).all() else None


def _units(sizes: Vector) -> Vector:
    """Return the powers of two that make sizes about 1; 1 where they are 0."""
    exponents = np.where(sizes > 0, -np.frexp(sizes)[1], 0)
    return np.asarray(np.ldexp(1.0, np.clip(exponents, -1000, 1000)))


def regular_change(B: Vector, size: Vector) -> Vector:
    """Return a bound on |c| for B c = -g with |g| <= size, whatever the rounding
    errors; infinite if B is not proved to be nonsingular. The function is compiled as
    well.
    """
    k = size.size
    try:
        R = np.ascontiguousarray(np.linalg.inv(B))
    except Exception:  # numba catches no other: B is singular
        return np.full(k, np.inf)
    absolute, rounding = np.abs(R), 4 * (k + 2)
    errors = np.abs(np.dot(R, B) - np.eye(k))
    errors += (rounding * EPS) * np.dot(absolute, np.abs(B))
    a = 2.0 * (errors.sum(axis=1).max() + rounding * k * SMALLEST_NORMAL)
    change: Vector = 2.0 * (np.dot(absolute, size) + rounding * SMALLEST_NORMAL)
    return change + 2.0 * a * change.max() if a < 0.5 else np.full(k, np.inf)


def open_signs(M: Vector, q: Vector, B: Indices, z: Vector, digits: float) -> Mask:
    """Return where rounding errors may hide the sign of w_i for the exact solution with
    the basic variables B of z >= 0, of an LCP with dense M. All entries are True if
    that solution is not proved to exist within a relative distance `digits` of each
    z_i. It uses floating-point arithmetic only, and is compiled as well.
    """
    w, terms = M @ z + q, np.abs(M) @ z + np.abs(q)
    is_plain = terms.min() > TINY_TERMS or ((terms > TINY_TERMS) | (terms == 0.0)).all()
    if not (is_plain and terms.max() < np.inf):
        return np.ones(q.size, np.bool_)
    violations, errors = np.abs(w[B]), ROW_ROUNDING * terms
    w[B] = np.inf
    return are_open(M[B][:, B] * z[B], violations + errors[B], w, terms, digits)


def are_open(
    scaled: Vector, residual: Vector, w: Vector, terms: Vector, digits: float
) -> Mask:
    """Return `open_signs` for rows that are known, with w infinite where basic.

    scaled : M_BB diag(z_B). residual : bounds on |w_B|. terms : |M| |z| + |q|.
    """
    change = regular_change(scaled, residual).max() if residual.size else 0.0
    if not change <= digits:
        return np.ones(w.size, np.bool_)
    is_open: Mask = w < (ROW_ROUNDING + 2.0 * change) * terms
    return is_open


TOO_LARGE = (
    "no rigorous bounds are computed for its {} basic variables (the limit is "
    f"{LARGEST_ENCLOSED})"
)
SINGULAR = "the matrix of its basic variables is not proved to be nonsingular"
WIDE = "rounding of this system changes z by more than the tolerance"
SIGNS = "rounding decides the sign of component {}"


@np.errstate(all="ignore")
def why_unproved(problem: Problem, z: Vector, tol: float, rounding: float = 0.0) -> str:
    """Return why no solution is proved to exist that has the basis of z, shape (n,) and
    within its bounds, and differs from it by at most tol in each component, relative to
    both |z_i| and its distance from the reference point; "" if one is.

    rounding : as in `distances`.
    """
    distance = np.minimum(np.abs(z), np.abs(problem.from_reference(z)))
    return distances(problem, z, rounding, tol * distance)[1]


@np.errstate(all="ignore")
def distances(
    problem: Problem,
    z: Vector,
    rounding: float = 0.0,
    largest: Vector | float = np.inf,
) -> tuple[Vector, str]:
    """Return bounds on the distances of z, shape (n,) and within its bounds, from the
    basic solution of its basis; and why that is not proved to be a solution within the
    distances `largest`, "" if it is.

    rounding : if it is not 0, a solution is proved to exist for all problems whose
        entries of M and q differ by at most this, relatively; this is possible only if
        M_BB has no positive entries off its diagonal.
    largest : the largest distances allowed.
    """
    if may_be_stiff(problem.M) and not rounding:
        with imports:
            from lcpcli.verify.definite_enclosure import enclosed
        solution = enclosed(problem, problem.box.basis_at(z))
        if solution is not None:
            return _distances_from(problem, z, largest, solution)
    basis, M = problem.box.basis_at(z), problem.M
    B, change = (basis == BASIC).nonzero()[0], np.zeros(problem.n)
    w = -accurate_residual(M, z, -problem.q)
    terms = absolute_product(M, np.abs(z)) + np.abs(problem.q)
    error = (
        4 * EPS * np.abs(w)
        + ((2 * _width(M) * EPS) ** 2 + rounding) * terms
        + _underflow(M, z)
    )
    if B.size:
        solver = PrincipalSolver(M)
        block = solver.block(B)
        try:
            correction = solver.factorized(block)(-w[B])
        except (SingularMatrix, OverflowError, ValueError):
            return change + np.inf, SINGULAR
        residual = w[B] + product(block, correction)
        sizes = np.abs(w[B]) + absolute_product(block, np.abs(correction))
        bound = (
            np.abs(residual)
            + error[B]
            + (2 * _width(M) * EPS + rounding) * sizes
            + _underflow(block, correction)
        )
        change[B] = np.abs(correction) + _change(
            block, terms[B], np.abs(z[B]), bound, rounding
        )
        if not np.isfinite(change).all():
            is_small_enough = B.size <= LARGEST_ENCLOSED
            return change, SINGULAR if is_small_enough else TOO_LARGE.format(B.size)
    if (change > largest).any():
        return change, WIDE
    low, high = problem.box.vectors(problem.n)
    error += 2 * absolute_product(M, change) + _underflow(M, change)
    wrong = np.where(basis == LOWER, w < error, (basis == UPPER) & (-w < error)) & (
        low < high
    )
    wrong |= (basis == BASIC) & ~((z - low > change) & (high - z > change))
    if not wrong.any() or (
        problem.n <= FEW_UNKNOWNS
        and not wrong[B].any()
        and _repeat(problem, z, wrong, B)
    ):
        return change, ""
    return change, SIGNS.format(int(wrong.argmax()) + 1)


def is_stable(problem: Problem, z: Vector) -> bool:
    """Return whether there is a solution for all entries of M and q that differ by n
    EPS, relatively, from those of a problem with an exact solution close to z. A proof
    of infeasibility up to rounding would be one for such entries.
    """
    if is_surely_definite(problem):
        return True
    return not why_unproved(problem, z, np.inf, problem.n * EPS)


def is_surely_definite(problem: Problem) -> bool:
    """Return whether M + M' of a narrow band is proved to be positive definite for all
    entries that are rounded to those of M: each such problem then has a solution.
    """
    if not may_be_stiff(problem.M):
        return False
    with imports:
        from lcpcli.verify.definite_enclosure import is_definite
    return is_definite(problem, EPS)


def _distances_from(
    problem: Problem, z: Vector, largest: Vector | float, solution: Enclosed
) -> tuple[Vector, str]:
    """Return the distances and the reason of `distances` for an enclosed basic solution
    of the basis of z.
    """
    box, basis = problem.box, problem.box.basis_at(z)
    moved = np.abs((solution.z - z).high) * (1 + EPS) + solution.z_error
    if (moved > largest).any():
        return moved, WIDE
    low, high = (np.where(np.isfinite(v), v, 0.0) for v in box.vectors(problem.n))
    has_low, has_high = (np.isfinite(v) for v in box.vectors(problem.n))
    basic = basis == BASIC
    wrong = np.where(basis == LOWER, solution.w < solution.w_error, False)
    wrong |= (basis == UPPER) & (-solution.w < solution.w_error)
    wrong &= ~box.fixed
    # z and the bounds are subtracted in double-double arithmetic.
    error = 2 * solution.z_error + EPS**1.9 * np.abs(z)
    wrong |= basic & has_low & ~((solution.z - low).high > error)
    wrong |= basic & has_high & ~((solution.z - high).high < -error)
    return moved, SIGNS.format(int(wrong.argmax()) + 1) if wrong.any() else ""


def _repeat(problem: Problem, z: Vector, rows: Mask, others: Indices) -> bool:
    """Return whether each of these rows equals plus or minus one of the basic rows
    `others` in the columns in which z is not 0, and in q: w is then exactly 0 there, as
    in the basic row.
    """
    M = np.column_stack((dense(problem.M)[:, z != 0], problem.q))
    known_rows = np.concatenate((M[others], -M[others]))
    return all((known_rows == row).all(axis=1).any() for row in M[rows])


def _change(
    block: Matrix, terms: Vector, sizes: Vector, bound: Vector, rounding: float
) -> Vector:
    """Return a bound on |c| for M_BB c = -g, |g| <= bound, and for all M_BB with
    entries that differ by at most `rounding`, relatively; infinite if none is proved.

    terms, sizes : (|M| |z| + |q|)_B and |z_B|, by which the rows and the unknowns are
        scaled; the bound holds for any others too, but may be larger.
    """
    if matrices.has_no_positive_links(block):
        with suppress(SingularMatrix, OverflowError, ValueError):
            v = np.abs(PrincipalSolver(block).factorized(block)(terms))
            image = product(block, v) - _underflow(block, v)
            image -= (2 * _width(block) * EPS + rounding) * absolute_product(block, v)
            if (v > 0).all() and (image > 0).all():
                return 2 * float((bound / image).max()) * v
    if block.shape[0] <= LARGEST_ENCLOSED and not rounding:
        R, C = (np.exp2(np.rint(np.log2(each))) for each in (1 / terms, sizes))
        B = dense(block)
        scaled = R[:, np.newaxis] * B * C
        if np.isfinite(scaled).all() and np.array_equal(
            scaled / R[:, np.newaxis] / C, B
        ):
            return 2 * regular_change(scaled, 2 * R * bound) * C
    return np.full(terms.size, np.inf)


def _width(M: Matrix) -> int:
    """Return an upper bound on the number of terms in a row of M z, plus 4 for other
    operations.
    """
    max_terms = int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else M.shape[1]
    return max_terms + 4


def _underflow(M: Matrix, z: Vector) -> Vector | float:
    """Return a bound on the error by underflow of products in each row of M z."""
    return (
        4 * SMALLEST_NORMAL * matrices.products(M, z)
        if matrices.may_underflow(M, z)
        else 0.0
    )
