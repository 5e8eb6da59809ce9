"""Whether a point solves a problem: `accepted` is the only place that decides it.

What it decides with stands elsewhere: the criterion in `measure` and `point`, exact
states of a few unknowns in `final_states`, solutions that are proved to exist near a
point in `nearby_solutions`, and proofs that there is none in `certificate`.
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
from lcpcli.typing import States, Vector
from lcpcli.verify.final_states import verified_or_exact, without_rounding
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from lcpcli.verify.certificate import Proof

# The decisions of `accepted`, by number.
AS_IT_IS = 1
CLEANED = 2
WITHOUT_ROUNDING = 3
PROVED = 4
UNREFUTED = 5


class Acceptance(NamedTuple):
    """What a point is worth.

    verdict : "solved"; or that it is a solution only of the problem as stored, which is
        "ill_posed"; or that there is none, "infeasible"; or "doubt", where it violates
        no row by its own terms, and neither a solution near it nor a proof that there
        is none was found.
    point : the point itself, or one near it that is accepted in its place.
    reason : why, as a clause for the user; "" where the criterion says it all.
    certificate : the proof that there is no solution, if one was found.
    basis : its states, if they were given, or those of the exact solution.
    """

    point: Point
    reason: str = ""
    verdict: Literal["solved", "ill_posed", "infeasible", "doubt"] = "solved"
    certificate: Proof | None = None
    basis: States | None = None

    @property
    def solved(self) -> bool:
        return self.verdict == "solved"


class Extent(NamedTuple):
    """How far `accepted` goes.

    first, last : the decisions with which it begins and ends.
    keeps : whether a point itself is answered where a solution beside it has other
        small entries, as for a method by name.
    as_given : whether a point itself is to be judged, which may differ from a solution
        by no more than the tolerance; else what it leads to may be answered in its
        place.
    is_exact : whether for few unknowns exact arithmetic decides at once where rounding
        hides a term, as `auto` does.
    seconds : how long proofs may take.
    refutation : a proof that only the rounding of M leaves a solution, if one is known.
    share : if it is not 0, of the natural residual of 0: a point counts that leaves no
        more, as the step of a linearization, which need be no solution.
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
HIDDEN = "rounding hides a term of a row, and no exact solution was found near it"
DIFFERS = "it differs by {:.1e} from an exact solution with its states"
UNEXPLAINED = ", which is more than rounding in a system with these states explains"


