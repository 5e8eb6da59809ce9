"""A run of a method on a problem: its options are checked, and it is set up and run by
the loop. Of repeated runs the fastest is reported, so that other work on the machine
has little effect."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.clock import Stopwatch, imports, seconds
from lcpcli.errors import LEAVE_OUT, OptionError, ParameterError, kind
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import (
    MAX_NARROW_AS_DENSE,
    MIN_FOR_PIQP,
    stored,
    with_M,
)
from lcpcli.model.arrays import as_vector
from lcpcli.model.changes import (
    USUAL,
    Change,
    composed,
    is_of_usual_size,
    shifted,
)
from lcpcli.model.changes import scale as in_natural_units
from lcpcli.model.problem import Problem
from lcpcli.options import DEFAULTS, Limits
from lcpcli.solving import direct_run
from lcpcli.solving.direct_run import Session
from lcpcli.solving.observers import NOBODY, Seen
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector, VectorLike
from lcpcli.verify.acceptance import Extent, accepted
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from lcpcli.methods.stages import Stage
    from lcpcli.model.words import Start
    from lcpcli.solving.loop import Loop
    from lcpcli.solving.observers import Observe
    from lcpcli.solving.trace import Callback, Trace

# A run of at most BRIEF seconds is repeated to show its time, for BRIEF seconds more,
# and at most FEW_REPETITIONS times: nobody notices the wait.
BRIEF, FEW_REPETITIONS = 0.02, 4
# Seconds up to which a compared run is repeated; in a longer run, pauses of the machine
# have little effect.
LONGEST_REPEATED = 1.0
MAX_REPETITIONS = 20  # after which the shortest time hardly decreases
# Seconds of repetitions after which no other one begins, so that a comparison of many
# runs stays short.
REPETITION_SECONDS = 0.3
# Methods whose rows hold to a tolerance; those of basic solutions hold up to rounding,
# and no further step would improve their objective.
INEXACT = frozenset(("piqp", "interior"))


@with_limited_threads
def run(
    problem: Problem,
    method: str,
    x0: VectorLike | None = None,
    *,
    z0: VectorLike | None = None,
    basis: Sequence[str] | None = None,
    limits: Limits | None = None,
    trace: Trace | None = None,
    curve: Trace | None = None,
    observe: Observe | None = None,
    callback: Callback | None = None,
    clock: Callable[[], float] = seconds,
    began: float | None = None,
    scale: bool = False,
    finish: bool = False,
    threads: int | None = None,  # noqa: ARG001 (the decorator limits them)
    compiled: bool | None = None,
    **chosen: Any,
) -> Result:
    """Run a method, as `call.solve` explains it; `call.run` calls this driver.

    The status is "solved" only if the relative residual, recomputed from the original M
    and q, is at most limits.tol, or if exact arithmetic shows that z is the solution up
    to its last digits. `chosen` are options of the method; any other raises an
    OptionError. `trace` and `curve` keep iterates, each as it is set up. `observe` is
    called at intervals with the progress. `began` is the beginning of the run by the
    `clock`, by default now; the time limit covers everything from then on except
    imports.
    """
    stopwatch = Stopwatch(clock, clock() if began is None else began)
    is_auto, additions = method == "auto", dict[str, Any]()
    if scale or finish:
        wanted = {"scale": scale, "finish": finish}
        additions = {name: True for name, value in wanted.items() if value}
    if not is_auto or additions or callback is not None:
        _refuse_other(method, additions, compiled, callback)
    compiled = direct_run.uses_kernels(compiled, 1) and is_auto
    may_be_thin = is_auto and problem.n > MAX_NARROW_AS_DENSE
    stored_problem = with_M(problem, stored(problem.M)) if may_be_thin else problem
    start = None
    if not (x0 is z0 is basis is None):
        start = _start(stored_problem, method, {"x0": x0, "z0": z0, "basis": basis})
    options = methods.OF_AUTO.copy() if is_auto else {}
    if is_auto and chosen:
        options = methods.options_in_force(method, stored_problem, chosen)
    seen = NOBODY
    if (trace, curve, observe, callback) != (None,) * 4:
        seen = Seen((trace, curve), observe, callback)
    session = Session(
        stored_problem,
        limits or DEFAULTS,
        options,
        stopwatch,
        compiled,
        start,
        {} if start is None else None,
        is_shown=seen is not NOBODY,
        change=_units_of(stored_problem) if is_auto else None,
    )
    result = None
    if is_auto and not session.is_shown:
        try:
            result = direct_run.answered(session)
        except KeyboardInterrupt:  # the loop is to say that it has ended the attempts
            session.interrupted = True
    if result is None:
        result = _in_loop(session, method, seen, chosen, additions)
    return _of(problem, result, compiled, is_auto or finish)


def _in_loop(
    session: Session,
    method: str,
    seen: Seen,
    chosen: dict[str, Any],
    additions: dict[str, Any],
) -> Result:
    """Return the result of a session whose method is run by the loop, with its options
    and additions."""
    problem, start = session.problem, session.start
    rounded, is_shown = problem.rounded_rows, session.is_shown and method == "auto"
    if rounded is not None:
        # The recorded stages are those of the other problem.
        M, q, lower, upper = rounded.conditions
        problem = Problem(M, q, lower=lower, upper=upper, origin=problem.origin)
        session.recorded_stages, is_shown = {}, False
        session.change = _units_of(problem) if method == "auto" else None
    with imports:
        from lcpcli.solving.loop import Loop
    with np.errstate(all="ignore"):  # overflow gives infinity
        x = problem.start if start is None else start.x
        change = session.change
        if change is None:
            change = variables_of(method, problem, "scale" in additions)
        options = _with_second_point(method, problem, chosen, start is not None)
        in_force = methods.options_in_force(method, change.problem, options)
        stages_before: dict[str, Any] = {}
        if method == "auto":
            stages_before = (
                {"recorded_stages": session.recorded_stages}
                if start is None
                else start.known_to_auto
            )
        finishes = "finish" in additions
        shown: Callable[[Callable[[], Stage]], Stage] | None = None
        if is_shown:
            with imports:
                from lcpcli.solving import direct_stage
            shown = partial(direct_stage.shown, session.within)
        in_force_at_first = in_force | stages_before
        stage = partial(_stage, method, change, x, in_force_at_first, finishes, shown)
        session.options = in_force | additions
        session.stopwatch.count("setup")
        acceptance_test = direct_run.acceptance_test if session.is_compiled else None
        criterion = Criterion(
            problem, session.limits.tol, acceptance_test=acceptance_test
        )
        loop = Loop(session, criterion, method, x, seen)
        loop.finishes = method == "auto" or finishes
        result = ended(loop, stage)
        return result if rounded is None else _of_literal(session.problem, result)


def _with_second_point(
    method: str, problem: Problem, chosen: dict[str, Any], has_start: bool
) -> dict[str, Any]:
    """Return the chosen options of a method, x1 as a vector: that of the problem if
    none is chosen, and the run starts from the problem's x0."""
    x1 = chosen.get("x1")
    if x1 is None and not has_start and "x1" in methods.declared(method).vectors:
        x1 = problem.x1
    return chosen if x1 is None else chosen | {"x1": as_vector("x1", x1, problem.n)}


