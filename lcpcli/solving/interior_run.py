"""Runs of `auto` on convex programs that `interior` in compiled form completes, before anything else is tried."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from lcpcli.clock import Stopwatch, imports
from lcpcli.interrupts import TimeIsUp, interruptibly, within
from lcpcli.linalg.matrices import compressed, is_sparse
from lcpcli.methods import direct
from lcpcli.methods import registry as methods
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import Program
from lcpcli.options import Limits
from lcpcli.solving.direct_run import solution
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

Kernel = Callable[..., tuple[Vector, int, int, float]]

MOST_QUICK_UNKNOWNS, MOST_QUICK_OPERATIONS = 3000, 1e6  # of a factorization, for a run that takes at most a tenth of a
# second, so that it need not be interruptible
MOST_OPERATIONS = 1e9  # of a factorization, beyond which others compute it faster: half a second


def may_apply(problem: Problem) -> bool:
    """Return whether a problem has the form of the conditions of a program with rows, without a start of its own."""
    if problem.x0 is not None:
        return False
    if isinstance(problem.origin, Program):
        return problem.n > problem.origin.variables
    return is_sparse(problem.M) and not problem.M.diagonal().all() and problem.signs is not None


def solved_by_interior(problem: Problem, limits: Limits, chosen: dict[str, Any], stopwatch: Stopwatch) -> Result | None:
    """Return the result of a problem to which this may apply, if the kernels of `interior` find a solution; else None.

    chosen : the options of `auto` that are given."""
    in_force = methods.options_in_force("auto", problem, chosen)
    with imports:
        from lcpcli.methods import compiled_interior
    given = conditions_of(problem)
    M = compressed(given.M)
    arrays = M.indptr.astype(np.int32), M.indices.astype(np.int32), M.data, given.q, given.lower, given.upper
    stopwatch.count("setup")
    try:
        with within(limits.time_limit - stopwatch.elapsed()):
            z, steps, factorizations = _answer(compiled_interior.run, arrays)
    except TimeIsUp:
        return None
    stopwatch.count("solve")
    point = None
    if 0 < steps <= limits.max_iterations:
        criterion = Criterion(compiled_interior.with_units(problem, arrays), limits.tol)
        point = _solution(Point(criterion, z))
    stopwatch.count("verify")
    if point is None or stopwatch.total >= limits.time_limit:
        return None
    fields = {"problem": problem, "point": point, "parts": stopwatch.parts, "limits": limits, "options": in_force}
    fields["message"] = Status.SOLVED.sentence(point.counted_as_0)
    return solution(fields, steps, ("interior",), factorizations)


def _answer(run: Kernel, arrays: tuple[Any, ...]) -> tuple[Vector, int, int]:
    """Return z and the numbers of steps and of factorizations, from the arrays of a problem."""
    stop = np.zeros(1, dtype=np.int8)
    if arrays[3].size <= MOST_QUICK_UNKNOWNS:
        z, steps, factorizations, operations = run(*arrays, MOST_QUICK_OPERATIONS, stop)
        if not MOST_QUICK_OPERATIONS < operations <= MOST_OPERATIONS:
            return z, steps, factorizations
    try:
        z, steps, factorizations, _ = interruptibly(partial(run, *arrays, MOST_OPERATIONS, stop))
    except BaseException:
        stop[0] = 1  # the thread goes on until its next step
        raise
    return z, steps, factorizations


def _solution(point: Point) -> Point | None:
    """Return the point, or one near it, that solves the problem; None where exact arithmetic has more to say."""
    problem = point.criterion.problem
    if problem.n > FEW_UNKNOWNS:
        return point.solution()
    return None if direct.hides_terms(problem, point.z) or not point.solves() else point
