"""What becomes of a solved program whose objective is known to few digits, although its
conditions hold to the tolerance (see `verify.objective`).

Where all methods may take part, the run continues: by proximal steps on the active set,
and by more steps of PIQP, whose duality gap keeps falling after its residuals. The
point with the smallest error of its objective is reported, if it is accepted like any
other.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from lcpcli.clock import imports, seconds
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.methods.direct import may_be_program
from lcpcli.methods.stages import FAULTS, Iterate, advance
from lcpcli.solving.result import Result, Status
from lcpcli.solving.trace import TraceRow
from lcpcli.verify.acceptance import WITHOUT_ROUNDING, Extent, accepted
from lcpcli.verify.objective import objective_error_at, statement

# Relative to the objective: the error above which the run continues.
MAX_ERROR = 1e-6
# Steps of PIQP, where its gap falls slowly, as multipliers are huge.
MAX_STEPS = 500


def with_objective(result: Result, may_go_on: bool) -> Result:
    """Return the result of a solved program, with a better objective if its error is
    large and the run may continue; not solved if the error exceeds the limit on the
    gap."""
    gap = result.limits.gap
    if may_go_on:
        error = objective_error_at(result.problem, result.point)
        if error > min(MAX_ERROR, gap) and may_be_program(result.problem):
            result = _improved(result, error)
    if gap == math.inf or not (result.objective_error or 0.0) > gap:
        return result
    reason = (
        f"{statement(result.objective_error or 0.0)}, and gap = {gap:g} requires more"
    )
    message = Status.STALLED.sentence(reason)
    return replace(result, status=Status.STALLED, message=message, end=None)


@np.errstate(all="ignore")
def _improved(result: Result, error: float) -> Result:
    """Return the result at the point with the smallest error of its objective."""
    problem = result.problem
    limits = result.limits
    began = seconds()
    best = result.point
    steps = 0
    method = ""
    extra = Extent(WITHOUT_ROUNDING)
    with (
        suppress(TimeIsUp, *FAULTS),
        deadline_after(limits.time_limit - result.seconds),
    ):
        for k, (name, step) in enumerate(_finish(result), 1):
            z = problem.box.z_of(step.x)
            acceptance = accepted(problem, [problem.box.project(z)], limits.tol, extra)
            if acceptance is None:
                continue
            objective_error = objective_error_at(problem, acceptance.point)
            if objective_error < error:
                best = acceptance.point
                error = objective_error
                steps = k
                method = name
            if error <= MAX_ERROR:
                break
    parts = dict(result.parts)
    parts["solve"] += seconds() - began
    if not steps:
        return replace(result, parts=parts)
    iterations = result.iterations + steps
    for trace in filter(None, (result.trace, result.curve)):
        at, x = sum(parts.values()), problem.box.x_of(best.z, best.w)
        row = TraceRow(iterations, best.z, None, None, at, "finish", method, x=x)
        trace.add(row, best.criterion)
        trace.close(best.criterion)
    return replace(
        result,
        point=best,
        message=Status.SOLVED.sentence(best.remark),
        iterations=iterations,
        parts=parts,
        route=tuple(dict.fromkeys((*result.route, method))),
        nearest=method,
        end=None,
    )


def _finish(result: Result) -> Iterator[tuple[str, Iterate]]:
    """Yield iterates that may have a better objective, with their methods."""
    with imports:
        from lcpcli.methods.convex_program import convex_program
        from lcpcli.methods.interior import at_point
    problem = result.problem
    x = problem.box.x_of(result.z, result.w)
    stages = (
        ("interior", at_point(problem, x)),
        ("piqp", convex_program(problem, MAX_STEPS)),
    )
    for name, stage in stages:
        while isinstance(step := advance(stage), Iterate):
            yield name, step
