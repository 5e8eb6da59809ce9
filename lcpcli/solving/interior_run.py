"""Runs of `auto` on convex programs that `interior` in compiled form completes, before anything else is tried."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import Stopwatch, imports
from lcpcli.interrupts import TimeIsUp, interruptibly, within
from lcpcli.linalg.matrices import compressed, is_sparse
from lcpcli.methods import registry as methods
from lcpcli.methods.final_states import hides_terms
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import Program
from lcpcli.options import Limits
from lcpcli.solving.direct_run import applies, compiled, judge, solution
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

# A run with so few unknowns, and operations of a factorization, takes at most a tenth of a second, so that Ctrl-C and
# time limits can wait for it.
MOST_QUICK_UNKNOWNS, MOST_QUICK_OPERATIONS = 3000, 1e6
MOST_UNKNOWNS, MOST_OPERATIONS = 50_000, 1e9  # of a factorization: what is larger, others compute faster
METHOD = "interior"


class _Answer(NamedTuple):
    """What `interior_kernels.interior` returns."""

    z: Vector
    ray: Vector
    steps: int
    factorizations: int
    operations: float


def may_apply(problem: Problem) -> bool:
    """Return whether a problem has the form of the conditions of a program with rows, without a start of its own, and
    is a program, or too large for pivoting, as it takes longer to find the form."""
    if problem.x0 is not None or problem.n > MOST_UNKNOWNS:
        return False
    if isinstance(problem.origin, Program):
        return problem.n > problem.origin.variables
    if not is_sparse(problem.M) or applies(problem) or problem.M.diagonal().all():
        return False
    return problem.signs is not None


def solved_by_interior(problem: Problem, limits: Limits, chosen: dict[str, Any], stopwatch: Stopwatch) -> Result | None:
    """Return the result of a problem to which this may apply, if the kernels of `interior` find a solution, or a proof
    that there is none; else None.

    chosen : the options of `auto` that are given.
    """
    in_force = methods.options_in_force("auto", problem, chosen)
    with imports:
        from lcpcli.kernels import compiled_interior
    given = conditions_of(problem)
    M = compressed(given.M)
    arrays = M.indptr.astype(np.int32), M.indices.astype(np.int32), M.data, given.q, given.lower, given.upper
    stopwatch.count("setup")
    fields: dict[str, Any] | None = None
    try:
        with within(limits.time_limit - stopwatch.elapsed()):
            answer = _answer(compiled_interior.run, arrays)
            stopwatch.count("solve")
            if 0 < answer.steps <= limits.max_iterations:
                criterion = Criterion(problem, limits.tol, judge=judge)
                fields = _refuted(criterion, answer) if answer.ray.size else _solved(criterion, answer)
            stopwatch.count("verify")
    except TimeIsUp:
        return None
    if fields is None or stopwatch.total >= limits.time_limit:
        return None
    fields |= {"problem": problem, "parts": stopwatch.parts, "limits": limits, "options": in_force}
    return solution(fields, answer.steps, (METHOD,), answer.factorizations)


def _answer(run: Callable[..., Any], arrays: tuple[Any, ...]) -> _Answer:
    """Return the answer of the kernel to a problem in arrays."""
    stop = np.zeros(1, dtype=np.int8)
    if arrays[3].size <= MOST_QUICK_UNKNOWNS:
        answer = _Answer(*run(*arrays, MOST_QUICK_OPERATIONS, stop))
        if not MOST_QUICK_OPERATIONS < answer.operations <= MOST_OPERATIONS:
            return answer
    try:
        return _Answer(*interruptibly(partial(run, *arrays, MOST_OPERATIONS, stop)))
    except BaseException:
        stop[0] = 1  # the thread goes on until its next step
        raise


@np.errstate(all="ignore")
def _solved(criterion: Criterion, answer: _Answer) -> dict[str, Any] | None:
    """Return the fields of a result for a z, or a point near it, that solves the problem; None where it does not, or
    exact arithmetic has more to say."""
    problem, point = criterion.problem, Point(criterion, answer.z)
    if problem.n > FEW_UNKNOWNS:
        if problem.is_moderate and not point.solves() and (fast := compiled()) is not None:
            fast.with_units(problem)  # by which other points are measured
        found = point.solution()
    else:
        found = None if hides_terms(problem, point.z) or not point.solves() else point
    return None if found is None else {"point": found, "message": Status.SOLVED.sentence(found.counted_as_0)}


@np.errstate(all="ignore")
def _refuted(criterion: Criterion, answer: _Answer) -> dict[str, Any] | None:
    """Return the fields of a result for a ray that, rounded, is an exact proof that there is no solution; else None."""
    with imports:
        from lcpcli.methods.interior_scaling import proof_of, slack_form
        from lcpcli.verify.certificate import confirm
    problem = criterion.problem
    form = slack_form(problem)
    claim = proof_of(problem, form, (answer.ray[form.kept] / form.units,))
    certificate = None if claim is None else confirm(problem, claim, False)
    if certificate is None or certificate.is_rounded:
        return None
    status = Status.INFEASIBLE
    point = Point(criterion, answer.z)
    return {
        "point": point,
        "status": status,
        "message": status.sentence(certificate.statement),
        "certificate": certificate,
    }
