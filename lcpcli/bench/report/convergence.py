"""Convergence of the methods of a bench: which is first to each level of error, and the rate of fixed-point."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.report.sheet import Sheet
from lcpcli.errors import count
from lcpcli.report import wording
from lcpcli.report.wording import LEVELS

NOT_REACHED = "-"
SHOWN = LEVELS[1]  # the level whose times are listed
ALIKE = 1.02  # times within this factor count as equal


def reached(record: Record) -> Sheet:
    """The time of each method to an error of SHOWN on each problem."""
    rows = []
    for name, own in _competing(record):
        times = [_seconds(own.get(method), SHOWN) for method in record.methods]
        length, unit = wording.unit(min((seconds for seconds in times if seconds is not None), default=0.0))
        cells = [NOT_REACHED if seconds is None else wording.digits(seconds / length) for seconds in times]
        rows.append([name, unit if set(cells) != {NOT_REACHED} else "", *cells])
    title = f"Time to an error of {wording.level(SHOWN)} relative to the solution's largest component"
    return Sheet(title, ["problem", "in", *record.methods], [rows] if rows else [])


def firsts(record: Record) -> Sheet:
    """On how many of these problems each method was the first to each level of error."""
    problems = [own for _, own in _competing(record)]
    winners = {level: [name for own in problems for name in _first(own, level)] for level in LEVELS}
    rows = [[method, *(str(names.count(method)) for names in winners.values())] for method in record.methods]
    header = ["solver", *(f"to {wording.level(level)}" for level in LEVELS)]
    notes = [f"Times within {ALIKE - 1:.0%} count as equal: several methods are then first."]
    return Sheet(
        f"How often first to an error, on {count(len(problems), 'problem')}", header, [rows] if problems else [], notes
    )


def _competing(record: Record) -> Iterator[tuple[str, dict[str, Measurement]]]:
    """The problems with a known solution on which at least two methods ran: the name, and the methods' measurements."""
    for name, group in groupby(record.measurements, key=lambda row: row.problem):
        own = {row.solver: row for row in group if row.milestones is not None}
        if len(own) >= 2:
            yield name, own


def _seconds(row: Measurement | None, level: float) -> float | None:
    reached = (row.milestones or []) if row is not None else []
    return next((seconds for at, _, seconds in reached if at == level), None)


def _first(own: dict[str, Measurement], level: float) -> list[str]:
    """The methods that are first to a level, more than one for equal times."""
    times = {method: seconds for method, row in own.items() if (seconds := _seconds(row, level)) is not None}
    return [method for method, seconds in times.items() if seconds <= ALIKE * min(times.values())]


def rates(record: Record) -> Sheet:
    """The convergence factor of fixed-point, measured and from theory."""
    rows = [_rate(row, row.rate) for row in record.measurements if row.rate is not None]
    notes = [
        "measured: least-squares fit to the logarithms of the errors. local: the spectral radius of the iteration at a "
        "nondegenerate solution. bound: |(I + M)^-1 (I - M)|_2; max |1 - lambda| / |1 + lambda| for symmetric M."
    ]
    header = ["problem", "iterations", "measured", "local", "bound"]
    return Sheet("Linear convergence of fixed-point: factor per iteration", header, [rows] if rows else [], notes)


def _rate(row: Measurement, factors: dict[str, float]) -> list[str]:
    return [row.problem, str(row.iterations), *(_factor(factors.get(name)) for name in ("measured", "local", "bound"))]


def _factor(factor: float | None) -> str:
    return "" if factor is None else f"{factor:.4f}"
