"""The results of a bench, as tables of cells of text. The formats differ only in how they typeset them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import groupby

from lcpcli.bench import scores
from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.report import convergence, optimality, stability
from lcpcli.bench.report.sheet import Sheet
from lcpcli.bench.statistics import SHIFT, Fit, summary
from lcpcli.errors import count
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.report import wording

MOST_SOLVERS = 6  # side by side if no width is given
SHORTEST = 20  # least number of characters of a failure's description in a table; JSON and CSV have all of it
TIMES = "Median±half the interquartile range; the median alone for a single run."
FAILED, INEXACT, WRONG, EXCLUDED = "failed", "inexact", "wrong", "-"


@dataclass(frozen=True)
class Report:
    """The report on a bench: a title, lines on the conditions of measurement, and the nonempty tables."""

    title: str
    lines: list[str]
    sheets: list[Sheet]


def build(record: Record, width: int | None) -> Report:
    """The report on a bench, in so many columns of text; None sets no limit."""
    sheets = [_solvers(record), _times(record, width), convergence.reached(record), convergence.firsts(record)]
    sheets += [
        convergence.rates(record),
        stability.build(record),
        optimality.build(record),
        _failures(record, width),
        _exclusions(record),
        _growth(record),
    ]
    return Report(_title(record), conditions(record), [sheet for sheet in sheets if sheet.groups])


def _title(record: Record) -> str:
    measured, all_of_them = len(record.measurements), len(record.cases) * len(record.solvers)
    progress = "" if measured == all_of_them else f", {measured} of {all_of_them} measured"
    files = {file for case in record.cases for file in (case.file, case.q_file)}
    suites = [name for name in record.suite if name not in files]
    return f"{' '.join(['lcp bench', *suites])}: {count(len(record.cases), 'problem')}{progress}"


def conditions(record: Record) -> list[str]:
    """Lines on how a bench was measured: the limits, the machine, the versions, and what is missing."""
    options, machine = record.options, record.machine
    memory = f", {machine.memory / 2**30:.3g} GiB" if machine.memory else ""
    threads = f", {count(machine.threads, 'thread')}" if machine.threads else ""
    lines = [
        f"tolerance {options.tol:g}, accepted to {options.accept:g}, time limit {options.time_limit:g} s",
        f"{machine.processor}, {machine.cores or '?'} cores{memory}{threads}, {machine.system}",
        ", ".join(f"{name} {version}" for name, version in record.versions.items()),
    ]
    return lines + [f"not installed: {', '.join(record.missing)}" for _ in record.missing[:1]]


def _solvers(record: Record) -> Sheet:
    header = ["solver", "solved", "of", "false", "mean time", "fastest"]
    rows = [
        [
            score.solver,
            str(score.solved),
            str(score.applicable),
            str(score.false),
            "" if score.mean is None else wording.duration(score.mean),
            str(score.fastest),
        ]
        for score in scores.scores(record)
    ]
    notes = [
        "false: claimed but wrong by every measure. mean time: geometric mean, shifted by "
        f"{wording.duration(SHIFT)}; a failure counts as the time limit, {wording.duration(record.options.time_limit)}."
    ]
    return Sheet("Solvers", header, [rows] if record.measurements else [], notes)


def _times(record: Record, width: int | None) -> Sheet:
    """One row per problem if that fits, else one row per problem and solver."""
    side_by_side = _side_by_side(record)
    if width is None:
        return side_by_side if len(record.solvers) <= MOST_SOLVERS else _one_below_another(record)
    return side_by_side if _width(side_by_side) <= width else _one_below_another(record)


def _width(sheet: Sheet) -> int:
    """The width of a table in characters."""
    rows = [sheet.header, *(row for group in sheet.groups for row in group)]
    return sum(max(map(len, column)) + 1 for column in zip(*rows, strict=True)) - 1


def _side_by_side(record: Record) -> Sheet:
    rows = []
    for name, group in groupby(record.measurements, key=lambda row: row.problem):
        held = {row.solver: row for row in group}
        fastest = min((summary(row.seconds).median for row in held.values() if row.success), default=0.0)
        length, unit = wording.unit(fastest)
        cells = [_time(held[s], length) if s in held else "" for s in record.solvers]
        rows.append([name, unit if any(row.success for row in held.values()) else "", *cells])
    return Sheet("Times", ["problem", "in", *record.solvers], [rows] if rows else [], [TIMES])


def _one_below_another(record: Record) -> Sheet:
    header = ["problem", "solver", "time", "in", "residual", "error", "iterations"]
    groups = []
    for name, group in groupby(record.measurements, key=lambda row: row.problem):
        rows: list[list[str]] = []
        for row in group:
            length, unit = wording.unit(summary(row.seconds).median) if row.success else (1.0, "")
            measures = [wording.short(row.scaled_residual, ROW_ROUNDING), wording.short(row.error)]
            iterations = "" if row.iterations is None else str(row.iterations)
            rows.append(["" if rows else name, row.solver, _time(row, length), unit, *measures, iterations])
        groups.append(rows)
    return Sheet("Times", header, groups, [TIMES, "The residual is scaled and recomputed."])


def _time(row: Measurement, length: float) -> str:
    if row.excluded:
        return EXCLUDED
    if not row.success:
        return WRONG if row.false_success else INEXACT if row.claimed else FAILED
    times = summary(row.seconds)
    digits = wording.digits(times.median / length)
    return digits if times.spread is None else f"{digits}±{100 * times.spread:.0f}%"


def _failures(record: Record, width: int | None) -> Sheet:
    failed = [row for row in record.measurements if not row.success and not row.excluded]
    header = ["problem", "solver", "residual", "how it ended"]
    rows = [[row.problem, row.solver, wording.short(row.scaled_residual), _ending(row)] for row in failed]
    if rows and width is not None:
        room = max(width - _width(Sheet("", header[:-1], [[row[:-1] for row in rows]])) - 1, SHORTEST)
        for row in rows:
            row[-1] = _shortened(row[-1], room)
    return Sheet("Not solved", header, [rows] if rows else [])


def _shortened(said: str, room: int) -> str:
    """As many whole clauses as fit; a cut within a clause is marked."""
    if len(said) <= room:
        return said
    clauses = re.split(r"(?=[:;,] )", said)
    while len(clauses) > 1 and len("".join(clauses)) > room:
        clauses.pop()
    short = "".join(clauses)
    return short if len(short) <= room else short[: room - 3] + "..."


def _ending(row: Measurement) -> str:
    said = " ".join(row.statement.split())
    if not row.claimed:
        return said
    return f"{WRONG if row.false_success else INEXACT}: {said}"


def _exclusions(record: Record) -> Sheet:
    reasons: dict[tuple[str, str], int] = {}
    for row in record.measurements:
        if row.excluded:
            reasons[row.solver, row.statement] = reasons.get((row.solver, row.statement), 0) + 1
    rows = [[solver, str(count), reason] for (solver, reason), count in reasons.items()]
    return Sheet("Excluded", ["solver", "problems", "why"], [rows] if rows else [])


def _growth(record: Record) -> Sheet:
    header = ["family", "solver", "sizes", "exponent", "95% interval", "R^2"]
    groups: list[list[list[str]]] = []
    for _, own in groupby(scores.growths(record), key=lambda growth: growth.series):
        rows: list[list[str]] = []
        for growth in own:
            fit = growth.fit
            if fit is None:
                continue
            sizes = f"{growth.points[0][0]}-{growth.points[-1][0]}"
            name = "" if rows else growth.series
            figures = [f"{fit.exponent:.2f}", _interval(fit), f"{fit.r_squared:.3f}"]
            rows.append([name, growth.solver, sizes, *figures])
        groups += [rows] * bool(rows)
    return Sheet("Growth of the time with n: n^exponent", header, groups)


def _interval(fit: Fit) -> str:
    return f"{fit.exponent - fit.margin:.2f} to {fit.exponent + fit.margin:.2f}"
