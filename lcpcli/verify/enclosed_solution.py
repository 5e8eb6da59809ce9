"""Solutions that are proved to exist near a z, by one system with its states in doubles and bounds on their rounding.

With the basic variables B of z and the others at their bounds, M_BB z*_B = -(q + M z_N)_B has one solution if M_BB is
regular. One correction of z_B, kept apart from it as doubles near z_B may not hold it, leaves a small residual g. An
M_BB without positive entries off its diagonal has a nonnegative inverse if some v > 0 has M_BB v > 0 (A. Berman and
R. J. Plemmons, Nonnegative Matrices in the Mathematical Sciences, 1979, theorem 6.2.3); then the correction is off by
at most t v if |g| <= t M_BB v, whatever the number of unknowns. Any other M_BB takes an approximate inverse (see
`enclosure`). If the signs of z*_B and w*_N are right for all numbers within these bounds, z* solves the problem.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from lcpcli.linalg.accurate import accurate_residual
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import absolute_product, dense, has_no_positive_links, is_sparse, product
from lcpcli.linalg.rounding import may_underflow, products
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.enclosure import LARGEST_ENCLOSED, regular_change

TOO_LARGE = f"its {{}} basic variables are more than the {LARGEST_ENCLOSED} of a system that is enclosed"
SINGULAR = "the matrix of its basic variables is not shown to be regular"
WIDE = "rounding of this system changes z by more than the tolerance"
SIGNS = "rounding decides the sign of component {}"


@np.errstate(all="ignore")
def fault(problem: Problem, z: Vector, tol: float, rounding: float = 0.0) -> str:
    """Return why no solution is shown to exist that has the states of an admissible z, shape (n,), and differs from it
    by at most tol in each component, relative to z_i and to its distance from the reference point; "" if one is.

    rounding : of the entries of M and q, relative: one is shown to exist for all problems whose entries differ by so
        much; if it is not 0, only for an M_BB without positive entries off its diagonal.
    """
    basis, M = problem.box.basis_at(z), problem.M
    B, change = (basis == BASIC).nonzero()[0], np.zeros(problem.n)
    w = -accurate_residual(M, z, -problem.q)
    terms = absolute_product(M, np.abs(z)) + np.abs(problem.q)
    error = 4 * EPS * np.abs(w) + ((2 * _width(M) * EPS) ** 2 + rounding) * terms + _underflow(M, z)
    if B.size:
        solver = PrincipalSolver(M)
        block = solver.block(B)
        try:
            correction = solver.factorized(block)(-w[B])
        except (SingularMatrix, OverflowError, ValueError):
            return SINGULAR
        left, sizes = w[B] + product(block, correction), np.abs(w[B]) + absolute_product(block, np.abs(correction))
        bound = np.abs(left) + error[B] + (2 * _width(M) * EPS + rounding) * sizes + _underflow(block, correction)
        change[B] = np.abs(correction) + _change(block, terms[B], np.abs(z[B]), bound, rounding)
        if not np.isfinite(change).all():
            return SINGULAR if B.size <= LARGEST_ENCLOSED else TOO_LARGE.format(B.size)
    distance = np.minimum(np.abs(z), np.abs(problem.from_reference(z)))
    if (change > tol * distance).any():
        return WIDE
    low, high = problem.box.vectors(problem.n)
    error += 2 * absolute_product(M, change) + _underflow(M, change)
    wrong = np.where(basis == LOWER, w < error, (basis == UPPER) & (-w < error)) & (low < high)
    wrong |= (basis == BASIC) & ~((z - low > change) & (high - z > change))
    return SIGNS.format(int(wrong.argmax()) + 1) if wrong.any() else ""


def _change(block: Matrix, terms: Vector, sizes: Vector, bound: Vector, rounding: float) -> Vector:
    """Return a bound on |c| for M_BB c = -g, |g| <= bound, whatever the rounding of M_BB; infinite if none is found.
    terms, sizes : those of rows and columns of M_BB."""
    if has_no_positive_links(block):
        with suppress(SingularMatrix, OverflowError, ValueError):
            v = np.abs(PrincipalSolver(block).factorized(block)(terms))
            image = product(block, v) - _underflow(block, v)
            image -= (2 * _width(block) * EPS + rounding) * absolute_product(block, v)
            if (v > 0).all() and (image > 0).all():
                return 2 * float((bound / image).max()) * v
    nothing = np.full(terms.size, np.inf)
    if block.shape[0] > LARGEST_ENCLOSED or rounding:
        return nothing
    R, C = (np.exp2(np.rint(np.log2(each))) for each in (1 / terms, sizes))
    B = dense(block)
    scaled = R[:, np.newaxis] * B * C
    is_exact = np.isfinite(scaled).all() and np.array_equal(scaled / R[:, np.newaxis] / C, B)
    return 2 * regular_change(scaled, 2 * R * bound) * C if is_exact else nothing


def _width(M: Matrix) -> int:
    """Return an upper bound on the terms that a row of M adds up, and a few more."""
    most = int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else M.shape[1]
    return most + 4


def _underflow(M: Matrix, z: Vector) -> Vector | float:
    """Return how much products that underflow may leave of each row of M z."""
    return 4 * SMALLEST_NORMAL * products(M, z) if may_underflow(M, z) else 0.0
