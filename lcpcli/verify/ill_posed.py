"""Ill-posed problems: with a solution of their doubles, and infeasible but for the rounding of M.

The solution is exact, but so large that rounding of its digits leaves more than the criterion allows, as its cap keeps
out points that tend to infinity; or, where exact arithmetic takes too long, it is such a point. The proof is one of
`farkas.cancellation`. Which of the two holds for the data before they were rounded, the doubles do not tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import chain
from typing import NamedTuple

import numpy as np

from lcpcli.basis.dual_simplex import MOST_DENSE
from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.model.box import BASIC
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.typing import Vector
from lcpcli.verify import enclosure, farkas
from lcpcli.verify.certificate import Certificate, farkas_certificate, first_proof
from lcpcli.verify.exact_solution import finitely_rounded, from_point, is_rounded_solution, refined
from lcpcli.verify.measure import Measure

EFFORT = 2.0  # of an exact solution, and of LPs for a proof, by the seconds that they usually take
EXACT = "z is an exact solution of size {size} up to its last digits, but {proof}"
NO_RUN_OFF = "a row is violated by its own terms"
RUN_OFF = "z of size {size} violates no row by more than {tol:g} of its terms, but {proof}"


@np.errstate(all="ignore")
def is_run_off(problem: Problem, z: Vector, tol: float) -> bool:
    """Return whether no row is violated by more than the measure allows by its own terms, whatever its cap."""
    if not (problem.is_moderate and np.isfinite(z).all() and (z == problem.box.project(z)).all()):
        return False
    measure = Measure(problem)
    rows = measure.rows(z)
    return bool((measure.violations(z, rows.w) <= measure.allowed(rows, np.inf, tol)).all())


class Settled(NamedTuple):
    """What became of the doubt about a point that is exact up to rounding, or satisfies each row by its own terms.

    z : the basic solution of its states, shape (n,), if a solution is shown to exist near that; else the point. fault :
    why no solution is shown to exist; "" if one is. certificate : a proof that the problem is infeasible, up to the
    rounding of M; None if none was found.
    """

    z: Vector
    fault: str
    certificate: Certificate | None


@np.errstate(all="ignore")
def settled(problem: Problem, z: Vector, tol: float) -> Settled | None:
    """Settle whether a z is a solution that is a run-off, or that is exact but for its last digits; None if it is
    neither. One system with the states of z is solved, with bounds on its rounding or else exactly; then a proof that
    the problem is infeasible but for rounding is sought."""
    near, fault = enclosed(problem, z, tol)
    if not fault:  # a proof but for rounding would be one for other entries that differ by up to n EPS
        is_stable = not enclosure.fault(problem, near, math.inf, problem.n * EPS)
        return Settled(near, "", None if is_stable else proof_near(problem, near))
    if is_rounded_solution(problem, z):
        return Settled(z, "", proof_near(problem, z))
    return Settled(z, fault, proof_near(problem, near)) if fault != NO_RUN_OFF else None


@np.errstate(all="ignore")
def enclosed(problem: Problem, z: Vector, tol: float) -> tuple[Vector, str]:
    """Return the basic solution of a run-off, and why none is shown to exist near it, "" if one is; or z itself."""
    if not is_run_off(problem, z, tol):
        return z, NO_RUN_OFF
    near = refined(problem, z, problem.box.basis_at(z))
    return near, enclosure.fault(problem, near, tol)


def large_solution(
    problem: Problem, points: Sequence[Vector], proof: Certificate, tol: float
) -> tuple[Vector, str] | None:
    """Return a solution beyond the criterion, with why the problem is ill-posed then, as a clause for the user: the
    exact solution of the basis of one of the points, or of a basis near it, rounded; else a run-off: one of the points,
    or a basic solution in doubles, whose sign rounding decides, of a point or of the proof. None if there is
    neither."""
    points = [z for z in points if np.isfinite(z).all()]
    large, sentence = next((z for z in points if is_rounded_solution(problem, z)), None), EXACT
    if large is None:
        with suppress(TimeIsUp):
            data, effort = ExactProblem.of_floats(problem), Effort(EFFORT)
            found = (from_point(data, z, effort, farkas.most_exact()) for z in points)
            large = next((finitely_rounded(z) for z in found if z is not None), None)
    if large is None:
        assert proof.vector is not None
        basic = (z for point in (*points, proof.vector) for z in _basic_solutions(problem, point))
        large, sentence = next((z for z in chain(points, basic) if is_run_off(problem, z, tol)), None), RUN_OFF
    if large is None:
        return None
    size = f"{np.abs(large).max():.0e}".replace("e+", "e")
    return large, sentence.format(size=size, tol=tol, proof=proof.statement)


def _basic_solutions(problem: Problem, point: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the states of a point, and its opposite with respect to the reference point."""
    with suppress(SingularMatrix):
        z = BasicSolutions(problem).at(problem.box.basis_at(point)).z
        yield from map(problem.box.project, (z, 2 * problem.reference_point - z))


def proof_near(problem: Problem, z: Vector) -> Certificate | None:
    """Return a proof that the problem is infeasible, up to the rounding of M if there is no other one; None if none is
    found. z : a run-off, or an exact solution, whose basis leads to most of these proofs."""
    with suppress(TimeIsUp):
        found = first_proof(problem, _candidates(problem, z), few=True)
        return found if found is not None or _has_dictionary(problem) else farkas_certificate(problem, EFFORT)
    return None


def _has_dictionary(problem: Problem) -> bool:
    return not matrices.is_sparse(problem.M) and problem.box.is_orthant and problem.n <= MOST_DENSE


@np.errstate(all="ignore")
def _candidates(problem: Problem, z: Vector) -> Iterator[Vector]:
    with imports:
        from lcpcli.verify.alternative import dictionaries, simplest
    units = scale(problem)
    inner, bounds = units.problem, problem.box.vectors(problem.n)
    least, most = np.where(np.isfinite(bounds[0]), 0.0, -np.inf), np.where(np.isfinite(bounds[1]), 0.0, np.inf)
    y = _null_vector(inner, units.z_inside(z))
    others = dictionaries(inner.M, inner.q) if _has_dictionary(problem) else ()
    multipliers = chain((y, -y), (y for _, _, y in others))  # of the first, rounding decides the sign
    for y in (np.clip(y, least, most) for y in multipliers):
        size = float(np.abs(y).max())
        if 0 < size < math.inf:
            yield from map(units.multipliers, (y / size, *simplest(y / size)))


def _null_vector(problem: Problem, z: Vector) -> Vector:
    """Return the left null vector of the M_BB of the states of z, by a step of inverse iteration from z, which is a
    null vector itself but for rounding; with a shift of the size of rounding if M_BB is singular."""
    y, active, M = np.zeros(problem.n), np.flatnonzero(problem.box.basis_at(z) == BASIC), problem.M
    if not active.size:
        return y
    solver = PrincipalSolver(matrices.compressed(M.T) if matrices.is_sparse(M) else M.T)
    start, block = z[active] / np.abs(z).max(), solver.block(active)
    for shift in (0.0, EPS * matrices.norm_inf(block)):
        with suppress(SingularMatrix, OverflowError, ValueError):
            y[active] = solver.factorized(matrices.plus_diagonal(block, shift))(start)
            break
    return y
