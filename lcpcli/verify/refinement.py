"""Solutions that are correct to the last digit for ill-conditioned M: their computation and their recognition.

The system of a complementary basis is solved with iterative refinement, with residuals as if in twice the precision
(N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, section 12.1). Even so, rounding z
may leave a residual that is not small. That such a z is the rounded solution is proved in rational arithmetic.
"""

from __future__ import annotations

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.accurate import accurate_residual
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.model import changes
from lcpcli.model.box import BASIC
from lcpcli.model.changes import shifted
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector
from lcpcli.verify import farkas
from lcpcli.verify.basic_solution import BasicSolutions
from lcpcli.verify.measure import Measure
from lcpcli.verify.point import Criterion, Point

REFINEMENTS = 10  # with residuals in twice the precision: a digit or more each, unless M_BB is singular in doubles
LAST_DIGITS = 4 * EPS  # relative: what rounding of a number and of a product may change


@np.errstate(all="ignore")
def refined(problem: Problem, z: Vector, basis: States | None = None) -> Vector:
    """Return the basic solution of a basis, by default the basis of z when M is equilibrated, correct to its last
    digits; or z, an approximate solution of shape (n,), if that is not better."""
    units = changes.scale(problem)
    within = units.problem
    if basis is None:
        z_scaled = units.z_inside(z)
        basis = within.box.basis_at(z_scaled, within.w(z_scaled))
    better, active = problem.box.nonbasic(basis), np.flatnonzero(basis == BASIC)
    if not active.size:
        return better
    solver, b = PrincipalSolver(within.M), -within.q[active]
    if better.any():
        b = accurate_residual(within.M[active], units.z_inside(better), b)
    block = solver.block(active)
    try:
        solve = solver.factorized(block)
        values = solve(b)
        for _ in range(REFINEMENTS):
            change = solve(accurate_residual(block, values, b))
            values += change
            if not np.abs(change).max() > EPS * np.abs(values).max():
                break
    except (SingularMatrix, OverflowError, ValueError):
        return z
    basic = np.zeros(problem.n)
    basic[active] = values
    better[active] = units.z_outside(basic)[active]
    better = problem.box.project(better)
    if not np.isfinite(better).all():
        return z
    criterion = Criterion(problem)
    if Point(criterion, better).relative_residual <= 2 * Point(criterion, z).relative_residual:
        return better
    terms = matrices.absolute_product(problem.M, np.abs(better)) + np.abs(problem.q)
    gaps = np.abs(problem.box.gaps(better, problem.w(better)))
    return better if (gaps <= LAST_DIGITS * terms).all() else z  # as small as rounding z allows


def is_rounded_solution(problem: Problem, z: Vector) -> bool:
    """Return whether z, of shape (n,), is a solution up to its last digits, by rational arithmetic: the exact basic
    solution of its states solves the problem, and no component of z differs from it by more than LAST_DIGITS of itself.
    So the answer is never true where there is no solution; it is false if more than `farkas.most_exact()` variables
    are basic."""
    basis = problem.box.basis_at(z)
    if np.count_nonzero(basis == BASIC) > farkas.most_exact() or not np.isfinite(z).all():
        return False
    if not Point(Criterion(problem), z).nearly_solves():
        return False
    with imports:
        from fractions import Fraction

        from lcpcli.verify.exact_solution import exact_basis
    found = exact_basis(problem.M, problem.q, basis, problem.box)
    if found is None or not (found.unique and found.solves):
        return False
    last_digits = Fraction(LAST_DIGITS)
    return all(abs(Fraction(a) - b) <= last_digits * abs(b) for a, b in zip(z.tolist(), found.z, strict=True))


@np.errstate(all="ignore")
def is_rounded_difference(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether z is, up to its last digits, a point with a relative residual of at most tol that has more digits.

    Such a point is represented by the reference point and a difference from it that is no larger than z: with bounds
    far from 0, any z in doubles may have a larger residual. There is no such point if the reference point is 0.
    """
    reference_z = problem.reference_z
    if reference_z is None or not problem.is_moderate:
        return False
    frame = shifted(problem).problem
    try:
        distance = frame.box.project(BasicSolutions(frame).at(problem.box.basis_at(z)).z)
    except SingularMatrix:
        return False
    if (np.abs(distance) > np.abs(z)).any() or (np.abs(reference_z + distance - z) > LAST_DIGITS * np.abs(z)).any():
        return False
    measure = Measure(problem)
    return bool(measure.surely_solves(z, measure.rows_from_reference(distance, measure.rows(z).full_terms), tol))
