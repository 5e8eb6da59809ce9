"""What to conclude from a run whose points are solutions up to rounding, or run-offs, but not within the tolerance."""

from __future__ import annotations

from typing import NamedTuple

from lcpcli.solving.result import Status
from lcpcli.verify.certificate import Certificate
from lcpcli.verify.exact_solution import is_rounded_difference
from lcpcli.verify.ill_posed import Settled, large_solution, settled, statement
from lcpcli.verify.point import Criterion, Point

ROUNDED = "z is the exact solution up to rounding of its last digits, which leaves a relative residual of {:.1e}"
ENCLOSED = (
    "an exact solution is proved to have the states of z, which is large beside q: its relative residual is {:.1e}"
)
DOUBT = "z satisfies each row by its own terms but is too large to be a solution beyond doubt, and {}"


class Conclusion(NamedTuple):
    """The point to report, the status that it justifies and the reason; with the proof of an ill-posed problem."""

    point: Point
    reason: str
    status: Status
    certificate: Certificate | None = None


def conclusion(criterion: Criterion, last: Point, best: Point, rounded: Certificate | None) -> Conclusion | None:
    """Return the conclusion from the last and the best iterate, neither of which meets the criterion: the problem is
    ill-posed if one of them leads to a solution beyond it, and there is a proof but for rounding. None if neither is a
    solution up to rounding or a run-off; STALLED with the reason if a run-off stays in doubt.

    rounded : a proof but for rounding, if one is known. Without one, a solution up to rounding is a solution.
    """
    problem, tol, points = criterion.problem, criterion.tol, [last.z, best.z]
    if rounded is None:
        if is_rounded_difference(problem, last.z, tol):
            return Conclusion(last, ROUNDED.format(last.relative_residual), Status.SOLVED)
        doubt = settled(problem, last.z, tol) or settled(problem, best.z, tol)
        if doubt is None:
            return None
        rounded = doubt.certificate
        if rounded is None or not rounded.is_rounded:
            return _without_rounding(Point(criterion, doubt.z), doubt, rounded)
    assert rounded.vector is not None
    large = large_solution(problem, points, rounded.vector, tol)
    if large is None:
        return None
    point = Point(criterion, large.z)
    if point.solves():
        return Conclusion(point, "", Status.SOLVED)
    return Conclusion(point, statement(large, tol, rounded), Status.ILL_POSED, rounded)


def _without_rounding(point: Point, doubt: Settled, proof: Certificate | None) -> Conclusion:
    """Return the conclusion from what became of a doubt, with an exact proof that there is no solution, or none."""
    if proof is not None:
        return Conclusion(point, proof.statement, Status.INFEASIBLE, proof)
    if doubt.fault:
        return Conclusion(point, DOUBT.format(doubt.fault), Status.STALLED)
    return Conclusion(point, ENCLOSED.format(point.relative_residual), Status.SOLVED)