def _of_literal(problem: Problem, result: Result) -> Result:
    """Return a result of the problem in which sides that are rounding errors of 0 are
    0, as one of the problem with its literal numbers: this has a solution only if such
    rows are treated as satisfied, or none."""
    rounded, vectors = problem.rounded_rows, list[Vector]()
    assert rounded is not None
    # A solution of one is one of the other but for these rows.
    negligible = [*result.point.negligible, *rounded.rows.tolist()]
    z = problem.box.project(result.z)
    point = Point(Criterion(problem, result.tol), z, negligible=negligible)
    if result.solved:
        # The reason by `accepted` for the other problem, and what holds for this one.
        reasons = result.message.partition(": ")[2], rounded.statement
        reason = "; ".join(filter(None, reasons))
        return _with_status(result, point, Status.SOLVED, reason)
    if not result.status.has_no_solution:
        return replace(result, problem=problem, point=point)
    with imports:
        from lcpcli.verify.certificate import Proof, verify_claim
    if result.certificate is not None and result.certificate.vector is not None:
        # The certificate of the other rows, if they have no solution either.
        vectors.append(np.array(result.certificate.vector))
        vectors[0][rounded.rows] = 0.0
    unit = np.zeros(problem.n)
    unit[rounded.rows[0]] = np.sign(rounded.sides[0])
    for y in (*vectors, unit):
        certificate = verify_claim(problem, Proof("farkas", y))
        if certificate is not None:
            status, reason = Status.INFEASIBLE, certificate.statement
            result = replace(result, certificate=certificate)
            return _with_status(result, point, status, reason)
    return _with_status(result, point, Status.STALLED, "")


def _with_status(result: Result, point: Point, status: Status, reason: str) -> Result:
    problem, message = point.criterion.problem, status.sentence(reason)
    return replace(result, problem=problem, point=point, status=status, message=message)


