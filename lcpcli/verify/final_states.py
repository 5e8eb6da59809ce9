"""Exact decisions for solutions in which rounding hides terms of a row.

A term that is lost in the rounding of another one, as in x_1 - x_2 = 3 with both of
about 1e16, may decide a sign and with it the active set. First, bounds on all rounding
errors show whether it matters: if an exact solution with the same basis is proved to
differ from z only in its last digits, z is accepted. Otherwise the basic solution of
that basis is computed exactly, and its signs are checked. Bodies at rest have signs
that are wrong only by rounding, such as velocities of -1e-17 with impulses of 1; then
the index with the largest violation is pivoted, a few times.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import (
    ROUNDED_ZERO,
    ROW_ROUNDING,
    SIGN_ROUNDING,
    is_finite,
    number_of,
    sizes,
)
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS, Measure

MAX_DECIDED = 10  # unknowns for which all bases can be searched in milliseconds
# Integers from here on may have been rounded, as their ulp is 1/4 or more.
LONG_NUMBER = 2.0**50
# A term below this relative to the largest one of its row is hidden: rounding of the
# larger terms leaves at most half of its digits.
HIDDEN_TERM = 1e-8
# The largest relative distance of a component from the exact solution for which z needs
# no exact decision.
SURE_DIGITS = 1e-10
# Exact basic solutions that are computed if only rounding makes signs wrong; branch and
# bound takes no longer than more of them.
MAX_EXACT_BASES = 3


def is_doubtful(problem: Problem, z: Vector) -> bool:
    """Return whether rounding hides a term of a row of a small problem at z; usually
    this is decided without reading M.
    """
    return may_hide_term(problem, z) and hides_term_of_row(problem, z)


def may_hide_term(problem: Problem, z: Vector) -> bool:
    """Return whether, by the sizes of the numbers alone, rounding may hide a term of a
    row of a small problem, or integers may have been rounded.
    """
    if problem.n > FEW_UNKNOWNS:
        return False
    (least_z, largest_z), (least_q, largest_q) = sizes(z), problem.sizes_of_q
    largest_term = max(problem.largest * largest_z, largest_q)
    least_term = min(problem.largest * least_z, least_q)
    return has_long_number(problem) or least_term < HIDDEN_TERM * largest_term


def has_long_number(problem: Problem) -> bool:
    """Return whether integers may have been rounded."""
    return max(problem.largest, problem.sizes_of_q[1]) > LONG_NUMBER


def are_signs_clear(
    problem: Problem, scaled: Vector, residual: Vector, w: Vector, terms: Vector
) -> bool:
    """Return whether bounds on rounding errors show that an exact solution with the
    basis of a z differs from it only in its last digits, for rows as in
    `enclosure.are_open`."""
    if has_long_number(problem):
        return False
    with imports:
        from lcpcli.verify.enclosure import are_open
    return not number_of(are_open(scaled, residual, w, terms, SURE_DIGITS))


def hides_term_of_row(problem: Problem, z: Vector) -> bool:
    """Return whether rounding hides a term of a row at z, or integers may have been
    rounded."""
    if has_long_number(problem):
        return True
    terms = np.abs(np.column_stack((matrices.dense(problem.M) * z, problem.q)))
    hidden = terms.min(
        axis=1, where=terms > 0, initial=np.inf
    ) < HIDDEN_TERM * terms.max(axis=1)
    return bool(hidden.any())


def without_rounding(
    z: Vector, units: Vector | float = 1.0, max_rounding: float = ROUNDED_ZERO
) -> Vector:
    """Return z with components that may be rounding errors of 0 replaced by 0: those of
    at most `max_rounding` times the largest, after scaling.
    """
    size = np.abs(z) * units
    return np.where(size <= max_rounding * size.max(), 0.0, z)


class VerifiedPoint(NamedTuple):
    """A z that solves a problem, and its basis; z is the rounded exact solution if the
    original point was not accepted.
    """

    z: Vector
    basis: BasisStatus | None


@np.errstate(all="ignore")
def verified_or_exact(
    problem: Problem, z: Vector, basis: BasisStatus | None = None
) -> VerifiedPoint | None:
    """Return z, which already solves the problem to the tolerance, if rounding hides no
    term of a row that may matter; else z without its rounding errors, or the exact
    solution close to it; None if this does not decide it, as neither the basis of z nor
    a few others have an exact solution.

    basis : the basis of z, by default the one that z shows.

    For more than MAX_DECIDED unknowns, for which not all bases can be searched, z
    itself is also returned if only rounding makes signs of the exact basic solution
    wrong, or its singular system inconsistent.
    """
    unchanged = VerifiedPoint(z, basis)
    if not may_hide_term(problem, z):
        return unchanged
    with imports:
        from lcpcli.verify.enclosure import open_signs, why_unproved
    is_long = has_long_number(problem)
    # Bounds in floating-point arithmetic take less time than the search for the term.
    if not (is_long or is_sparse(problem.M)) and problem.box.is_orthant:
        B = z.nonzero()[0]
        if not open_signs(problem.M, problem.q, B, z, SURE_DIGITS).any():
            return unchanged
    if not hides_term_of_row(problem, z):
        return unchanged
    if not (is_long or why_unproved(problem, z, SURE_DIGITS)):
        return unchanged
    shown = problem.box.basis_at(z)
    cleaned = problem.box.project(without_rounding(z))
    allowed = ROW_ROUNDING * (
        np.abs(matrices.dense(problem.M)) @ np.abs(cleaned) + np.abs(problem.q)
    )
    if (
        not hides_term_of_row(problem, cleaned)
        and (problem.box.excess(cleaned, problem.w(cleaned)) <= allowed).all()
    ):
        return VerifiedPoint(cleaned, basis)
    if basis is None or not np.array_equal(
        basis[shown == BASIC], shown[shown == BASIC]
    ):
        basis = shown
    return _exact_near(problem, basis, unchanged)


def _exact_near(
    problem: Problem, basis: BasisStatus, unchanged: VerifiedPoint
) -> VerifiedPoint | None:
    """Return the exact solution of a basis, or of one of the few to which pivots on
    exact violations lead; else `unchanged`, or None, as `verified_or_exact` says."""
    with imports:
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.numbers import rounded
        from lcpcli.rational.written import as_written
        from lcpcli.verify.exact_solution import exact_basis
    is_of_text = problem.written is not None
    data = as_written(problem) if is_of_text else ExactProblem.of_floats(problem)
    for _ in range(MAX_EXACT_BASES):
        exact_solution = exact_basis(data, basis)
        if exact_solution is None:
            return unchanged if problem.n > MAX_DECIDED else None
        exact_z = rounded(exact_solution.z)
        if exact_solution.solves:
            return (
                VerifiedPoint(exact_z, basis)
                if is_finite(exact_z) and is_finite(problem.w(exact_z))
                else None
            )
        gaps = exact_solution.gaps
        allowed = _allowed_violations(problem, exact_z, basis)
        if not (rounded(list(gaps.values())) <= allowed[list(gaps)]).all():
            return None
        if problem.n > MAX_DECIDED:
            return unchanged
        worst = np.zeros(problem.n, np.bool_)
        worst[max(gaps, key=gaps.__getitem__)] = True
        basis = problem.box.exchanged(basis, worst, exact_z)
    return None


def _allowed_violations(problem: Problem, z: Vector, basis: BasisStatus) -> Vector:
    """Return up to which size violations at an exact basic solution, rounded to z, may
    be rounding errors: of the largest z_j if a basic z_i is beyond a bound, otherwise
    of the terms of the row. In rows whose terms are all rounding errors, it may be one
    of the other numbers of its component."""
    is_basic = basis == BASIC
    terms = np.abs(matrices.dense(problem.M)) @ np.abs(z) + np.abs(problem.q)
    allowed = SIGN_ROUNDING * np.where(is_basic, np.abs(z).max(), terms)
    if problem.is_moderate and problem.n > MAX_DECIDED:
        measure = Measure(problem)
        part_sizes = np.where(is_basic, measure.natural_sizes(z), measure.caps(z))
        allowed = np.maximum(allowed, ROW_ROUNDING * part_sizes)
    return np.asarray(allowed)
