"""The exact solution of a complementary basis suggested by an approximate solution.

With P = {i : z_i > 0}, M_PP z_P = -q_P is solved in rational arithmetic, and the signs
are checked. If P is almost right, indices that violate them are flipped as in block
principal pivoting (`basis.exchanges`). If M_PP is singular, a linear program computes a
vertex of the solutions with that set.

In double precision, such a system is solved by iterative refinement with residuals in
twice the precision (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd
ed., SIAM 2002, section 12.1). Even then, rounding z to double precision may leave a
residual that is not small. Rational arithmetic proves that such a z is the rounded
solution.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, ROUNDING, SMALLEST_NORMAL, distinct
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import accurate_residual, may_be_stiff
from lcpcli.linalg.programs import minimized
from lcpcli.linalg.units import equilibrate
from lcpcli.model import changes
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.model.changes import scale, shifted
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, gap
from lcpcli.rational.numbers import over_one_denominator, rounded, zeros
from lcpcli.rational.written import are_computed, are_same, as_written
from lcpcli.typing import BasisStatus, Indices, Vector
from lcpcli.verify import farkas
from lcpcli.verify.farkas import ACTIVE_COLUMN
from lcpcli.verify.measure import Measure
from lcpcli.verify.point import Criterion, Point

# Steps of exact pivoting from each basis: a few suffice if it is almost right.
MAX_EXACT_STEPS = 30
# Limit on the linear program, in seconds that its iterations usually take.
VERTEX_EFFORT = 2.0
MAX_SOLVED_EXACTLY = 700  # basic variables: a minute at worst


def from_point(
    data: ExactProblem,
    z: Vector,
    effort: Effort | None = None,
    max_basic: int = MAX_SOLVED_EXACTLY,
) -> list[Fraction] | None:
    """Return the exact solution with the complementary basis of an approximate z, shape
    (n,), or with one that pivoting from it leads to; None if this effort is not enough,
    or more than `max_basic` variables are basic.
    """
    effort = effort or Effort()
    for basis in _bases(data.problem, z):
        if (solution := _by_pivoting(data, basis, effort, max_basic)) is not None:
            return solution
        is_tried = 0 < np.count_nonzero(basis == BASIC) <= max_basic and effort.allows()
        if is_tried and (solution := _at_vertex(data, basis, effort)) is not None:
            return solution
    return None


def _bases(problem: Problem, z: Vector) -> Iterator[BasisStatus]:
    """Yield bases suggested by z. The basic variables are all z_i not at a bound, those
    farther from it than w_i from 0, or those not close to it.
    """
    with np.errstate(all="ignore"):
        R, C = equilibrate(problem.M, problem.q, problem.row_maxima)
        box = problem.box.in_units(C)
        scaled = z / C
        w = R * problem.w(z)
        margin = ACTIVE_COLUMN * np.abs(scaled).max(initial=0.0)
        snapped = np.where(scaled - box.lower <= margin, box.lower, scaled)
        bases = [problem.box.basis_at(z), box.basis_at(scaled, w)]
        bases += [
            box.basis_at(np.where(box.upper - snapped <= margin, box.upper, snapped))
        ]
    yield from {basis.tobytes(): basis for basis in bases}.values()


def _by_pivoting(
    data: ExactProblem, basis: BasisStatus, effort: Effort, max_basic: int
) -> list[Fraction] | None:
    """Return the exact solution to which pivoting from a basis leads, or None.

    Block pivots take all infeasible indices while their number decreases, otherwise
    only the first of them.
    """
    min_violations = data.n + 1
    for _ in range(MAX_EXACT_STEPS):
        is_tried = np.count_nonzero(basis == BASIC) <= max_basic and effort.allows()
        if (
            basic_solution := exact_basis(data, basis, effort) if is_tried else None
        ) is None or basic_solution.solves:
            return None if basic_solution is None else basic_solution.z
        violated = np.zeros(data.n, dtype=bool)
        violated[
            list(basic_solution.gaps)
            if len(basic_solution.gaps) < min_violations
            else min(basic_solution.gaps)
        ] = True
        min_violations = min(min_violations, len(basic_solution.gaps))
        basis = data.problem.box.exchanged(basis, violated, rounded(basic_solution.z))
    return None


def finitely_rounded(z: Sequence[Fraction]) -> Vector | None:
    """Return an exact solution rounded to double precision; None if it overflows."""
    return doubles if np.isfinite(doubles := rounded(z)).all() else None


# Unknowns up to which the connected components of M are solved exactly, one by one.
MAX_IN_PARTS = 10_000


class ExactBasis(NamedTuple):
    """A solution of M_BB z_B = -(q + M z_N)_B, with z_N at its bounds.

    unique : whether it is the only one. gaps : by how much each component violates the
        problem: z_i is beyond its bounds, or w_i violates its sign condition.
    """

    z: list[Fraction]
    unique: bool
    gaps: dict[int, Fraction]

    @property
    def solves(self) -> bool:
        return not self.gaps


def exact_basis(
    data: ExactProblem, basis: BasisStatus, effort: Effort | None = None
) -> ExactBasis | None:
    """Return the basic solution of a basis; None if there is none, or if solving takes
    more than `effort`.
    """
    active = np.flatnonzero(basis == BASIC)
    if (
        solved := _solved(data, active, active, _at_bounds(data, basis), effort)
    ) is None:
        return None
    z, unique = solved
    gaps = dict[int, Fraction]()
    for i, (state, w, low, high) in enumerate(
        zip(basis.tolist(), data.w(z), data.lower, data.upper, strict=True)
    ):
        sign_violation = w if state * w > 0 and low != high else Fraction(0)
        if (
            violation := gap(z[i], Fraction(0), low, high)
            if state == BASIC
            else sign_violation
        ):
            gaps[i] = abs(violation)
    return ExactBasis(z, unique, gaps)


def _at_bounds(data: ExactProblem, basis: BasisStatus) -> list[Fraction]:
    """Return z at the bounds of nonbasic variables, and 0 for basic ones."""
    z = zeros(data.n)
    for i in np.flatnonzero(basis != BASIC).tolist():
        z[i] = (data.upper if basis[i] == UPPER else data.lower)[i] or z[i]
    return z


def _solved(
    data: ExactProblem,
    rows: Indices,
    columns: Indices,
    nonbasic_z: list[Fraction],
    effort: Effort | None,
) -> tuple[list[Fraction], bool] | None:
    """Return z with w = 0 in those rows that differs from `nonbasic_z` only in those
    columns, where that is 0, and whether it is unique; None if there is no such z, or
    if solving takes more than `effort`. Without rows or without columns, z is
    `nonbasic_z`, whose w is not tested.
    """
    z = list(nonbasic_z)
    if not rows.size or not columns.size:
        return z, True
    right, d = [-data.constants[i] for i in rows.tolist()], 1
    if any(nonbasic_z):
        w = data.w(nonbasic_z)
        right, d = over_one_denominator([-w[i] * data.scales[i] for i in rows.tolist()])
    A = [[data.rows[i].get(j, 0) for j in columns.tolist()] for i in rows.tolist()]
    if effort is not None:
        if not effort.allows(duration := elimination.duration(A)):
            return None
        effort.spend(duration)
    solution, free = elimination.solve(A, right)
    if solution is None:
        return None
    for j, value in zip(columns.tolist(), solution, strict=True):
        z[j] = value / d
    return z, not free


@np.errstate(all="ignore")
def vertex(problem: Problem, basis: BasisStatus, effort: float) -> Vector | None:
    """Return, up to rounding, a vertex of the set of z within their bounds with z_N at
    these, w_P = 0, and w_N of the signs required by complementarity, by a linear
    program; None if the search yields none within `effort`. The problem should be
    equilibrated.
    """
    active, at_bounds = np.flatnonzero(basis == BASIC), problem.box.nonbasic(basis)
    columns, q = problem.M[:, active], problem.w(at_bounds)
    if not (active.size and np.isfinite(columns.sum()) and np.isfinite(q).all()):
        return None
    lower, upper = problem.box.vectors(problem.n)
    low, high = lower[active], upper[active]
    is_any = (basis != BASIC) & (lower == upper)
    signs = (
        np.where(is_any | (basis == UPPER), -np.inf, -q),
        np.where(is_any | (basis == LOWER), np.inf, -q),
    )
    towards = np.where(np.isfinite(low), 1.0, np.where(np.isfinite(high), -1.0, 0.0))
    program_solution = minimized(towards, columns, signs, (low, high), effort)
    if program_solution is None:
        return None
    at_bounds[active] = program_solution.x
    return at_bounds


def _at_vertex(
    data: ExactProblem, basis: BasisStatus, effort: Effort
) -> list[Fraction] | None:
    """Return an exact solution at a `vertex`: a linear program determines which z are
    at their bounds, then the others are computed exactly.
    """
    with np.errstate(all="ignore"):
        scaled = scale(data.problem, moderate=0).problem
    z, active = vertex(scaled, basis, VERTEX_EFFORT), np.flatnonzero(basis == BASIC)
    if z is None:
        return None
    low, high = (bound[active] for bound in scaled.box.vectors(data.n))
    x = z[active]
    margin = ACTIVE_COLUMN * max(float(np.abs(x).max()), ACTIVE_COLUMN)
    vertex_states = np.where(
        x - low <= margin, LOWER, np.where(high - x <= margin, UPPER, BASIC)
    )
    still_basic, at_vertex = active[vertex_states == BASIC], basis.copy()
    at_vertex[active] = vertex_states
    zeros = np.abs(scaled.w(z)) <= ACTIVE_COLUMN
    for rows in (distinct(np.concatenate((active, np.flatnonzero(zeros)))), active):
        solved = _solved(data, rows, still_basic, _at_bounds(data, at_vertex), effort)
        if solved is not None and data.is_solution(solved[0]):
            return solved[0]
    return None


# Refinement steps with residuals in twice the precision: each gains a digit or more,
# unless M_BB is singular to working precision.
REFINEMENTS = 10
# Steps after which values that are much smaller than the largest one need not be
# correct to their last digits.
SMALL_REFINEMENTS = 3


@np.errstate(all="ignore")
def accurate_basic_solution(
    problem: Problem, z: Vector, basis: BasisStatus | None = None
) -> Vector:
    """Return the basic solution of a basis, by default the basis of z in the
    equilibrated problem, correct to its last digits; or the approximate solution z,
    shape (n,), if that is not worse.
    """
    units = changes.scale(problem)
    scaled_problem = units.problem
    if basis is None:
        z_scaled = units.z_inside(z)
        basis = scaled_problem.box.basis_at(z_scaled, scaled_problem.w(z_scaled))
    better, active = problem.box.nonbasic(basis), np.flatnonzero(basis == BASIC)
    if not active.size:
        return better
    if may_be_stiff(problem.M):
        # Refinement in double precision may not converge for these.
        with imports:
            from lcpcli.verify.definite_enclosure import basic_solution
        enclosed_z = basic_solution(problem, basis)
        if enclosed_z is not None:
            return enclosed_z
    solver, b = PrincipalSolver(scaled_problem.M), -scaled_problem.q[active]
    block = solver.block(active)
    try:
        if better.any():
            b = accurate_residual(scaled_problem.M[active], units.z_inside(better), b)
        solve = solver.factorized(block)
        values = solve(b)
        for step in range(REFINEMENTS):
            change = solve(accurate_residual(block, values, b))
            values += change
            # If the largest value is 1e16, values of about 1 become correct only after
            # further steps.
            if not np.abs(change).max() > EPS * np.abs(values).max() and (
                step >= SMALL_REFINEMENTS
                or (np.abs(change) <= EPS * np.abs(values)).all()
            ):
                break
    except (SingularMatrix, OverflowError, ValueError):
        return z
    basic = np.zeros(problem.n)
    basic[active] = values
    better = problem.box.project(
        np.where(basis == BASIC, units.z_outside(basic), better)
    )
    if not np.isfinite(better).all():
        return z
    criterion = Criterion(problem)
    if (
        Point(criterion, better).relative_residual
        <= 2 * Point(criterion, z).relative_residual
    ):
        return better
    terms = matrices.absolute_product(problem.M, np.abs(better)) + np.abs(problem.q)
    gaps = np.abs(problem.box.gaps(better, problem.w(better)))
    # The residual may be larger, but it is as small as rounding z allows.
    return better if (gaps <= ROUNDING * terms).all() else z


def is_rounded_solution(
    problem: Problem, z: Vector, effort: Effort | None = None
) -> bool | None:
    """Return whether z, of shape (n,), is a solution up to its last digits, in rational
    arithmetic, for the numbers of the text that the problem was read from, or else for
    its doubles: whether the exact basic solution of its basis solves the problem, and
    each component of z differs from it by at most ROUNDING, relatively. So the result
    is never True for a problem without solution. It is None if more than
    `farkas.max_exact_unknowns()` variables are basic, or solving takes more than
    `effort`.
    """
    if not (np.isfinite(z).all() and _may_be_rounded(problem, z)):
        return False
    basis = problem.box.basis_at(z)
    is_large = np.count_nonzero(basis == BASIC) > farkas.max_exact_unknowns()
    if is_large and problem.n > MAX_IN_PARTS:
        return None
    is_of_text = problem.written is not None
    data = as_written(problem) if is_of_text else ExactProblem.of_basis(problem, basis)
    effort = Effort() if effort is None else effort
    if not is_large:
        return _is_rounded(data, z, basis, effort)
    # There are too many for one system: each connected component is solved separately.
    for part in map(np.array, data.blocks):
        part_data = data.part(part.tolist()), z[part], basis[part]
        is_small = (
            np.count_nonzero(part_data[2] == BASIC) <= farkas.max_exact_unknowns()
        )
        if not (is_rounded := _is_rounded(*part_data, effort) if is_small else None):
            return is_rounded
    return True


# The largest distance of an exact solution of the numbers as written from that of the
# doubles, relative to each component: their bases may be almost singular.
SAME_SIZE = Fraction(1, 2)


def has_solution_as_written(problem: Problem, z: Vector, effort: Effort) -> bool | None:
    """Return whether the basis of z has an exact solution of about this size for the
    numbers of a problem as written; of arrays for their shortest decimals, unless these
    are so long that the doubles are what somebody wrote. None if solving takes more
    than `effort`.
    """
    if problem.n > farkas.max_exact_unknowns():
        return None
    if are_same(problem) or (problem.written is None and are_computed(problem)):
        return True
    data, basis, spent = as_written(problem), problem.box.basis_at(z), effort.spent
    basic_solution = exact_basis(data, basis, effort)
    if basic_solution is None:  # if effort was spent, there is none
        return False if effort.spent > spent else None
    return basic_solution.solves and all(
        abs(Fraction(a) - b) <= SAME_SIZE * abs(b)
        for a, b in zip(z.tolist(), basic_solution.z, strict=True)
    )


def _is_rounded(
    data: ExactProblem, z: Vector, basis: BasisStatus, effort: Effort
) -> bool | None:
    """Return whether z is the exact basic solution of a basis up to ROUNDING, and that
    solves the problem; None if solving takes more than `effort`.
    """
    spent = effort.spent
    basic_solution = exact_basis(data, basis, effort)
    if basic_solution is None:  # if effort was spent, there is none
        return False if effort.spent > spent else None
    if not (basic_solution.unique and basic_solution.solves):
        return False
    last_digits = Fraction(ROUNDING)
    return all(
        abs(Fraction(a) - b) <= last_digits * abs(b)
        for a, b in zip(z.tolist(), basic_solution.z, strict=True)
    )


@np.errstate(all="ignore")
def _may_be_rounded(problem: Problem, z: Vector) -> bool:
    """Return whether z may differ from a solution by a relative ROUNDING: that changes
    w by at most ROUNDING |M| |z|, which bounds the violations. This necessary condition
    takes one product with |M|, while solving a system of hundreds of unknowns exactly
    takes minutes.
    """
    if not Point(Criterion(problem), z).nearly_solves():
        return False
    if not problem.is_moderate:
        return True
    measure = Measure(problem)
    rows = measure.rows(problem.box.project(z))
    moved = ROUNDING * matrices.absolute_product(problem.M, np.abs(z))
    possible = (1 + 8 * ROUNDING) * moved + rows.error + SMALLEST_NORMAL
    return bool((measure.violations(z, rows.w) <= possible).all())


@np.errstate(all="ignore")
def is_rounded_difference(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether z is, up to its last digits, a point with a relative residual of
    at most tol that has more digits than double precision: the sum of the reference
    point, if that is not 0, and a distance no larger than z. With bounds far from 0,
    every z in double precision may have a larger residual.
    """
    reference_z = problem.reference_z
    if reference_z is None or not problem.is_moderate:
        return False
    frame = shifted(problem).problem
    measure = Measure(problem)
    sizes = np.abs(z)
    with suppress(SingularMatrix):
        distance = frame.box.project(
            BasicSolutions(frame).at(problem.box.basis_at(z)).z
        )
        if (np.abs(distance) <= sizes).all() and (
            np.abs(reference_z + distance - z) <= ROUNDING * sizes
        ).all():
            rows = measure.rows_from_reference(distance, measure.rows(z).full_terms)
            return bool(measure.surely_solves(z, rows, tol))
    return False
