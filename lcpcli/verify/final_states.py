"""Solutions in which rounding hides terms of a row, and what exact arithmetic decides
about them, in their last states.

A term that rounding of another one hides, as in x_1 - x_2 = 3 with both near 1e16, may
decide a sign and with it a state. First, bounds on all rounding errors show whether it
does: where an exact solution with the same states surely differs from z by no more than
its last digits, nothing is left to decide. Else the basic solution of these states is
computed exactly, one system, and its signs tell. Bodies at rest have signs that only
rounding makes wrong, such as velocities of 1e-17 beside impulses of 1; then the state
that violates most is exchanged, a few times.
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
    sizes,
)
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import States, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS, Measure

MAX_DECIDED = 10  # unknowns for which all states can be searched in milliseconds
# A number from which on units in the last place are no longer small fractions of one.
LONG_NUMBER = 2.0**50
# Relative to the largest term of a row: rounding of the others leaves half of its
# digits.
HIDDEN_TERM = 1e-8
# relative: the largest distance of a component from that of the exact solution.
SURE_DIGITS = 1e-12
# At exact basic solutions whose signs only rounding makes wrong; then the tree decides
# as fast.
MAX_EXACT_BASES = 3


def is_doubtful(problem: Problem, z: Vector) -> bool:
    """Return whether rounding hides a term of a row of a small problem at z, most of
    the time without a look at M."""
    return may_hide_term(problem, z) and hides_term_of_row(problem, z)


def may_hide_term(problem: Problem, z: Vector) -> bool:
    """Return whether sizes alone leave it open whether rounding hides a term of a row
    of a small problem, or integers may have been rounded."""
    if problem.n > FEW_UNKNOWNS:
        return False
    (least_z, largest_z), (least_q, largest_q) = sizes(z), problem.sizes_of_q
    largest_term = max(problem.largest * largest_z, largest_q)
    least_term = min(problem.largest * least_z, least_q)
    is_long = max(problem.largest, largest_q) > LONG_NUMBER
    return is_long or least_term < HIDDEN_TERM * largest_term


def hides_term_of_row(problem: Problem, z: Vector) -> bool:
    """Return whether rounding hides a term of a row at z, or integers may have been
    rounded."""
    if max(problem.largest, problem.sizes_of_q[1]) > LONG_NUMBER:
        return True
    terms = np.abs(np.column_stack((matrices.dense(problem.M) * z, problem.q)))
    hidden = terms.min(
        axis=1, where=terms > 0, initial=np.inf
    ) < HIDDEN_TERM * terms.max(axis=1)
    return bool(hidden.any())


def without_rounding(
    z: Vector, units: Vector | float = 1.0, max_rounding: float = ROUNDED_ZERO
) -> Vector:
    """Return z with 0 in place of components that may be rounding of 0: up to
    `max_rounding` of the largest, in these units."""
    size = np.abs(z) * units
    return np.where(size <= max_rounding * size.max(), 0.0, z)


class VerifiedPoint(NamedTuple):
    """A z that solves a problem, and its states; the exact solution, rounded, if it is
    not the given one."""

    z: Vector
    basis: States | None


@np.errstate(all="ignore")
def verified_or_exact(
    problem: Problem, z: Vector, basis: States | None = None
) -> VerifiedPoint | None:
    """Return a z that solves a problem to the tolerance, or the exact solution near it;
    None if more has to be decided: where rounding hides terms, and there is no exact
    solution with the states of z or a few others.

    basis : the states of z, by default as z shows them.

    For more than MAX_DECIDED unknowns, for which not all states can be searched, z
    itself is returned also where only rounding makes signs of the exact basic solution
    wrong, or its singular system contradictory."""
    unchanged = VerifiedPoint(z, basis)
    if not may_hide_term(problem, z):
        return unchanged
    with imports:
        from lcpcli.verify.enclosure import fault, open_signs
    is_long = max(problem.largest, problem.sizes_of_q[1]) > LONG_NUMBER
    # Bounds in doubles take less time than to look for the term.
    if not (is_long or is_sparse(problem.M)) and problem.box.is_orthant:
        B = z.nonzero()[0]
        if not open_signs(problem.M, problem.q, B, z, SURE_DIGITS).any():
            return unchanged
    if not hides_term_of_row(problem, z):
        return unchanged
    if not (is_long or fault(problem, z, SURE_DIGITS)):
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
    with imports:
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.numbers import rounded
        from lcpcli.verify.exact_solution import exact_basis
    data = ExactProblem.of_floats(problem)
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
        # Only rounding: of the largest z_j where a violation is by a basic z_i, else of
        # the terms of the row, or of the numbers of its part of the problem, beside
        # which rows may be filled by rounding alone.
        is_basic, terms = (
            basis == BASIC,
            np.abs(matrices.dense(problem.M)) @ np.abs(exact_z) + np.abs(problem.q),
        )
        max_violation = SIGN_ROUNDING * np.where(is_basic, np.abs(exact_z).max(), terms)
        if problem.is_moderate and problem.n > MAX_DECIDED:
            measure = Measure(problem)
            max_violation = np.maximum(
                max_violation,
                ROW_ROUNDING
                * np.where(
                    is_basic, measure.natural_sizes(exact_z), measure.caps(exact_z)
                ),
            )
        if not (
            rounded(list(exact_solution.gaps.values()))
            <= max_violation[list(exact_solution.gaps)]
        ).all():
            return None
        if problem.n > MAX_DECIDED:
            return unchanged
        worst = np.zeros(problem.n, np.bool_)
        worst[max(exact_solution.gaps, key=exact_solution.gaps.__getitem__)] = True
        basis = problem.box.exchanged(basis, worst, exact_z)
    return None
