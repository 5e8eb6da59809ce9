"""Exact solutions that are proved to exist close to a point, and proofs against them.

A z whose residual exceeds the tolerance may still be a solution: its digits may not
suffice for a small residual, or its size may exceed what the caps of `measure` allow,
which exclude points that tend to infinity in a problem without solution. So a solution
close to it, with the same basis, is proved to exist: by a linear system with bounds on
its rounding errors (`enclosure`), or in rational arithmetic (`exact_solution`).

An ill-posed problem has such a solution for its double precision numbers, but is
infeasible up to the rounding of M: the solution is so large that rounding its digits
violates the tolerance. If exact arithmetic takes too long, it is a point that tends to
infinity. The proof is one of `farkas.cancellation`. The rounded data do not determine
which of the two holds for the data before rounding.
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
    has_solution_as_written,
    is_rounded_difference,
    is_rounded_solution,
)
from lcpcli.verify.measure import Measure, quotients

ROUNDED = (
    "z is the exact solution up to rounding of its last digits, which leaves a "
    "relative residual of {:.1e}"
)
ENCLOSED = (
    "an exact solution with the basis of z is proved to exist for the stored numbers; "
    "z is large relative to q: its relative residual is {:.1e}"
)
EXACT = "z is an exact solution of size {size} up to its last digits, but {proof}"
RUN_OFF = (
    "z of size {size} violates no row by more than {tol:g} of its terms, but {proof}"
)
# Gaussian elimination with n unknowns leaves a residual of at most n times this,
# relative to the terms of a row (N. J. Higham, Accuracy and Stability of Numerical
# Algorithms, 2nd ed., SIAM 2002, theorem 9.4).
ELIMINATION = 3 * EPS / 2
EFFORT = 2.0  # limit on an exact solution, in seconds that it usually takes
DOUBT = (
    "z satisfies each row to the tolerance relative to the terms of that row, but is "
    "so large that this may be an effect of rounding, and {}"
)
UNDECIDED = (
    "whether it is a solution up to its last digits {}, which takes long in exact "
    "arithmetic"
)
NOT_TRIED = "is not decided"
AS_STORED = (
    "a solution with the basis of z exists for the double precision numbers, with a "
    "relative residual of {:.1e}, but not for the numbers as written"
)


class Nearby(NamedTuple):
    """An exact solution close to a point.

    z : that solution, rounded, shape (n,), or a point that tends to infinity.
    why_unproved : why no solution is proved to exist; "" if one is.
    reason : how it is proved, as a clause for the user with a placeholder for the
        relative residual of z, or for `why_unproved`.
    is_stable : whether a solution exists for all entries that differ by their rounding
        errors.
    is_as_written : whether no exact arithmetic shows that the basis has no such
        solution for the numbers as written.
    """

    z: Vector
    why_unproved: str = ""
    reason: str = ROUNDED
    is_stable: bool = False
    is_as_written: bool = True


@np.errstate(all="ignore")
def nearby(problem: Problem, z: Vector, tol: float) -> Nearby | None:
    """Return the exact solution close to z. If z violates no row relative to the terms
    of that row, but its basis has no proved solution, return z and why.
    Otherwise None.
    """
    if is_rounded_difference(problem, z, tol):
        return Nearby(z, is_stable=True)
    solution = _by_its_basis(problem, z, tol)
    if solution is None or solution.is_stable or solution.why_unproved:
        return solution
    if has_solution_as_written(problem, solution.z, Effort(EFFORT)) is not False:
        return solution
    return solution._replace(reason=AS_STORED, is_as_written=False)


def _by_its_basis(problem: Problem, z: Vector, tol: float) -> Nearby | None:
    """Return what one system with the basis of z, solved with bounds on its rounding
    errors or else exactly, shows of a solution close to z, as `nearby` does."""
    why_unproved = ""
    if is_run_off(problem, z, tol):
        nearby_z = accurate_basic_solution(problem, z, problem.box.basis_at(z))
        why_unproved = enclosure.why_unproved(problem, nearby_z, tol)
        if not why_unproved:
            is_stable = enclosure.is_stable(problem, nearby_z)
            return Nearby(nearby_z, reason=ENCLOSED, is_stable=is_stable)
    is_rounded = is_rounded_solution(problem, z, Effort(EFFORT))
    if is_rounded:
        return Nearby(z)
    if why_unproved:
        return Nearby(z, why_unproved, reason=DOUBT)
    return Nearby(z, NOT_TRIED, reason=UNDECIDED) if is_rounded is None else None


def distance(problem: Problem, z: Vector, solution: Vector) -> tuple[float, bool]:
    """Return the largest distance of z from a basic solution with the same basis,
    relative to each component, and whether rounding in its system explains it."""
    largest = float(quotients(np.abs(z - solution), np.abs(solution)).max(initial=0.0))
    rounding = max(ROW_ROUNDING, ELIMINATION * problem.n)
    return largest, is_run_off(problem, z, rounding)


# Without it: `check` refuses a solution of size 1e10 of a Z-matrix in 60 unknowns.
@np.errstate(all="ignore")
def is_run_off(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether no violation exceeds what the measure tolerates with infinite
    caps, relative to the terms of each row: z is a solution, or tends to infinity.
    """
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


# Without it: boxes that floor and ceiling crush, which are ill-posed, are stalled.
def large_solution(
    problem: Problem, points: Sequence[Vector], proof: Proof, tol: float
) -> tuple[Vector, str] | None:
    """Return a solution that need not meet the tolerance, and the reason why the
    problem is then ill-posed, as a clause for the user; None if there is none.

    It is the rounded exact solution of the basis of one of the points, or of a basis
    that pivoting leads to. Otherwise it is a point that tends to infinity: one of the
    points, or a basic solution in floating-point arithmetic, whose sign depends on
    rounding, of the basis of a point or of the proof.
    """
    points = [z for z in points if np.isfinite(z).all()]
    large = next((z for z in points if is_rounded_solution(problem, z)), None)
    sentence = EXACT
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
        large = next(
            (z for z in chain(points, basic) if is_run_off(problem, z, tol)), None
        )
        sentence = RUN_OFF
    if large is None:
        return None
    size = f"{np.abs(large).max():.0e}".replace("e+", "e")
    return large, sentence.format(size=size, tol=tol, proof=proof.statement)


def _basic_solutions(problem: Problem, point: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the basis of a point, and its reflection at the
    reference point, as rounding may determine its sign.
    """
    with suppress(SingularMatrix):
        z = BasicSolutions(problem).at(problem.box.basis_at(point)).z
        yield from map(problem.box.project, (z, 2 * problem.reference_point - z))
