"""Bounds by which a point solves a problem with a large dense M or does not, from w = M z + q alone as far as they
decide.

The measure needs |M| |z| and the units of M, each of which takes longer than w. But the terms of row i lie between
|q|_i and |q|_i + max |M_ij| |z|_1, and the cap is at least |q|_i; mostly that leaves only a few rows, whose terms are
then computed. If no M_ij is 0, these rows and one with a violation v_j at z = 0 also give a lower bound on the caps, as
R is the inverse geometric mean of each row, up to a constant: c_i >= v_j R_j / R_i.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING, SMALLEST_NORMAL
from lcpcli.linalg.logarithms import mean_logarithms
from lcpcli.linalg.matrices import absolute_product, is_sparse
from lcpcli.linalg.rounding import row_errors
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector
from lcpcli.verify.measure import DROWNED, ROUNDING, Measure

MOST_ROWS = 0.25  # of all rows: for more of them, the whole of |M| |z| costs little more
CERTAIN = 0.99  # of a cap by means of logarithms, which round


def apply_to(problem: Problem) -> bool:
    """Return whether these bounds save time: for a dense M, if it is large, and a reference point 0."""
    return not is_sparse(problem.M) and problem.reference_z is None


def decision(measure: Measure, z: Vector, w: Vector, tol: float) -> bool | None:
    """Return whether the relative residual of an admissible z, with w = M z + q, is at most tol whatever the rounding
    errors in w are; None if these bounds do not decide."""
    problem = measure.data
    assert isinstance(problem, Problem)
    excess, own, sizes = problem.box.excess(z, w), np.abs(problem.q), np.abs(z)
    row = int(excess.argmax())
    if excess[row] > 2 * tol * own[row] and _fails(problem, sizes, excess[row], row, np.inf, tol):
        return False
    if _solves(problem, z, excess, own, sizes, tol):
        return True
    caps = measure.caps(z)
    row = int((excess / caps).argmax())
    return False if _fails(problem, sizes, excess[row], row, caps[row], tol) else None


def _fails(problem: Problem, sizes: Vector, excess: float, row: int, cap: float, tol: float) -> bool:
    """Return whether a row is violated by more than its own terms, at a point with these |z|, and its cap allow."""
    M = problem.M[row : row + 1]
    terms = np.abs(problem.q[row : row + 1]) + absolute_product(M, sizes)
    allowed = np.maximum(tol * np.minimum(terms, cap), ROUNDING * np.minimum(terms, DROWNED * cap))
    return bool((excess - row_errors(M, sizes, terms) > allowed).all())


def _solves(problem: Problem, z: Vector, excess: Vector, own: Vector, sizes: Vector, tol: float) -> bool:
    """Return whether the point solves the problem beyond doubt."""
    largest_error = ROW_ROUNDING * (own + problem.largest * float(sizes.sum())) + own.size * SMALLEST_NORMAL
    rows = (excess + largest_error > tol * own).nonzero()[0]
    if rows.size > MOST_ROWS * own.size:
        return False
    own, M = own[rows], problem.M[rows]
    terms = own + absolute_product(M, sizes)
    worst = excess[rows] + row_errors(M, z, terms)
    left = (worst > tol * own).nonzero()[0]
    if not left.size:
        return True
    worst, terms = worst[left], terms[left]
    if (worst > tol * terms).any() or not problem.M.all():
        return False
    return bool((worst <= tol * _least_caps(problem, rows[left])).all())


def _least_caps(problem: Problem, rows: Indices) -> Vector:
    """Return lower bounds on the caps of these rows, for M without zeros."""
    violations = np.maximum(problem.box.excess(problem.reference_point, problem.q), 0.0)
    worst = int(violations.argmax())
    logarithms = mean_logarithms(problem.M[[worst, *rows]])
    return np.asarray(CERTAIN * violations[worst] * np.exp2(logarithms[1:] - logarithms[0]))
