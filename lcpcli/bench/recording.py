"""A bench from the request to its record: the loop over cases and solvers, on this machine."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from functools import partial
from importlib.metadata import version
from pathlib import Path

from lcpcli.bench.record import EXCLUDED, BenchRecord, Machine, Measurement, Settings
from lcpcli.bench.suites import Case, cases_of, prepare, problem_of
from lcpcli.bench.timing import REST, Checker, TimedAnswer, measure, run_method, run_peer
from lcpcli.errors import ParameterError
from lcpcli.files.contents import memory
from lcpcli.linalg import threads
from lcpcli.linalg.matrices import FEWEST_SHARED_ROWS
from lcpcli.methods import registry as methods
from lcpcli.methods import variants
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem
from lcpcli.options import AUTO, NUMBA, THREADS, wants_kernels
from lcpcli.peers import registry as peers
from lcpcli.report.wording import finite
from lcpcli.version import VERSION

COPIED = ("status", "statement", "iterations", "evaluations", "setup_seconds")  # the fields of an answer


def start(
    asked: Sequence[str],
    methods: Sequence[str],
    wanted: Sequence[str],
    options: Settings,
    tell: Callable[[str], None] = lambda _: None,
    infinity: float | None = None,
) -> BenchRecord:
    """Return an empty record; the wanted peers are selected by `registry.select`. Files are read once, so that errors
    in them are reported before any measurement; `tell` and `infinity` are as for `cases_of`."""
    faults = list[str]()
    cases = cases_of(asked, tell, infinity, faults)
    versions = {name: peers.load(name).version() for name in peers.select(wanted)}
    present = [name for name in versions if versions[name] is not None]
    missing = [name for name in versions if versions[name] is None]
    solvers = list(dict.fromkeys(methods))
    return BenchRecord(
        list(asked), cases, solvers, present, missing, options, machine(), software(present), unread=faults
    )


def machine() -> Machine:
    """Return the description of this machine."""
    system = f"{platform.system()} {platform.release()}"
    return Machine(_processor(), os.cpu_count(), memory(), system, threads.in_environment())


def _processor() -> str:
    """Return the processor's name, which on Linux only /proc/cpuinfo gives."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor() or platform.machine())


def software(names: Sequence[str]) -> dict[str, str | None]:
    """Return the versions of Python, of this program, of its numerical libraries, with numba if all runs use the
    compiled kernels, and of the named peers."""
    own = {"python": platform.python_version(), "lcpcli": VERSION, "numpy": version("numpy")}
    own |= {NUMBA: version(NUMBA)} if wants_kernels() else {}
    return {**own, "scipy": version("scipy"), **{name: peers.load(name).version() for name in names}}


def refuse_elsewhere(record: BenchRecord) -> None:
    """Raise OptionError if the pending cases cannot be measured on the same machine with the same versions, or
    ProblemError if their files can no longer be read."""
    for case, _ in record.pending():
        if case.file:
            problem_of(case)
    here = {**asdict(machine()), **software(record.peers)}
    then = {**asdict(record.machine), **record.versions}
    for name in here | then:
        if here.get(name) != then.get(name):
            hint = f"give --threads {then[name]}" if name == THREADS.name and then[name] else "start a new bench"
            raise ParameterError("resume", f"was measured with {name} {then.get(name)}, not {here.get(name)}", hint)


def run(record: BenchRecord, starting: Callable[[Case, str], None]) -> Iterator[Measurement]:
    """Make the pending measurements; each is added to the record and yielded.

    starting : a function that is called with the case and the solver before each measurement.
    """
    for case, names in record.pending():
        starting(case, names[0])
        problem = prepare(case)
        checker = Checker(problem, record.options.accept)
        for name in names:
            starting(case, name)
            measurement = _measure(case, problem, checker, name, record)
            record.measurements.append(measurement)
            yield measurement


def _excludes(problem: Problem | NonlinearProblem, solver: str, is_peer: bool) -> str:
    """Return why a solver is not run on a problem, as a clause; "" if it is."""
    is_linear = isinstance(problem, Problem)
    if is_peer:
        takes = is_linear or solver in peers.NONLINEAR
        return peers.load(solver).excludes(problem) if takes else "solves linear problems only"
    if solver == AUTO or is_linear != (variants.parse(solver).method in methods.NONLINEAR):
        return ""
    return f"solves {'non' * is_linear}linear problems only"


def _measure(
    case: Case, problem: Problem | NonlinearProblem, checker: Checker, solver: str, record: BenchRecord
) -> Measurement:
    options, seconds = record.options, list[float]()
    kind = "method" if solver in record.methods else "peer"
    reason = _excludes(problem, solver, kind == "peer")
    if reason:
        answer = TimedAnswer(None, "", EXCLUDED, reason, 0.0)
    else:
        solve = partial(run_peer if kind == "peer" else run_method, solver, problem, options.tol, options.time_limit)
        rest = REST if problem.n >= FEWEST_SHARED_ROWS and record.machine.threads != 1 else 0.0
        answer, seconds = measure(solve, options.budget, rest)
    curve = [(k, at, finite(error)) for k, at, error in answer.curve] if answer.curve else None
    return Measurement(
        problem=case.name,
        family=case.family or None,
        n=problem.n,
        seed=None if case.file else case.seed,
        parameters=case.parameters,
        solver=solver,
        kind=kind,
        claimed=bool(answer.claim),
        seconds=seconds,
        curve_of=("error" if problem.solutions else "residual") if curve else None,
        curve=curve,
        **{name: getattr(answer, name) for name in COPIED},
        **checker.check(answer),
    )
