"""Runs of `auto` on convex programs that PIQP and one basic solution complete: no loop, and the same results."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.clock import Stopwatch
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.methods import registry as methods
from lcpcli.methods.convex_program import convex_program
from lcpcli.methods.stages import FAULTS, Breakdown, Iterate, Tried, advance, ended
from lcpcli.model.problem import Problem
from lcpcli.options import Limits
from lcpcli.solving.direct_run import solution
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

METHOD = "piqp"
ROUNDED_ZERO = 2.0**-53  # of the largest component in the units of M: what elimination leaves of zeros is smaller


@np.errstate(all="ignore")
def solved_as_program(
    problem: Problem, limits: Limits, chosen: dict[str, Any], stopwatch: Stopwatch, tried: Tried | None
) -> Result | None:
    """Return the result of a problem whose solution PIQP leads to; else None.

    chosen : the options of `auto` that are given. tried : receives an ended stage, so that it is not tried again.
    """
    in_force = methods.options_in_force("auto", problem, chosen)
    stopwatch.count("setup")
    point, steps, last = None, 0, None
    try:
        with within(limits.time_limit - stopwatch.elapsed()):
            stage = convex_program(problem)
            while isinstance(step := advance(stage), Iterate):
                last, steps = step, steps + 1
            stopwatch.count("solve")
            if last is not None and steps <= limits.max_iterations:
                criterion, z = Criterion(problem, limits.tol), problem.box.z_of(last.x)
                point = Point(criterion, _without_rounding(problem, z))
                point = point if point.solves() else Point(criterion, z).solution()
            stopwatch.count("verify")
    except TimeIsUp:
        return None
    except FAULTS:
        point = None
    if point is None:
        if tried is not None:
            tried[METHOD] = [ended(Breakdown("PIQP does not lead to a solution"))]
        return None
    if stopwatch.total >= limits.time_limit:
        return None
    fields = {"problem": problem, "point": point, "parts": stopwatch.parts, "limits": limits, "options": in_force}
    fields["message"] = Status.SOLVED.sentence(point.counted_as_0)
    return solution(fields, steps, (METHOD,))


def _without_rounding(problem: Problem, z: Vector) -> Vector:
    """Return z, within its bounds, without components that are surely rounding of 0."""
    sizes = np.abs(z) * np.exp2(-problem.units.columns)
    return problem.box.project(np.where(sizes <= ROUNDED_ZERO * sizes.max(), 0.0, z))