def _of(problem: Problem, result: Result, compiled: bool, finishes: bool) -> Result:
    """Return the result as that of the original problem, whose M `auto` may have stored
    in another form, after its formulation, if any, has taken part: it may try another
    form if the result is not solved, and otherwise checks the answer. Of a program,
    only the objective is improved or checked, if an inexact method has taken part or
    there is a limit on the gap.

    finishes : whether other methods may improve an objective that is known to few
        digits.
    """
    result = result if result.problem is problem else replace(result, problem=problem)
    if compiled:
        result.options["compiled"] = True
    if problem.origin is None:
        return result
    if not result.solved:
        again: Result = problem.origin.retried(result)
        return again
    if problem.block_form is None:
        checked: Result = problem.origin.accepted(result)
        return checked
    may_go_on = finishes and problem.n >= MIN_FOR_PIQP
    may_go_on = may_go_on and not INEXACT.isdisjoint(result.route)
    if not (may_go_on or result.limits.gap < math.inf):
        return result
    with imports:
        from lcpcli.solving.objective import with_objective
    return with_objective(result, may_go_on)


def check_callback(callback: Callback | None) -> None:
    """Raise ParameterError for a callback that is no function."""
    if callback is not None and not callable(callback):
        raise ParameterError(
            "callback",
            f"is {kind(callback)}",
            "give a function of one argument, a TraceRow",
        )


def _refuse_other(
    method: str,
    additions: dict[str, bool],
    compiled: bool | None,
    callback: Callback | None,
) -> None:
    """Raise an error for a callback that is no function, and a method or options that
    cannot do anything here."""
    check_callback(callback)
    if method in methods.NONLINEAR:
        raise OptionError(
            "method",
            f"{method} is for nonlinear problems",
            "call lcpcli.solve_mcp, or choose another",
        )
    for name in (
        additions if additions and not methods.declared(method).iterates else ()
    ):
        raise ParameterError(name, f"has no effect with the method {method}", LEAVE_OUT)
    if compiled and method != "auto":
        raise ParameterError(
            "compiled", f"has no effect with the method {method}", LEAVE_OUT
        )


def variables_of(method: str, problem: Problem, is_scaled: bool) -> Change:
    """Return the change to the variables in which a method works; those that exclude
    sets exactly move the reference point themselves, as rounding of other variables
    would spoil their proofs."""
    moves_itself = methods.declared(method).excludes_exactly
    return composed(
        problem,
        *([] if moves_itself else [shifted]),
        *([in_natural_units] if is_scaled else []),
    )


# The largest quotient of two right-hand sides of one problem in other units.
WIDEST_USUAL = 2.0**100


def _units_of(problem: Problem) -> Change | None:
    """Return the change to the units in which `auto` solves a problem; None if it has
    those already, which for most problems two numbers show."""
    smallest, largest = problem.sizes_of_q
    if problem.origin is None:
        # No units suit numbers that differ by so much.
        is_wide = largest > WIDEST_USUAL * smallest
        is_usual = problem.is_moderate and smallest >= 1 / USUAL and largest <= USUAL
        is_usual |= is_wide
    else:
        is_usual = is_of_usual_size(problem)
    if is_usual:
        return None
    with imports:
        from lcpcli.model.usual_units import in_usual_units
    return in_usual_units(problem)


def ended(loop: Loop, stage: Callable[[], Stage]) -> Result:
    """Run the loop within its time limit and return the result, also if Ctrl-C comes
    while it is made."""
    limit = loop.limits.time_limit
    watch = None if loop.seen.observe is None else loop.report_if_due
    with (
        deadline_after(limit - loop.stopwatch.elapsed(), watch)
        if watch or limit < math.inf
        else nullcontext()
    ):
        status, reason = loop.run(stage)
    try:
        return loop.result(status, reason)
    except KeyboardInterrupt:
        loop.session.interrupted = True
        return loop.result(Status.INTERRUPTED, "")


def _start(problem: Problem, method: str, starts: dict[str, Any]) -> Start:
    with imports:
        from lcpcli.model.words import start_at
    if not methods.declared(method).uses_start:
        name = next(name for name, value in starts.items() if value is not None)
        raise ParameterError(
            name,
            f"has no effect with {method}, which uses no starting point",
            LEAVE_OUT,
        )
    return start_at(problem, **starts)


