"""The statistics of a bench, computed from its record; tables and plots show the same ones."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.statistics import Fit, Summary, growth, performance_ratios, shifted_geometric_mean, summary
from lcpcli.bench.suites import series


@dataclass(frozen=True)
class Score:
    """One solver over all problems that it accepts.

    mean : shifted geometric mean of its times, in seconds, a failure counted as the time limit; None for no problem.
    fastest : the number of problems that no solver solved faster.
    """

    solver: str
    solved: int
    applicable: int
    false: int
    mean: float | None
    fastest: int


@dataclass(frozen=True)
class Growth:
    """Growth of a solver's time over the sizes of a series that it solved: (n, seconds), by n; fit : None for few."""

    series: str
    solver: str
    points: list[tuple[int, Summary]]
    fit: Fit | None


def times(record: Record) -> dict[str, dict[str, float]]:
    """The median seconds of each solver on each problem that it accepts; infinity if it failed."""
    held: dict[str, dict[str, float]] = {solver: {} for solver in record.solvers}
    for row in record.measurements:
        if not row.excluded:
            held[row.solver][row.problem] = summary(row.seconds).median if row.success else math.inf
    return held


def scores(record: Record) -> list[Score]:
    """One score per solver, in their order."""
    medians, false = times(record), dict.fromkeys(record.solvers, 0)
    for row in record.measurements:
        false[row.solver] += row.false_success
    ratios = performance_ratios(medians)
    found = []
    for solver, own in medians.items():
        charged = [t if t < math.inf else record.options.time_limit for t in own.values()]
        found.append(
            Score(
                solver=solver,
                solved=sum(t < math.inf for t in own.values()),
                applicable=len(own),
                false=false[solver],
                mean=shifted_geometric_mean(charged) if charged else None,
                fastest=ratios[solver].count(1.0),
            )
        )
    return found


def growths(record: Record) -> list[Growth]:
    """The growth of each solver on each series in which it solved two sizes or more, series by series."""
    solved: dict[str, dict[str, list[Measurement]]] = {}
    for row in record.measurements:
        if row.family and row.success:
            solved.setdefault(series(row.family, row.parameters), {}).setdefault(row.solver, []).append(row)
    found = []
    for name, by_solver in solved.items():
        for solver in record.solvers:
            rows = sorted(by_solver.get(solver, []), key=lambda row: row.n)
            points = [(row.n, summary(row.seconds)) for row in rows]
            if len({n for n, _ in points}) > 1:
                found.append(Growth(name, solver, points, growth([(n, each.median) for n, each in points])))
    return found
