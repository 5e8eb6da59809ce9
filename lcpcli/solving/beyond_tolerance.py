"""What to conclude from a run whose points are solutions up to rounding, or run-offs, but not within the tolerance."""

from __future__ import annotations

from typing import NamedTuple

from lcpcli.solving.status import Status
from lcpcli.verify.certificate import Certificate
from lcpcli.verify.ill_posed import is_run_off, large_solution, proof_near, statement
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.refinement import is_rounded_solution, is_rounding

ROUNDED = "z is the exact solution up to rounding of its last digits, which leaves a relative residual of {:.1e}"


class Conclusion(NamedTuple):
    """The point to report, the status that it justifies and the reason; with the proof of an ill-posed problem."""

    point: Point
    reason: str
    status: Status
    certificate: Certificate | None = None


def conclusion(criterion: Criterion, last: Point, best: Point, rounded: Certificate | None) -> Conclusion | None:
    """Return the conclusion from the last and the best iterate, neither of which meets the criterion: the problem is
    ill-posed if one of them leads to a solution beyond it, and there is a proof but for rounding. None if neither is a
    solution up to rounding or a run-off.

    rounded : a proof but for rounding, if one is known. Without one, a solution up to rounding is a solution.
    """
    problem, tol, points = criterion.problem, criterion.tol, [last.z, best.z]
    if rounded is None:
        is_solution = is_rounded_solution(problem, last.z)
        as_solved = Conclusion(last, ROUNDED.format(last.relative_residual), Status.SOLVED)
        if not is_solution and is_rounding(problem, last.z, tol):
            return as_solved
        run_off = next((z for z in points if is_solution or is_run_off(problem, z, tol)), None)
        if run_off is None:
            return None
        rounded = proof_near(problem, run_off, exactly=not is_solution)
        if rounded is None or not rounded.is_rounded:
            return as_solved if is_solution else None
    assert rounded.vector is not None
    found = large_solution(problem, points, rounded.vector, tol)
    if found is None:
        return None
    point = Point(criterion, found.z)
    if point.solves():
        return Conclusion(point, "", Status.SOLVED)
    return Conclusion(point, statement(found, tol, rounded), Status.ILL_POSED, rounded)
