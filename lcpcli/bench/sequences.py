"""Sequences of problems: each step solved by itself, by a Solver, and by another program, beside each other.

All begin with arrays in memory; our times end with the verified answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from typing import NamedTuple

from lcpcli.bench.accuracy_tables import NO_ENTRY, sheet
from lcpcli.bench.timing import run_peer
from lcpcli.clock import seconds
from lcpcli.errors import count
from lcpcli.gallery import sequences
from lcpcli.gallery.sequences import SequenceStep, Solve
from lcpcli.model.problem import Problem
from lcpcli.peers import registry as peers
from lcpcli.report import wording
from lcpcli.report.document import Section
from lcpcli.solving.call import run
from lcpcli.solving.checking import check
from lcpcli.solving.result import Result
from lcpcli.solving.solver import Solver
from lcpcli.typing import Matrix, Vector

PEER = "quantecon"
TOL, TIME_LIMIT = 1e-10, 10.0  # of a step, the latter in seconds


class SequenceCase(NamedTuple):
    """A sequence. follow : asks the function that it is given for the solution of each step."""

    name: str
    follow: Callable[[Solve], None]


CASES = (
    SequenceCase("tower of 5", partial(sequences.boxes, "tower", 5, 100)),
    SequenceCase("tower of 10", partial(sequences.boxes, "tower", 10, 100)),
    SequenceCase("heap of 8", partial(sequences.boxes, "heap", 8, 200)),
    SequenceCase("pyramid of 6", partial(sequences.boxes, "pyramid", 6, 30)),
    SequenceCase("crushed", partial(sequences.boxes, "crushed", 3, 8)),
    SequenceCase("put 400", partial(sequences.put, 400, 50)),
    SequenceCase("put 1000", partial(sequences.put, 1000, 50)),
    SequenceCase("market 44", partial(sequences.market, 168)),
    SequenceCase("obstacle 100 x 100", partial(sequences.moving_load, 100, 20)),
)


@dataclass
class Side:
    """Steps in one way: the seconds of each, in order, again for each repeat, and how many are solved in the first."""

    seconds: list[float] = field(default_factory=list)
    solved: int = 0

    def add(self, spent: float, solved: bool) -> None:
        self.seconds.append(spent)
        self.solved += solved


@dataclass
class SequenceRow:
    """What was measured on a sequence, of steps with from least_n to most_n unknowns.

    run : each step by itself. solver : from the last states. peer : by PEER, without times where it is not installed
        or does not take the problems. impossible : steps that are proved to have no solution.
    missing : the distribution to install.
    """

    sequence: str
    steps: int = 0
    least_n: int = 0
    most_n: int = 0
    run: Side = field(default_factory=Side)
    solver: Side = field(default_factory=Side)
    peer: Side = field(default_factory=Side)
    impossible: int = 0
    missing: str = ""

    @property
    def ratio(self) -> float:
        """Return the median ratio of the times of a step by itself and from the last states."""
        pairs = zip(self.run.seconds, self.solver.seconds, strict=True)
        return median(one / other for one, other in pairs)


def measure(case: SequenceCase, budget: float) -> SequenceRow:
    """Follow a sequence once without counting the times, and then for so many seconds, but at least once."""
    _followed(case, with_peer=False)  # it compiles before its clock starts
    began = seconds()
    row = _followed(case)
    while seconds() - began < budget:
        again = _followed(case)
        for side, other in ((row.run, again.run), (row.solver, again.solver), (row.peer, again.peer)):
            side.seconds += other.seconds
    return row


def _followed(case: SequenceCase, with_peer: bool = True) -> SequenceRow:
    peer, warm = peers.load(PEER), _Warm()
    row = SequenceRow(case.name, missing="" if peer.version() else PEER)

    def solve(step: SequenceStep) -> Vector | None:
        problem, results = Problem(step.M, step.q, **step.bounds), dict[str, Result]()

        def ours(name: str, by: Callable[[SequenceStep], Result]) -> None:
            began = seconds()
            results[name] = by(step)
            getattr(row, name).add(seconds() - began, results[name].solved)

        def theirs() -> None:
            if not row.missing and not peer.excludes(problem):
                answer = run_peer(PEER, problem, TOL, TIME_LIMIT)
                passes = bool(answer.claim) and answer.z is not None and check(problem, answer.z, tol=TOL).accepted
                row.peer.add(answer.seconds, passes)

        turns: list[Callable[[], None]] = [partial(ours, "run", _cold), partial(ours, "solver", warm.solve)]
        turns += [theirs] * with_peer
        for turn in range(len(turns)):  # in another order at each step, as the first one fills caches for the others
            turns[(row.steps + turn) % len(turns)]()
        row.least_n, row.most_n = min(row.least_n or problem.n, problem.n), max(row.most_n, problem.n)
        row.steps += 1
        row.impossible += any(result.status.has_no_solution for result in results.values())
        return next((results[name].z for name in ("run", "solver") if results[name].solved), None)

    case.follow(solve)
    return row


def _cold(step: SequenceStep) -> Result:
    return run(Problem(step.M, step.q, **step.bounds), tol=TOL, time_limit=TIME_LIMIT)


class _Warm:
    """A Solver that follows a sequence as a user would have it do: a new one where the number of unknowns changes."""

    solver: Solver
    M: Matrix | None = None

    def solve(self, step: SequenceStep) -> Result:
        if self.M is None or self.M.shape != step.M.shape:
            self.solver = Solver(step.M, **step.bounds, tol=TOL, time_limit=TIME_LIMIT)
        elif step.M is not self.M:
            self.solver.update(step.M)
        self.M = step.M
        return self.solver.solve(step.q, **step.bounds)


def report(rows: Sequence[SequenceRow]) -> Section:
    """Return the section on these sequences."""
    header = ["problem", "steps", "n"]
    for name in ("run", "Solver", PEER):
        header += [f"{name}/us", "all/ms", "open"]
    cells = [
        [
            *(row.sequence, str(row.steps), "-".join(map(str, sorted({row.least_n, row.most_n})))),
            *(cell for side in (row.run, row.solver, row.peer) for cell in _cells(side, row.steps)),
            wording.digits(row.ratio),
        ]
        for row in rows
    ]
    notes = [
        f"Median time of a step, by run alone, by a Solver from the last states, by {PEER}; all: sum of the steps.",
        "open: steps without an answer that lcp check accepts; ratio: median of run over Solver, step by step.",
    ]
    impossible = [(row.sequence, count(row.impossible, "step")) for row in rows if row.impossible]
    notes += [f"{sequence}: {steps} proved to have no solution." for sequence, steps in impossible]
    if any(row.missing for row in rows):
        notes.append(f"not installed: {PEER}; pip install 'linear-complementarity[peers]'")
    return sheet("Sequences: time of a step", [*header, "ratio"], [cells], notes)


def _cells(side: Side, steps: int) -> list[str]:
    if not side.seconds:
        return 3 * [NO_ENTRY]
    total = sum(side.seconds) * steps / len(side.seconds)
    return [wording.digits(1e6 * median(side.seconds)), wording.digits(1e3 * total), str(steps - side.solved)]
