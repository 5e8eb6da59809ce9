"""A bench from the request to its record: runs of a method or of a peer on a problem,
repeated until their time is known accurately enough, and verification from the original
M and q, never from what the solver reports."""

from __future__ import annotations

import os
import platform
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from lcpcli.bench.record import (
    EXCLUDED,
    BenchRecord,
    Machine,
    Measurement,
    Settings,
    median_interval,
    summary,
)
from lcpcli.bench.suites import Case, cases_of, prepare, problem_of
from lcpcli.clock import seconds
from lcpcli.errors import ParameterError
from lcpcli.files.contents import memory
from lcpcli.interrupts import hides_interrupt
from lcpcli.linalg import matrices, threads
from lcpcli.linalg.doubles import is_finite
from lcpcli.linalg.matrices import MIN_SHARED_ROWS
from lcpcli.methods import registry as methods
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem
from lcpcli.options import AUTO, NUMBA, THREADS, Limits, wants_kernels
from lcpcli.peers import registry as peers
from lcpcli.peers.registry import Claim
from lcpcli.report.result_formats import plain
from lcpcli.solving import driver
from lcpcli.solving.solve_mcp import run_nonlinear
from lcpcli.solving.trace import Trace
from lcpcli.verify.nonlinear_point import NonlinearCriterion
from lcpcli.verify.point import Criterion, Point
from lcpcli.version import VERSION

# Points of a curve in the record: enough for a figure, and few enough for a small file.
MAX_POINTS = 200
# Repeats: a median of fewer may be an outlier; after more it hardly changes.
MIN_REPEATS, MAX_REPEATS = 3, 25
# The half-width of the confidence interval of the median, relative to the median, at
# which no further run is made.
NARROW = 0.05
# Seconds of untimed runs before brief runs are measured, after which caches are filled
# and the clock rate is constant.
WARM_UP = 0.02
CURVES = 5  # runs of which the fastest has the curve, as it is disturbed the least
REST = 0.05  # seconds after which idle BLAS threads have stopped spinning


def run_method(
    name: str,
    problem: Problem | NonlinearProblem,
    tol: float,
    time_limit: float,
    with_curve: bool,
) -> Claim:
    """Run one of METHODS, with the options in its name, as in shi:p=10, and otherwise
    with its defaults; on a nonlinear problem the method for these. Raises
    KeyboardInterrupt if the run was interrupted."""
    has_reference, nothing = bool(problem.solutions), np.array([], dtype=np.intp)
    trace = (
        Trace(1, MAX_POINTS, nothing, residuals=not has_reference)
        if with_curve
        else None
    )
    variant = methods.parse(name)
    limits = Limits(tol, time_limit=time_limit)
    began = seconds()
    options = {**variant.options, "limits": limits, "curve": trace, "began": began}
    if isinstance(problem, Problem):
        result = driver.run(problem.anew(), variant.method, **options)
    else:
        result = run_nonlinear(problem, interrupts="return", **options)
    if result.interrupted:
        raise KeyboardInterrupt
    rows = result.curve.rows if result.curve else ()
    curve = [
        (row.k, row.seconds, row.error if has_reference else row.residual)
        for row in rows
    ]
    ending = result.z, result.solved, result.seconds, result.message, result.status.word
    return Claim(
        *ending, result.setup_seconds, result.iterations, result.evaluations, curve
    )


def run_peer(
    name: str,
    problem: Problem | NonlinearProblem,
    tol: float,
    time_limit: float,
    _with_curve: bool = False,
) -> Claim:
    """Run one of PEERS, which gives no curve. Raises KeyboardInterrupt if the run was
    interrupted."""
    try:
        claim: Claim = peers.load(name).solve(problem, tol, time_limit)
    except (ImportError, SystemError) as error:
        if hides_interrupt(error):
            raise KeyboardInterrupt from None
        raise
    return replace(claim, status="solved" if claim.solved else "unsolved")


def is_claim(answer: Claim) -> bool:
    return answer.solved or answer.status in WITHOUT_SOLUTION


def is_stable(times: Sequence[float]) -> bool:
    low, high = median_interval(times)
    return high - low <= 2 * NARROW * summary(times).median


