"""Solutions that are right to the last digit, however badly conditioned M is: how to get one, and how to know one.

A complementary basis is solved with iterative refinement, whose residuals are computed as if in twice the precision
(N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, section 12.1): its solution is then
right to its last digits as long as its condition number is below about 1e15. Even so rounding z may leave a residual
that is not small at all. That such a z is the solution, rounded, is then shown in rational arithmetic, or not said.
"""

from __future__ import annotations

import math
from itertools import chain, pairwise

import numpy as np

from lcpcli import farkas, linalg, scaled
from lcpcli.accuracy import Accuracy
from lcpcli.linalg import SingularMatrix
from lcpcli.modulus import x_of
from lcpcli.principal import PrincipalSolver
from lcpcli.problem import Problem, is_sparse
from lcpcli.typing import Mask, Matrix, Vector

EPS = float(np.finfo(np.float64).eps)
REFINEMENTS = 10
SPLITTER = 2.0**27 + 1  # Dekker's, for a mantissa of 53 bits
NEARLY = 1e-6  # of the terms of a row: what is worth refining
LAST_DIGITS = 4 * EPS


@np.errstate(over="ignore", invalid="ignore")
def refined(problem: Problem, z: Vector, P: Mask | None = None) -> Vector:
    """The solution of the complementary basis of z, right to its last digits; z where that is no better.

    problem, z : n unknowns, and an approximate solution of shape (n,).
    P : the basis, shape (n,); by default where z is larger than w in units in which M is equilibrated.
    """
    units = scaled.scale(problem)
    within = units.problem
    z_scaled = z / units.C
    inside = np.flatnonzero(x_of(z_scaled, within.w(z_scaled)) > 0 if P is None else P)
    if not inside.size:
        return np.zeros_like(z)
    solver, b = PrincipalSolver(within.M), -within.q[inside]
    block = solver.block(inside)
    try:
        solve = solver.factorized(block)
    except SingularMatrix:
        return z
    values = solve(b)
    try:
        for _ in range(REFINEMENTS):
            change = solve(accurate_residual(block, values, b))
            values += change
            if not np.abs(change).max() > EPS * np.abs(values).max():
                break
    except (OverflowError, ValueError):
        return z
    better = np.zeros_like(z)
    better[inside] = np.maximum(values, 0) * units.C[inside]
    if not np.isfinite(better).all():
        return z
    accuracy = Accuracy(problem)
    as_good = accuracy.relative_residual(better, accuracy.w(better)) <= 2 * accuracy.relative_residual(z, accuracy.w(z))
    return better if as_good or _at_rounding(problem, better) else z


def accurate_residual(A: Matrix, x: Vector, b: Vector) -> Vector:
    """b - A x for A of shape (m, n), dense or in compressed sparse rows, rounded once (barring under- and overflow).

    Every product is split into its rounded value and its error (Dekker 1971), and math.fsum adds them up exactly.
    """
    if is_sparse(A):
        terms, errors = _products(A.data, x[A.indices])
        rows = [slice(start, stop) for start, stop in pairwise(A.indptr.tolist())]
        sums = [
            math.fsum(chain((value,), terms[row], errors[row])) for value, row in zip(b.tolist(), rows, strict=True)
        ]
    else:
        sums = [math.fsum(chain((value,), *_products(row, x))) for value, row in zip(b.tolist(), A, strict=True)]
    return np.array(sums)


def _products(a: Vector, x: Vector) -> tuple[list[float], list[float]]:
    """Two lists that add up to -a_i x_i, entry by entry and without an error."""
    terms = a * x
    a_high, a_low = _split(a)
    x_high, x_low = _split(x)
    errors = a_low * x_low - (((terms - a_high * x_high) - a_low * x_high) - a_high * x_low)
    return (-terms).tolist(), (-errors).tolist()


def _split(v: Vector) -> tuple[Vector, Vector]:
    """v as the sum of two vectors of 26 bits each."""
    large = SPLITTER * v
    high = large - (large - v)
    return high, v - high


def _at_rounding(problem: Problem, z: Vector) -> bool:
    """Whether what is left of min(z, w) is what rounding z to double precision leaves."""
    size = linalg.absolute_product(problem.M, z) + np.abs(problem.q)
    return bool((np.abs(np.minimum(z, problem.w(z))) <= 4 * EPS * size).all())


@np.errstate(over="ignore", invalid="ignore")
def is_near(problem: Problem, z: Vector) -> bool:
    """Whether z >= 0, of shape (n,), solves a problem with nearly the numbers of M and q: worth a closer look."""
    w, size = problem.w(z), linalg.absolute_product(problem.M, z) + np.abs(problem.q)
    return bool(z.any() and (np.where(z > 0, np.abs(w), -w) <= NEARLY * size).all())


def is_rounded_solution(problem: Problem, z: Vector) -> bool:
    """Whether z, of shape (n,), is a solution but for its last digits, as rational arithmetic shows.

    The exact solution z* of M_PP z*_P = -q_P for P = {z_i > 0} is positive and has w* >= 0, and no component of z
    differs from it by more than LAST_DIGITS of itself. So it never says yes of a problem that has no solution. It says
    no where P is larger than `farkas.SIDE`, or M_PP is singular.
    """
    if np.count_nonzero(z > 0) > farkas.SIDE or not np.isfinite(z).all() or not is_near(problem, z):
        return False
    from fractions import Fraction

    from lcpcli.basis import exact_basis

    found = exact_basis(problem.M, problem.q, z > 0)
    if found is None or not (found.unique and found.solves):
        return False
    last_digits = Fraction(LAST_DIGITS)
    return all(abs(Fraction(a) - b) <= last_digits * b for a, b in zip(z.tolist(), found.z, strict=True))
