"""Up to what stiffness of a family each solver of a bench succeeds, how accurately, and how it ends beyond that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.report.sheet import Sheet
from lcpcli.bench.suites import ALL, SUITES, Case
from lcpcli.report import wording

NOWHERE = "-"


@dataclass(frozen=True)
class Ladder:
    """The cases of one family, in order of stiffness. axis : the parameter that varies, with its values."""

    family: str
    axis: str
    values: list[str]
    cases: list[Case]


def build(record: Record) -> Sheet:
    """One row per family and solver; nothing unless the suite is in order of stiffness."""
    rows = {row.key: row for row in record.measurements}
    ordered = any(name == ALL or (name in SUITES and SUITES[name].ladders) for name in record.suite)
    groups = [_group(ladder, record.solvers, rows) for ladder in ladders(record.cases)] if ordered else []
    header = ["family", "up", "solver", "to", "error", "cond.", "then"]
    notes = [
        "to: the last value up to which all are solved, by recomputed residuals. error: the largest one on "
        "these, against the exact solution, in units of eps times the condition: the effect of rounding the data. "
        "cond.: the largest condition of the solution on these. then: how the next one ends."
    ]
    return Sheet("Stability", header, [group for group in groups if group], notes)


def ladders(cases: Sequence[Case]) -> list[Ladder]:
    """The families of the cases; a problem in a file belongs to none."""
    families: dict[tuple[str, ...], list[Case]] = {}
    for case in cases:
        if case.family:
            families.setdefault((case.family, *case.parameters), []).append(case)
    return [_ladder(own) for own in families.values()]


def _ladder(cases: list[Case]) -> Ladder:
    differing = [name for name in cases[0].parameters if len({str(case.parameters[name]) for case in cases}) > 1]
    axis = differing[0] if differing else "n"
    values = [str(case.parameters[axis]) if differing else str(case.n) for case in cases]
    return Ladder(cases[0].family, axis, values, cases)


def _group(ladder: Ladder, solvers: Sequence[str], rows: dict[tuple[str, str], Measurement]) -> list[list[str]]:
    group: list[list[str]] = []
    for solver in solvers:
        own = [rows.get((case.name, solver)) for case in ladder.cases]
        measured = [row for row in own if row is not None]
        if len(measured) < len(own) or any(row.excluded for row in measured):
            continue
        good = next((i for i, row in enumerate(measured) if not row.success), len(measured))
        first = ["", ""] if group else [ladder.family, ladder.axis]
        group.append([*first, solver, *_reached(ladder, measured[:good]), _then(ladder, measured, good)])
    return group


def _reached(ladder: Ladder, good: list[Measurement]) -> list[str]:
    if not good:
        return [NOWHERE, "", ""]
    errors = [row.forward_error for row in good if row.forward_error is not None]
    conditions = [row.condition for row in good if row.condition is not None]
    return [ladder.values[len(good) - 1], *(wording.short(max(v, default=None)) for v in (errors, conditions))]


def _then(ladder: Ladder, rows: list[Measurement], good: int) -> str:
    if good == len(rows):
        return "all"
    row = rows[good]
    said = row.status.replace("_", " ") if row.kind == "method" or not row.claimed else "claims to solve it"
    return f"{ladder.values[good]}: {'wrong' if row.false_success else said}"