def _stage(
    method: str,
    change: Change,
    start: Vector,
    in_force: dict[str, Any],
    finishes: bool,
    shown: Callable[[Callable[[], Stage]], Stage] | None = None,
) -> Stage:
    """Set up the method in changed variables, with a finish on its active set if that
    is requested, after attempts that `shown`, if it is given, puts before it."""
    with imports:
        from lcpcli.methods.stages import begin, changed
    if in_force.get("x1") is not None:
        in_force = in_force | {"x1": change.start(in_force["x1"])}

    def run(problem: Problem, start: Vector) -> Stage:
        begun = partial(begin, method, problem, start, **in_force)
        if shown is not None:
            return shown(begun)
        stage = begun()
        if not finishes:
            return stage
        with imports:
            from lcpcli.methods.newton import finish
        return finish(problem, start, stage)

    return changed(change, start, run)


@np.errstate(all="ignore")
def verified(result: Result) -> Result:
    """Return the result with `verified` set: whether z, measured again, is accepted as
    it is."""
    if not result.solved:
        return result
    extent = Extent(as_given=True)
    acceptance = accepted(result.problem, [result.z], result.tol, extent)
    return replace(result, verified=acceptance is not None and acceptance.solved)


def with_bound(result: Result) -> Result:
    """Return the result with a proved bound on its error, as far as the time that its
    run has not used allows."""
    with imports:
        from lcpcli.verify.error_theorems import NO_BOUND, UNPROVED_IN_TIME, error_bound
    if result.interrupted:
        return result
    try:
        with deadline_after(result.limits.time_limit - result.seconds):
            bound = error_bound(result.problem, result.z) or NO_BOUND
    except TimeIsUp:
        bound = UNPROVED_IN_TIME
    return replace(result, bound=bound)


def repeated(
    once: Callable[[bool], Result], compared: bool, is_shown: bool
) -> Iterator[Result]:
    """Repeat a run as often as its times require to be compared or, at most
    FEW_REPETITIONS times, to be shown; yield the fastest repetition, in which each step
    has its least time, with the spread of their times, or the first run if it is not
    repeated.

    once : runs it, for the first time or again. Raises KeyboardInterrupt after the
        result if a repetition was interrupted.
    """
    runs, interrupted = [once(False)], False
    longest = 0.0
    enough = 0.0
    max_repetitions = 0
    if compared:
        longest = LONGEST_REPEATED
        enough = REPETITION_SECONDS
        max_repetitions = MAX_REPETITIONS
    elif is_shown:
        longest = BRIEF
        enough = BRIEF
        max_repetitions = FEW_REPETITIONS
    try:
        while (
            not runs[-1].interrupted
            and runs[0].seconds <= longest
            and len(runs) <= max_repetitions
        ):
            # The more pauses, the more repetitions.
            undisturbed = (len(runs) - 1) * min(run.seconds for run in runs)
            if undisturbed >= enough:
                break
            runs.append(once(True))
    except KeyboardInterrupt:
        interrupted = True
    whole = [run for run in runs if not run.interrupted]
    again = sorted(whole[1:], key=lambda run: run.seconds)
    if again:
        middle = again[(len(again) - 1) // 2 : len(again) // 2 + 1]
        fastest = _with_least_times(again)
        spread = sum(run.seconds for run in middle) / (len(middle) * fastest.seconds)
        yield replace(fastest, spread=spread)
    else:
        yield runs[0]
    if interrupted or (whole and len(whole) < len(runs)):
        raise KeyboardInterrupt


def _with_least_times(runs: Sequence[Result]) -> Result:
    """Return the first of these repetitions, the fastest one, in whose trace and curve
    each step takes its least time in any of them: a pause of the machine hits one
    repetition, and never all of them in the same step."""
    first = runs[0]
    if first.trace is None and first.curve is None:
        return first
    with imports:
        from lcpcli.solving.trace import least_times
    least = least_times([(run.trace, run.curve) for run in runs])
    if not least:
        return first
    traces = [trace for trace in (first.trace, first.curve) if trace is not None]
    times = {row.k: row.seconds for trace in traces for row in trace.rows}
    start, end = min(times), max(times)
    gain = times[start] - least[start]
    gains = {"setup": gain, "solve": times[end] - least[end] - gain}
    parts = dict(first.parts)
    for part, gained in gains.items():
        shorter = parts[part] - max(0.0, gained)
        # What is gained may also be a part of the verification of iterates.
        if shorter <= 0.0:
            shorter = min(run.parts[part] for run in runs)
        parts[part] = shorter
    return replace(
        first,
        parts=parts,
        trace=first.trace and first.trace.timed(least),
        curve=first.curve and first.curve.timed(least),
    )