def measure(
    solve: Callable[[bool], Claim],
    budget: float,
    rest: float,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> tuple[Claim, list[float]]:
    """Return an answer with its error curve, and the seconds of each repeat.

    The first run provides the curve and is an untimed warm-up, unless its answer claims
    nothing: as times of failures are not used, it is then the only run. Brief runs are
    warmed up for WARM_UP seconds. There are at least MIN_REPEATS repeats; they stop
    when their median is known, after MAX_REPEATS of them, or when the budget in seconds
    is spent; a repeat longer than the whole budget is always the last. If no repeat was
    so long, the curve is that of the fastest of CURVES warm runs. In either case its
    times are multiplied by one factor, so that the run takes the median of the repeats.

    solve : makes one run; its argument is whether to record the error curve. rest :
        seconds to sleep before each run.
    """

    def rested(keeps_curve: bool) -> Claim:
        if rest:  # a sleep of no time would empty the processor's caches
            sleep(rest)
        return solve(keeps_curve)

    first = rested(True)
    if not is_claim(first):
        return first, [first.seconds]
    warm = clock() + WARM_UP
    for _ in range(int(WARM_UP / first.seconds) if first.seconds else 0):
        # A run in a separate process takes longer than the seconds that it reports.
        if clock() >= warm:
            break
        solve(False)
    began, times = clock(), list[float]()
    while len(times) < MAX_REPEATS:
        times.append(rested(False).seconds)
        if times[-1] > budget:
            return _lasting(summary(times).median, first), times
        if len(times) < MIN_REPEATS:
            continue
        if clock() - began >= budget or (
            len(times) % MIN_REPEATS == 0 and is_stable(times)
        ):
            # Not after each run, as computing the median evicts the problem from the
            # caches.
            break
    if not first.curve:
        return first, times
    fastest = min((rested(True) for _ in range(CURVES)), key=lambda run: run.seconds)
    return _lasting(summary(times).median, fastest), times


def _lasting(seconds: float, run: Claim) -> Claim:
    """Return a run whose times are multiplied by one factor, so that it takes
    `seconds`."""
    factor = seconds / run.seconds
    curve = [(k, factor * at, error) for k, at, error in run.curve or ()]
    return replace(
        run,
        curve=curve,
        setup_seconds=None if run.setup_seconds is None else factor * run.setup_seconds,
    )


@np.errstate(over="ignore", invalid="ignore")  # overflow is infinite, never accepted
def checked(
    problem: Problem | NonlinearProblem, answer: Claim, accept: float
) -> dict[str, Any]:
    """Return the verified facts on an answer, by their names in a `Measurement`; None
    for a number that is not finite.

    A claimed solution is a success if its scaled residual is at most `accept`, unless
    it is known that there is none. The claim is false if even the natural residual,
    without scaling, exceeds `accept` times the largest term of w, in |M| |z| or |q|; in
    between, the claim is inexact: z meets a common stopping criterion, but small rows
    may have no correct digit. A claim that there is no solution is false if one is
    known, else a success.
    """
    claimed, none = answer.solved, answer.status in WITHOUT_SOLUTION
    if none or answer.z is None:
        false = claimed or (none and bool(problem.solutions))
        return {
            "success": none and not false,
            "false_success": false,
        }
    z = np.asarray(answer.z, dtype=np.float64)
    if isinstance(problem, NonlinearProblem):
        F = problem.values(z)
        if not is_finite(F):
            return {"success": False, "false_success": claimed}
        # z solves the nonlinear problem if it solves this linearization.
        problem = NonlinearCriterion(Evaluations(problem), accept).linearization(z, F)
    hopeless = problem.verdict in WITHOUT_SOLUTION
    point = Point(Criterion(problem), z, is_admissible=False)
    terms = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    success = claimed and point.scaled_residual <= accept and not hopeless
    is_nearly_true = (
        point.residual <= accept * float(terms.max(initial=0.0)) < np.inf
        and not hopeless
    )
    numbers = {
        "residual": point.residual,
        "scaled_residual": point.scaled_residual,
        "error": problem.error(z),
    }
    facts = {
        "success": success,
        "false_success": claimed and not success and not is_nearly_true,
    }
    return {
        **facts,
        **{name: plain(value) for name, value in numbers.items()},
    }


def start(
    asked: Sequence[str],
    methods: Sequence[str],
    wanted: Sequence[str],
    options: Settings,
    *how: Any,
) -> BenchRecord:
    """Return an empty record; the wanted peers are selected by `registry.select`. Files
    are read once, so that errors in them are reported before any measurement. how :
    `tell` and `infinity` as for `cases_of`."""
    errors = list[str]()
    cases = cases_of(asked, errors, *how)
    present, missing = list[str](), list[str]()
    for name in peers.select(wanted):
        (missing if peers.load(name).version() is None else present).append(name)
    who = list(dict.fromkeys(methods)), present, missing
    return BenchRecord(
        list(asked), cases, *who, options, machine(), software(present), unread=errors
    )


def machine() -> Machine:
    name = platform.processor() or platform.machine()
    system = f"{platform.system()} {platform.release()}"
    with suppress(OSError):  # on Linux only this file has the processor's name
        match = re.search(
            r"^model name[^:]*:(.*)",
            Path("/proc/cpuinfo").read_text(encoding="utf-8"),
            re.MULTILINE,
        )
        name = match[1].strip() if match else name
    return Machine(name, os.cpu_count(), memory(), system, threads.in_environment())


def software(names: Sequence[str]) -> dict[str, str | None]:
    """Return the versions of Python, of this program, of its numerical libraries, with
    numba if all runs use the compiled kernels, and of the named peers."""
    versions = {"python": platform.python_version(), "lcpcli": VERSION}
    versions |= {
        name: version(name) for name in ("numpy", *[NUMBA] * wants_kernels(), "scipy")
    }
    return versions | {name: peers.load(name).version() for name in names}


def refuse_elsewhere(record: BenchRecord) -> None:
    """Raise OptionError if the pending cases cannot be measured on the same machine
    with the same versions, or ProblemError if their files can no longer be read."""
    for case, _ in record.pending():
        if case.file:
            problem_of(case)
    current = {**asdict(machine()), **software(record.peers)}
    recorded = {**asdict(record.machine), **record.versions}
    for name in current | recorded:
        if current.get(name) != recorded.get(name):
            hint = (
                f"give --threads {recorded[name]}"
                if name == THREADS.name and recorded[name]
                else "start a new bench"
            )
            raise ParameterError(
                "resume",
                f"was measured with {name} {recorded.get(name)}, not "
                f"{current.get(name)}",
                hint,
            )


def run(
    record: BenchRecord, starting: Callable[[Case, str], None]
) -> Iterator[Measurement]:
    """Make the pending measurements; each is added to the record and yielded. starting
    : called before each."""
    for case, names in record.pending():
        starting(case, names[0])
        problem = prepare(case)
        for name in names:
            starting(case, name)
            measurement = _measure(case, problem, name, record)
            record.measurements.append(measurement)
            yield measurement


def _excludes(problem: Problem | NonlinearProblem, solver: str, is_peer: bool) -> str:
    is_linear = isinstance(problem, Problem)
    if is_peer and (is_linear or solver in peers.NONLINEAR):
        return str(peers.load(solver).excludes(problem))
    takes = not is_peer and (
        solver == AUTO
        or is_linear != (methods.parse(solver).method in methods.NONLINEAR)
    )
    if takes:
        return ""
    other_kind = "nonlinear" if is_linear else "linear"
    return f"solves {other_kind} problems only"


def _measure(
    case: Case, problem: Problem | NonlinearProblem, solver: str, record: BenchRecord
) -> Measurement:
    options, seconds = record.options, list[float]()
    kind, run = (
        ("method", run_method) if solver in record.methods else ("peer", run_peer)
    )
    if reason := _excludes(problem, solver, kind == "peer"):
        answer = Claim(None, False, 0.0, reason, EXCLUDED)
    else:
        rest = (
            REST
            if problem.n >= MIN_SHARED_ROWS and record.machine.threads != 1
            else 0.0
        )
        answer, seconds = measure(
            partial(run, solver, problem, options.tol, options.time_limit),
            options.budget,
            rest,
        )
    curve = (
        [(k, at, plain(error)) for k, at, error in answer.curve]
        if answer.curve
        else None
    )
    measure_of_curve = "error" if problem.solutions else "residual"
    copied = ("status", "statement", "iterations", "evaluations", "setup_seconds")
    facts = {name: getattr(answer, name) for name in copied} | checked(
        problem, answer, options.accept
    )
    return Measurement(
        problem=case.name,
        family=case.family or None,
        n=problem.n,
        seed=None if case.file else case.seed,
        parameters=case.parameters,
        solver=solver,
        kind=kind,
        claimed=is_claim(answer),
        seconds=seconds,
        curve_of=measure_of_curve if curve else None,
        curve=curve,
        **facts,
    )