def accepted(
    problem: Problem,
    points: Sequence[Point | Vector],
    tol: float,
    extent: Extent = IN_FULL,
    basis: States | None = None,
) -> Acceptance | None:
    """Return what the first acceptable point is worth; None if all are refused.

    A point is accepted by the first of these decisions that holds:

    1. Its relative residual is at most tol.
    2. That of the point is, once components are put on bounds that they are close to,
       or freed from rounding (`Point.alternatives`).
    3. It is so with entries of q counted as 0, as they are rounding of it, or sides of
       rows without entries, although no z satisfies these as the numbers stand.
    4. An exact solution is proved to exist near it: it is the sum of a reference point
       and a distance that has more digits than doubles hold; or it violates no row by
       its own terms, and the basic solution of its states is enclosed; or it is the
       exact solution up to its last digits (`nearby_solutions`); or it differs from
       that solution by no more than tol of its largest entry, where it decays
       (`small_entries`).
    5. And nothing speaks against that solution: where it might not exist for entries of
       M that differ by their rounding, a proof that the problem is infeasible up to
       rounding is sought. If there is one, the problem is ill-posed.

    The first three are tried for one point after the other, then the others.

    Before they were made here, they were made in eight places, in other orders. Where
    these disagreed, this is what is right, and why:

    - A run accepted a rounded difference, and `check` did not: it is a solution to the
      tolerance, with digits that doubles do not hold, whoever asks.
    - A result counted as verified without the fifth decision. It is part of the claim.
    - `check` proved solutions also near cleaned points, a run only near its iterates.
      Noise in other components does not make a solution less near.
    - A run asked only of its last iterate whether it is a rounded difference, and of
      the best one for the rest. Each may be the better one.
    - `auto` tried no cleaned points of few unknowns but its own; those of `Point` are
      tried as well. What is accepted is exact there in any case.
    - The first stages of `auto` leave entries of q that count as 0 to later ones, which
      may do without; its convex programs did not. That is a matter of how far a caller
      goes (`Extent.last`), as it does not change what is true.

    points : of this problem, each as it is or with its measures.
    basis : the states of a single point, if they are not those that it shows.
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
    point: Point, extent: Extent, basis: States | None
) -> Acceptance | None:
    """Return what the first three decisions say of a point."""
    if extent.share:
        is_step = point.leaves(extent.share)
        return Acceptance(point, basis=basis) if is_step else None
    if extent.is_exact and point.criterion.problem.n <= FEW_UNKNOWNS:
        return _exactly(point, extent, basis)
    if point.solves():
        reason = point.remark if point.negligible else ""
        return Acceptance(point, reason, basis=basis)
    nearby = next((o for o in alternatives(point, extent) if o.solves()), None)
    # Of a point that is given only the first one counts: the more a point is changed,
    # the less it says about the given one, whatever the distance.
    if nearby is None or (extent.as_given and not nearby.is_near(point)):
        return None
    return Acceptance(nearby, nearby.remark, basis=basis)


def alternatives(point: Point, extent: Extent) -> Iterator[Point]:
    """Yield the points that may be accepted in place of one that does not meet the
    criterion, or that show that it is near a solution."""
    if extent.last < CLEANED or not (extent.as_given or point.nearly_solves()):
        return
    for other in point.alternatives():
        if other.negligible and extent.last < WITHOUT_ROUNDING:
            return
        yield other


def _exactly(point: Point, extent: Extent, basis: States | None) -> Acceptance | None:
    """Return what the first two decisions say of a point of a problem with few
    unknowns, where exact arithmetic decides what rounding hides."""
    criterion, problem = point.criterion, point.criterion.problem
    nearby: Point | None = point
    if not point.solves():
        nearby = None
        if extent.last >= CLEANED and point.nearly_solves():
            # A row may be filled by rounding alone.
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
    """Return what the last two decisions say of points that do not meet the
    criterion."""
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
    """Return what an exact solution near a point, or near one of its alternatives, says
    of it; of several points, if the problem is ill-posed."""
    with imports:
        from lcpcli.verify import nearby_solutions
        from lcpcli.verify.certificate import proof_near
    problem, tol = point.criterion.problem, point.criterion.tol
    doubt: Acceptance | None = None
    for other in chain((point,), alternatives(point, extent)):
        z = other.z
        if other.negligible or not np.array_equal(problem.box.project(z), z):
            continue
        # One that meets the criterion was too far from the point for decision 2.
        if other is not point and (other.solves() or not other.is_near(point)):
            continue
        nearby = nearby_solutions.nearby(problem, z, tol)
        if nearby is None or (nearby.fault and doubt is not None):
            continue
        refutation = None
        if not nearby.is_stable and extent.last >= UNREFUTED:
            refutation = proof_near(problem, nearby.z)
        if refutation is not None and refutation.is_rounded:
            return _ill_posed(points, refutation)
        solution_point = Point(point.criterion, nearby.z)
        if refutation is not None:
            return Acceptance(
                solution_point, refutation.statement, "infeasible", refutation
            )
        if nearby.fault:
            doubt = Acceptance(
                solution_point, nearby.reason.format(nearby.fault), "doubt"
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
    """Return what an exact solution says of a point that differs from it in small
    entries."""
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
    """Return the solution, beyond the criterion, of a problem that is infeasible but
    for rounding."""
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
