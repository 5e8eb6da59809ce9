"""Exact solutions that are proved to exist near a point, and what speaks against them.

A z whose residual exceeds what the criterion allows may be a solution all the same: its
digits may not hold what the residual asks for, or its size may be beyond what the cap
of the criterion takes for sure, which is there to keep out points that tend to infinity
in a problem without a solution. So a solution near it is proved, from its states: by a
linear system with bounds on its rounding (`enclosure`), or in fractions
(`exact_solution`).

Ill-posed problems have such a solution for their doubles, and are infeasible but for
the rounding of M: the solution is then so large that rounding of its digits leaves more
than the criterion allows; or, where exact arithmetic takes too long, it is a point that
tends to infinity. The proof is one of `farkas.cancellation`. Which of the two holds for
the data before they were rounded, the doubles do not tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import chain
from typing import NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.typing import Vector
from lcpcli.verify import enclosure, farkas
from lcpcli.verify.certificate import Proof
from lcpcli.verify.exact_solution import (
    accurate_basic_solution,
    finitely_rounded,
    from_point,
    is_rounded_difference,
    is_rounded_solution,
)
from lcpcli.verify.measure import Measure, quotients

ROUNDED = (
    "z is the exact solution up to rounding of its last digits, which leaves a "
    "relative residual of {:.1e}"
)
ENCLOSED = (
    "an exact solution is proved to have the states of z, which is large beside q: "
    "its relative residual is {:.1e}"
)
EXACT = "z is an exact solution of size {size} up to its last digits, but {proof}"
RUN_OFF = (
    "z of size {size} violates no row by more than {tol:g} of its terms, but {proof}"
)
# Of the terms of a row, for each unknown: what Gaussian elimination leaves of it (N. J.
# Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, theorem
# 9.4).
ELIMINATION = 3 * EPS / 2
EFFORT = 2.0  # of an exact solution, by the seconds that it usually takes
DOUBT = (
    "z satisfies each row by its own terms but is too large to be a solution beyond "
    "doubt, and {}"
)
UNDECIDED = (
    "whether it is a solution up to its last digits {}, which takes long in exact "
    "arithmetic"
)
NOT_TRIED = "is not decided"


class Nearby(NamedTuple):
    """An exact solution near a point.

    z : that solution, rounded, shape (n,), or a point that tends to infinity.
    fault : why no solution is shown to exist; "" if one is.
    reason : how one is shown, as a clause for the user with a place for the relative
        residual of z, or for the fault.
    is_stable : whether one exists for all entries that differ by their rounding.
    """

    z: Vector
    fault: str = ""
    reason: str = ROUNDED
    is_stable: bool = False


@np.errstate(all="ignore")
def nearby(problem: Problem, z: Vector, tol: float) -> Nearby | None:
    """Return the exact solution near a z; or z with the fault, if it violates no row by
    its own terms, and there is none with its states; else None. One system with the
    states of z is solved, with bounds on its rounding or else exactly."""
    if is_rounded_difference(problem, z, tol):
        return Nearby(z, is_stable=True)
    fault = ""
    if is_run_off(problem, z, tol):
        nearby_z = accurate_basic_solution(problem, z, problem.box.basis_at(z))
        fault = enclosure.fault(problem, nearby_z, tol)
        if not fault:
            is_stable = enclosure.is_stable(problem, nearby_z)
            return Nearby(nearby_z, reason=ENCLOSED, is_stable=is_stable)
    is_rounded = is_rounded_solution(problem, z, Effort(EFFORT))
    if is_rounded:
        return Nearby(z)
    if fault:
        return Nearby(z, fault, reason=DOUBT)
    return Nearby(z, NOT_TRIED, reason=UNDECIDED) if is_rounded is None else None


def distance(problem: Problem, z: Vector, solution: Vector) -> tuple[float, bool]:
    """Return the largest distance of z from a basic solution with its states, relative
    to each component, and whether rounding in its system explains it."""
    largest = float(quotients(np.abs(z - solution), np.abs(solution)).max(initial=0.0))
    rounding = max(ROW_ROUNDING, ELIMINATION * problem.n)
    return largest, is_run_off(problem, z, rounding)


@np.errstate(all="ignore")
def is_run_off(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether no row is violated by more than the measure allows by its own
    terms, whatever its cap."""
    if not (
        problem.is_moderate
        and np.isfinite(z).all()
        and (z == problem.box.project(z)).all()
    ):
        return False
    measure = Measure(problem)
    rows = measure.rows(z)
    return bool(
        (measure.violations(z, rows.w) <= measure.allowed(rows, np.inf, tol)).all()
    )


def large_solution(
    problem: Problem, points: Sequence[Vector], proof: Proof, tol: float
) -> tuple[Vector, str] | None:
    """Return a solution beyond the criterion, with why the problem is ill-posed then,
    as a clause for the user: the exact solution of the basis of one of the points, or
    of a basis near it, rounded; else a run-off: one of the points, or a basic solution
    in doubles, whose sign rounding decides, of a point or of the proof. None if there
    is neither."""
    points = [z for z in points if np.isfinite(z).all()]
    large, sentence = (
        next((z for z in points if is_rounded_solution(problem, z)), None),
        EXACT,
    )
    if large is None:
        with suppress(TimeIsUp):
            data, effort = ExactProblem.of_floats(problem), Effort(EFFORT)
            exact_solutions = (
                from_point(data, z, effort, farkas.max_exact_unknowns()) for z in points
            )
            large = next(
                (finitely_rounded(z) for z in exact_solutions if z is not None), None
            )
    if large is None:
        assert proof.vector is not None
        basic = (
            z
            for point in (*points, proof.vector)
            for z in _basic_solutions(problem, point)
        )
        large, sentence = (
            next(
                (z for z in chain(points, basic) if is_run_off(problem, z, tol)), None
            ),
            RUN_OFF,
        )
    if large is None:
        return None
    size = f"{np.abs(large).max():.0e}".replace("e+", "e")
    return large, sentence.format(size=size, tol=tol, proof=proof.statement)


def _basic_solutions(problem: Problem, point: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the states of a point, and its opposite with respect
    to the reference point."""
    with suppress(SingularMatrix):
        z = BasicSolutions(problem).at(problem.box.basis_at(point)).z
        yield from map(problem.box.project, (z, 2 * problem.reference_point - z))
