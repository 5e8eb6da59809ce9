"""Columns of Q one after another, each from the solution of the last: for M that is sparse or very large.

The states of the last solution are tried first: if q has changed little, their basic solution is the next one, or a few
exchanges away (as in `methods.newton`), and the factors for these states are at hand. Whether that pays is seen: what
does not solve a problem faster than `auto` did is tried less and less often.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np

from lcpcli.clock import Stopwatch, seconds
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.krylov import norm
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.stages import FAULTS
from lcpcli.model.box import Basis
from lcpcli.model.columns import Columns
from lcpcli.model.problem import Problem
from lcpcli.solving.call import run
from lcpcli.solving.limits import Limits
from lcpcli.solving.result import Result, Status
from lcpcli.verify.basic_solution import BasicSolutions
from lcpcli.verify.point import Criterion, Point

AUTO = "auto"
STEPS = 3  # basic solutions that are tried
CLOSE = 0.9  # the cosine of the angle between two q from which their solutions may have the same states


def one_after_another(columns: Columns, limits: Limits, given: dict[str, Any]) -> Iterator[Result]:
    """The results of all columns, in order; given are the options, of which limits are part."""
    solver = PrincipalSolver(columns.like.M)
    last: Result | None = None
    paused, pause, usual = 0, 1, math.inf
    for problem in columns.problems():
        result, basis = None, None if last is None else _states(last, problem)
        if basis is not None and not paused:
            result = _near(problem, basis, solver, limits, threads=given.get("threads"))
            pause = 1 if result is not None and result.seconds < usual else 2 * pause
            paused = pause if pause > 1 else 0
        paused = max(paused - 1, 0)
        if result is None:
            result = run(problem, **given)
            usual = result.seconds
        last = result if result.solved else last
        yield result


@np.errstate(over="ignore", invalid="ignore")
def _states(last: Result, problem: Problem) -> Basis | None:
    """Those of the last solution; None if q has turned far away from that of the last problem, or lies elsewhere."""
    q, before = problem.q, last.problem.q
    if problem.reference_z is not None or q @ before < CLOSE * norm(q) * norm(before):
        return None
    return problem.box.basis_of(problem.box.x_of(last.z, last.w))


@with_limited_threads
@np.errstate(over="ignore", invalid="ignore")
def _near(
    problem: Problem,
    basis: Basis,
    solver: PrincipalSolver,
    limits: Limits,
    threads: int | None,  # noqa: ARG001 (the decorator limits them)
) -> Result | None:
    """The result, if the problem is solved by these states or by a few exchanges from them."""
    stopwatch = Stopwatch(seconds, seconds())
    pivoting = islice(BasicSolutions(problem, solver).exchanging(basis), min(STEPS, limits.max_iterations))
    try:
        with within(limits.time_limit):
            steps, found = next((k, found) for k, found in enumerate(pivoting, 1) if found.is_solution)
    except (*FAULTS, SingularMatrix, TimeIsUp, StopIteration):
        return None
    stopwatch.count("solve")
    point = Point(Criterion(problem, limits.tol), problem.box.z_of(problem.box.x_within(found.z, found.w, found.basis)))
    if not point.solves():
        return None
    stopwatch.count("verify")
    return Result(
        problem=problem,
        method=AUTO,
        status=Status.SOLVED,
        message=Status.SOLVED.told(problem, ""),
        point=point,
        iterations=steps,
        evaluations=steps,
        parts=stopwatch.parts,
        limits=limits,
        warm=False,
        options=methods.options_in_force(AUTO, problem, {"time_limit": limits.time_limit}),
        trace=None,
        curve=None,
        route=("newton",),
        certificate=None,
    )
