"""A bench from the request to its record: the loop over cases and solvers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict

from lcpcli.bench import environment, rate, suites
from lcpcli.bench.answer import Answer, Method, Peer, Solver
from lcpcli.bench.check import Checker
from lcpcli.bench.measure import measure, rest_before
from lcpcli.bench.record import EXCLUDED, Measurement, Record, Settings
from lcpcli.bench.suites import Case
from lcpcli.errors import OptionError
from lcpcli.model.problem import Problem
from lcpcli.options import THREADS
from lcpcli.peers import registry as peers
from lcpcli.report.wording import finite

Timing = Callable[[Callable[[bool], Answer], float, float], tuple[Answer, list[float]]]


def start(
    asked: Sequence[str],
    methods: Sequence[str],
    wanted: Sequence[str],
    options: Settings,
    tell: Callable[[str], None] = lambda _: None,
    infinity: float | None = None,
) -> Record:
    """An empty record; wanted peers are selected as by `peers.select`. Files are read once, so that errors in them are
    reported before any measurement; `tell` and `infinity` are as for `suites.cases_of`."""
    cases = suites.cases_of(asked, tell, infinity)
    chosen = peers.select(wanted)
    missing = [name for name in chosen if peers.load(name).version() is None]
    present = [name for name in chosen if name not in missing]
    return Record(
        suite=list(asked),
        cases=cases,
        methods=list(dict.fromkeys(methods)),
        peers=present,
        missing=missing,
        options=options,
        machine=environment.machine(),
        versions=environment.versions(present),
    )


def refuse_elsewhere(record: Record) -> None:
    """Raise OptionError if the rest cannot be measured on the same machine with the same versions, or ProblemError if
    its files can no longer be read."""
    for case, _ in record.pending():
        if case.file:
            suites.problem_of(case)
    here = {**asdict(environment.machine()), **environment.versions(record.peers)}
    then = {**asdict(record.machine), **record.versions}
    for name in here | then:
        if here.get(name) != then.get(name):
            hint = f"give --threads {then[name]}" if name == THREADS.name and then[name] else "start a new bench"
            raise OptionError("--resume", f"was measured with {name} {then.get(name)}, here is {here.get(name)}", hint)


def run(record: Record, starting: Callable[[Case, str], None], timing: Timing = measure) -> Iterator[Measurement]:
    """Run the pending measurements; each is added to the record and yielded.

    starting : called with the case and the solver before each measurement.
    """
    for case, names in record.pending():
        starting(case, names[0])
        problem = suites.prepare(case)
        checker = Checker(problem, record.options.accept)
        for name in names:
            starting(case, name)
            solver: Solver = Method(name) if name in record.methods else Peer(name)
            measurement = _measured(case, problem, checker, solver, record, timing)
            record.measurements.append(measurement)
            yield measurement


def _measured(
    case: Case, problem: Problem, checker: Checker, solver: Solver, record: Record, timing: Timing
) -> Measurement:
    options, seconds = record.options, list[float]()
    reason = solver.excludes(problem)
    if reason:
        answer = Answer(None, "", EXCLUDED, reason, 0.0)
    else:
        answer, seconds = timing(
            lambda with_curve: solver.solve(problem, options.tol, options.time_limit, with_curve),
            options.budget,
            rest_before(problem.n, record.machine.threads),
        )
    check = checker.check(answer)
    curve = [(k, at, finite(error)) for k, at, error in answer.curve] if answer.curve else None
    return Measurement(
        problem=case.name,
        family=case.family or None,
        n=problem.n,
        seed=None if case.file else case.seed,
        parameters=case.parameters,
        solver=solver.name,
        kind=solver.kind,
        status=answer.status,
        statement=answer.statement,
        claimed=bool(answer.claim),
        success=check.success,
        false_success=check.false_success,
        residual=finite(check.residual),
        scaled_residual=finite(check.scaled_residual),
        error=finite(check.error),
        iterations=answer.iterations,
        evaluations=answer.evaluations,
        seconds=seconds,
        setup_seconds=answer.setup_seconds,
        curve_of=("error" if problem.solutions else "residual") if curve else None,
        curve=curve,
        milestones=answer.milestones,
        condition=finite(check.condition),
        forward_error=finite(check.forward_error),
        optimality=check.optimality,
        rate=rate.of(problem, curve) if solver.name == rate.METHOD and curve else None,
    )
