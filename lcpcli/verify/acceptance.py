"""Whether a point is accepted as a solution: `accepted` is the only function that
decides it, for all methods and for `check`.

The parts of the decision are defined in other modules: the tolerance on the
componentwise backward error in `measure` and `point`, exact basic solutions of problems
with few unknowns in `final_states`, exact solutions that are proved to exist close to a
point in `nearby_solutions`, and proofs that there is no solution in `certificate`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import chain
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector
from lcpcli.verify.final_states import verified_or_exact, without_rounding
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from lcpcli.verify.certificate import Proof

# The numbers of the decisions in the docstring of `accepted`.
AS_IT_IS = 1
CLEANED = 2
WITHOUT_ROUNDING = 3
PROVED = 4
UNREFUTED = 5


class Acceptance(NamedTuple):
    """The decision on a point.

    verdict : "solved"; "ill_posed" if it is a solution only for the entries of M as
        rounded, or not for the numbers as written; "infeasible" if there is no
        solution; or "doubt" if it violates no row relative to the terms of that row,
        but neither a solution close to it nor a proof that there is none was
        established.
    point : the point itself, or one close to it that is accepted instead.
    reason : the reason, as a clause for the user; "" if the tolerance is met.
    certificate : the proof that there is no solution, if there is one.
    basis : the basis passed to `accepted`, or that of the exact solution.
    """

    point: Point
    reason: str = ""
    verdict: Literal["solved", "ill_posed", "infeasible", "doubt"] = "solved"
    certificate: Proof | None = None
    basis: BasisStatus | None = None

    @property
    def solved(self) -> bool:
        return self.verdict == "solved"


class Extent(NamedTuple):
    """How far the decisions of `accepted` go.

    first, last : the first and the last decision to be made.
    keeps : whether the point itself is returned if an exact solution differs from it in
        small entries only, as for a method that the user named.
    as_given : whether the decision is about the point itself, from which a solution may
        differ by no more than the tolerance; otherwise a solution that is reached from
        the point may be returned instead.
    is_exact : whether for few unknowns exact arithmetic decides at once where rounding
        hides a term of a row, as `auto` requires.
    seconds : the time limit of proofs.
    refutation : a proof that the problem is infeasible up to the rounding of M, if one
        is known.
    share : if it is not 0, a point is accepted if its natural residual is at most this
        fraction of that of 0: it is a step of a linearization, and need not be a
        solution.
    """

    last: int = UNREFUTED
    first: int = AS_IT_IS
    as_given: bool = False
    keeps: bool = False
    is_exact: bool = False
    seconds: float = math.inf
    refutation: Proof | None = None
    share: float = 0.0


AT_ONCE = Extent(AS_IT_IS)
BY_CRITERION = Extent(WITHOUT_ROUNDING)
IN_FULL = Extent()
HIDDEN = (
    "rounding hides a term of a row, and no exact solution close to it was computed"
)
DIFFERS = "it differs by {:.1e} from the exact solution with the same basis"
UNEXPLAINED = ", which is more than rounding errors in the system of that basis explain"


def accepted(
    problem: Problem,
    points: Sequence[Point | Vector],
    tol: float,
    extent: Extent = IN_FULL,
    basis: BasisStatus | None = None,
) -> Acceptance | None:
    """Return the decision on the first point that is accepted; None if no point is.

    A point is accepted by the first of these decisions that holds:

    1. Its relative residual is at most tol.
    2. The relative residual is at most tol after components are moved to bounds that
       they are close to, or after rounding errors are removed from zeros
       (`Point.alternatives`).
    3. The same holds with entries of q replaced by 0 if they are rounding errors of 0,
       or bounds of rows without entries, although no z satisfies these rows as stored.
    4. An exact solution is proved to exist close to the point: the point is the rounded
       sum of a reference point and a distance, with more digits than double precision
       has; or it violates no row relative to the terms of that row, and the basic
       solution of its active set is enclosed; or it is the exact solution up to its
       last digits (`nearby_solutions`); or it differs from an exact solution by at most
       tol times the largest entry, in a solution that decays (`small_entries`).
    5. There is no proof against the solution of decision 4: if that solution might not
       exist for entries of M that differ by their rounding errors, a proof is sought
       that the problem is infeasible up to rounding. If there is one, the problem is
       ill-posed.

    Decisions 1 to 3 are made for one point after the other, then 4 and 5. Four choices
    matter:

    - Decision 4 holds for `check` as for a run: a rounded sum is a solution to the
      tolerance, whoever asks. It is made for the points of decision 2 as well, as
      rounding errors in other components do not make a solution less close.
    - Decision 5 is part of verification, and not left out for results of methods.
    - Every point is tested by all decisions, as the last iterate or the best one may be
      the one that is accepted.
    - `Extent.last` says how far a caller goes; it does not change which points are
      solutions.

    points : of this problem, as vectors z or as `Point`.
    basis : the basis of a single point, if it differs from the one that z shows.
    """
    made: list[Point] = []
    for candidate in points:
        point = candidate
        if not isinstance(point, Point):
            point = Point(Criterion(problem, tol), point, is_admissible=False)
        if extent.first <= WITHOUT_ROUNDING:
            acceptance = _by_criterion(point, extent, basis)
            if acceptance is not None:
                return acceptance
        made.append(point)
    if extent.last < PROVED or not all(point.is_linear for point in made):
        return None
    with suppress(TimeIsUp), deadline_after(extent.seconds), np.errstate(all="ignore"):
        return _by_proof(made, extent)
    return None


def _by_criterion(
    point: Point, extent: Extent, basis: BasisStatus | None
) -> Acceptance | None:
    """Return the decision by 1 to 3 on a point or, if `extent.share` is not 0, on a
    step; None if it is not accepted.
    """
    if extent.share:
        is_step = point.leaves(extent.share)
        return Acceptance(point, basis=basis) if is_step else None
    if extent.is_exact and point.criterion.problem.n <= FEW_UNKNOWNS:
        return _exactly(point, extent, basis)
    if point.solves():
        reason = point.remark if point.negligible else ""
        return Acceptance(point, reason, basis=basis)
    nearby = next((o for o in alternatives(point, extent) if o.solves()), None)
    # If the decision is about the point itself, this alternative has to be close to it.
    # If it is not, no later one is tested: the more a point is changed, the less its
    # residual says about the original.
    if nearby is None or (extent.as_given and not nearby.is_near(point)):
        return None
    return Acceptance(nearby, nearby.remark, basis=basis)


def alternatives(point: Point, extent: Extent) -> Iterator[Point]:
    """Yield the points that may be accepted instead of one that does not meet the
    tolerance, or that show that it is close to a solution.
    """
    if extent.last < CLEANED or not (extent.as_given or point.nearly_solves()):
        return
    for other in point.alternatives():
        if other.negligible and extent.last < WITHOUT_ROUNDING:
            return
        yield other


def _exactly(
    point: Point, extent: Extent, basis: BasisStatus | None
) -> Acceptance | None:
    """Return the decision by 1 and 2 on a point of a problem with few unknowns, where
    exact arithmetic decides what rounding hides.
    """
    criterion, problem = point.criterion, point.criterion.problem
    nearby: Point | None = point
    if not point.solves():
        nearby = None
        if extent.last >= CLEANED and point.nearly_solves():
            # All terms of a row may be rounding errors, which are removed first.
            clean = Point(criterion, problem.box.project(without_rounding(point.z)))
            others = chain((clean,), alternatives(point, extent))
            nearby = next((other for other in others if other.solves()), None)
    if nearby is None:
        return None
    exact = verified_or_exact(problem, nearby.z, basis)
    if exact is None:
        return Acceptance(nearby, HIDDEN, "doubt")
    if exact.z is nearby.z:
        return Acceptance(nearby, basis=exact.basis)
    nearby = Point(criterion, exact.z)
    return Acceptance(nearby, basis=exact.basis) if nearby.solves() else None


def _by_proof(points: Sequence[Point], extent: Extent) -> Acceptance | None:
    """Return the decision by 4 and 5 on points that do not meet the tolerance."""
    if extent.refutation is not None:
        return _ill_posed(points, extent.refutation)
    doubt: Acceptance | None = None
    for point in points:
        acceptance = _by_nearby_solution(point, points, extent)
        if acceptance is not None and acceptance.verdict != "doubt":
            return acceptance
        doubt = doubt or acceptance
    return doubt


def _by_nearby_solution(
    point: Point, points: Sequence[Point], extent: Extent
) -> Acceptance | None:
    """Return the decision on a point by an exact solution close to it, or to one of its
    alternatives; if the problem is ill-posed, by one close to any of the points.
    """
    with imports:
        from lcpcli.verify import nearby_solutions
        from lcpcli.verify.certificate import proof_near
    problem, tol = point.criterion.problem, point.criterion.tol
    doubt: Acceptance | None = None
    for other in chain((point,), alternatives(point, extent)):
        z = other.z
        if other.negligible or not np.array_equal(problem.box.project(z), z):
            continue
        # An alternative that meets the tolerance was too far away for decision 2.
        if other is not point and (other.solves() or not other.is_near(point)):
            continue
        nearby = nearby_solutions.nearby(problem, z, tol)
        if nearby is None or (nearby.why_unproved and doubt is not None):
            continue
        solution_point = Point(point.criterion, nearby.z)
        refutation = None
        if not nearby.is_stable and extent.last >= UNREFUTED:
            refutation = proof_near(problem, nearby.z)
        if refutation is not None and refutation.is_rounded:
            return _ill_posed(points, refutation)
        if refutation is not None:
            return Acceptance(
                solution_point, refutation.statement, "infeasible", refutation
            )
        if not nearby.is_as_written:
            reason = nearby.reason.format(solution_point.relative_residual)
            return Acceptance(solution_point, reason, "ill_posed")
        if nearby.why_unproved:
            doubt = Acceptance(
                solution_point, nearby.reason.format(nearby.why_unproved), "doubt"
            )
        elif nearby.z is z or not extent.as_given:
            return Acceptance(
                solution_point, nearby.reason.format(solution_point.relative_residual)
            )
        else:
            largest, is_rounding = nearby_solutions.distance(problem, z, nearby.z)
            if largest <= tol or is_rounding:
                return Acceptance(point, DIFFERS.format(largest))
            doubt = Acceptance(point, DIFFERS.format(largest) + UNEXPLAINED, "doubt")
    return _up_to_small_entries(point, points, extent) or doubt


def _up_to_small_entries(
    point: Point, points: Sequence[Point], extent: Extent
) -> Acceptance | None:
    """Return the decision on a point by an exact solution that differs from it in small
    entries only.
    """
    with imports:
        from lcpcli.verify.certificate import proof_near
        from lcpcli.verify.small_entries import solution_up_to_small_entries
    solution = solution_up_to_small_entries(point)
    if solution is None:
        return None
    if not solution.is_stable and extent.last >= UNREFUTED:
        refutation = proof_near(point.criterion.problem, solution.z)
        if refutation is not None:
            return _ill_posed(points, refutation)
    solution_point = Point(point.criterion, solution.z)
    if extent.as_given or extent.keeps:
        return Acceptance(point, solution.statement)
    if solution_point.solves():
        return Acceptance(solution_point)
    again = solution_up_to_small_entries(solution_point)
    return Acceptance(
        solution_point, solution.statement if again is None else again.statement
    )


def _ill_posed(points: Sequence[Point], refutation: Proof) -> Acceptance | None:
    """Return the solution, which need not meet the tolerance, of a problem that is
    infeasible up to rounding.
    """
    with imports:
        from lcpcli.verify.nearby_solutions import large_solution
    criterion = points[0].criterion
    zs = [point.z for point in points]
    large = large_solution(criterion.problem, zs, refutation, criterion.tol)
    if large is None:
        return None
    point = Point(criterion, large[0])
    if point.solves():
        return Acceptance(point, certificate=refutation)
    return Acceptance(point, large[1], "ill_posed", refutation)
