"""The report on a bench, made from its record: tables of text, and a figure; only JSON
and CSV have all digits."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import fields
from functools import partial
from itertools import groupby

from lcpcli.bench.record import (
    SHIFT,
    BenchRecord,
    Measurement,
    mean_cells,
    performance_ratios,
    summary,
    times,
)
from lcpcli.bench.suites import SUITES, kinds_of, method_of, series
from lcpcli.errors import count
from lcpcli.report import wording
from lcpcli.report.document import Document, Section, Table
from lcpcli.report.plotting import Curve, Panel, Picture, Profile
from lcpcli.report.result_formats import Report, cell, plain
from lcpcli.report.wording import PIPE_WIDTH

TEXTS = ("how it ended", "why")  # headings of texts, and of words:
WORDS = ("solver", "problem", "family", "kind", *TEXTS)


def sheet(
    title: str,
    header: Sequence[str],
    groups: Sequence[Sequence[Sequence[str]]],
    *notes: str,
) -> Section:
    word_columns, texts = (
        [j for j, name in enumerate(header) if name in names]
        for names in (WORDS, TEXTS)
    )
    return Section(
        title, tables=[Table(header, groups, word_columns, texts, notes=notes)]
    )


MOMENTS = (1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0)  # seconds


def title(record: BenchRecord) -> str:
    measured = len(record.measurements)
    all_of_them = len(record.cases) * len(record.solvers)
    progress = (
        "" if measured == all_of_them else f", {measured} of {all_of_them} measured"
    )
    files = {file for case in record.cases for file in (case.file, case.q_file)}
    suites = [name for name in record.suite if name not in files]
    return (
        f"{' '.join(['lcp bench', *suites])}: "
        f"{count(len(record.cases), 'problem')}{progress}"
    )


def conditions(record: BenchRecord) -> list[str]:
    options, machine = record.options, record.machine
    memory = f", {machine.memory / 2**30:.3g} GiB" if machine.memory else ""
    threads = f", {count(machine.threads, 'thread')}" if machine.threads else ""
    lines = [
        f"tolerance {options.tol:g}, accepted to {options.accept:g}, time limit "
        f"{options.time_limit:g} s",
        f"{machine.processor}, {machine.cores or '?'} cores{memory}{threads}, "
        f"{machine.system}",
        ", ".join(f"{name} {version}" for name, version in record.versions.items()),
    ]
    return lines + [
        f"not installed: {', '.join(record.missing)}" for _ in record.missing[:1]
    ]


def _solvers(record: BenchRecord) -> Section:
    medians, limit = times(record), record.options.time_limit
    ratios = performance_ratios(medians)
    false = Counter(row.solver for row in record.measurements if row.false_success)
    solved = {
        name: sum(seconds < math.inf for seconds in times_of_solver.values())
        for name, times_of_solver in medians.items()
    }
    means, unit = mean_cells(
        {
            name: [*times_of_solver.values()]
            for name, times_of_solver in medians.items()
            if record.measurements
        },
        limit,
    )
    rows = [
        [
            name,
            *map(str, (solved[name], len(medians[name]), false[name])),
            mean,
            str(ratios[name].count(1.0)),
        ]
        for name, mean in means.items()
    ]
    note = (
        "false: claimed but wrong by every measure. mean: geometric mean of the "
        "times, shifted by "
    )
    note += (
        f"{wording.duration(SHIFT)}; a failure is charged the time limit, "
        f"{wording.duration(limit)}."
    )
    return sheet(
        "Solvers",
        ["solver", "solved", "of", "false", f"mean/{unit}", "fastest"],
        [rows],
        note,
    )


def _compared_with_peers(record: BenchRecord) -> Section:
    """Return, for each peer, how it and the first method do on the problems that both
    take."""
    medians, limit = times(record), record.options.time_limit
    method = record.methods[0] if record.methods else ""
    pairs = dict[tuple[str, str], list[float]]()
    for peer in record.peers if method else ():
        if common := [
            problem for problem in medians[peer] if problem in medians[method]
        ]:
            pairs |= {
                (peer, solver): [medians[solver][problem] for problem in common]
                for solver in (peer, method)
            }
    means, unit = mean_cells(pairs, limit)
    rows = []
    for peer in dict.fromkeys(peer for peer, _ in pairs):
        pair = pairs[peer, peer], pairs[peer, method]
        solved = (
            sum(seconds < math.inf for seconds in seconds_of_solver)
            for seconds_of_solver in pair
        )
        wins = sum(theirs < ours for theirs, ours in zip(*pair, strict=True))
        rows.append(
            [
                peer,
                *map(str, (len(pair[0]), *solved)),
                means[peer, peer],
                means[peer, method],
                str(wins),
            ]
        )
    header = [
        "solver",
        "of",
        "solved",
        f"by {method}",
        f"mean/{unit}",
        f"{method}/{unit}",
        "faster",
    ]
    note = (
        f"faster: the problems that the solver solves in less time than {method}. "
        "mean: as above."
    )
    return sheet(
        f"Compared with {method}, on the problems that the other takes",
        header,
        [rows],
        note,
    )


def _by_kind(record: BenchRecord) -> Section:
    """Return, for each kind of the suites' problems, how many of those that a solver
    takes it answers correctly, and its time relative to that of the first solver."""
    medians = times(record)
    false = {row.key for row in record.measurements if row.false_success}
    rows = []
    for kind in kinds_of(record.suite):
        names = {case.name for case in kind.cases()}
        cells = []
        for solver, seconds in medians.items():
            times_of_kind = {
                name: time for name, time in seconds.items() if name in names
            }
            wrong = sum((name, solver) in false for name in times_of_kind)
            cells.append(_of_kind(times_of_kind, medians[record.solvers[0]], wrong))
        rows.append([kind.name, *cells])
    note = (
        "Right answers of the problems that a solver takes: the residual, recomputed "
        "from the problem, is small, or there is no solution, and the solver says so. "
        f"Behind it, the geometric mean of the ratios of its times to those of "
        f"{record.solvers[0]}, on problems that both answer rightly. false: claimed "
        "but wrong by every measure."
    )
    return sheet("By kind of problem", ["kind", *record.solvers], [rows], note)


def _of_kind(
    times_of_kind: dict[str, float], first: dict[str, float], wrong: int
) -> str:
    """Return the cell of a solver with these times, infinite where it failed."""
    if not times_of_kind:
        return "-"
    right = [name for name, seconds in times_of_kind.items() if seconds < math.inf]
    shown = [f"{len(right)}/{len(times_of_kind)}"]
    compared = [name for name in right if first.get(name, math.inf) < math.inf]
    if compared:
        ratios = (times_of_kind[name] / first[name] for name in compared)
        shown.append(wording.digits(statistics.geometric_mean(ratios)))
    if wrong:
        shown.append(f"{wrong} false")
    return ", ".join(shown)


def is_over_time(record: BenchRecord) -> bool:
    return any(name in SUITES and SUITES[name].over_time for name in record.suite)


def _over_time(record: BenchRecord) -> Section:
    """Return how many problems of each series every solver has solved, or proved to
    have no solution, in time."""
    limit = record.options.time_limit
    moments = [*(moment for moment in MOMENTS if moment < limit), limit]
    cases = {
        case.name: series(case.family, case.parameters) if case.family else "files"
        for case in record.cases
    }
    groups = []
    for name in dict.fromkeys(cases.values()) if is_over_time(record) else ():
        rows: list[list[str]] = []
        for solver, medians in times(record).items():
            times_of_series = [
                seconds
                for problem, seconds in medians.items()
                if cases[problem] == name
            ]
            if times_of_series:
                counts = [
                    sum(seconds <= moment for seconds in times_of_series)
                    for moment in moments
                ]
                rows.append(
                    [
                        "" if rows else name,
                        solver,
                        *map(str, (len(times_of_series), *counts)),
                    ]
                )
        groups += [rows] * bool(rows)
    header = ["family", "solver", "of", *map(wording.duration, moments)]
    return sheet("Solved, or proved to have no solution, within", header, groups)


def _times(record: BenchRecord) -> Section:
    length, unit = wording.common_unit(
        summary(row.seconds).median for row in record.measurements if row.success
    )
    rows = []
    for name, group in groupby(record.measurements, key=lambda row: row.problem):
        row_of_solver = {row.solver: row for row in group}
        rows.append(
            [
                name,
                *(
                    _time(row_of_solver[solver], length)
                    if solver in row_of_solver
                    else ""
                    for solver in record.solvers
                ),
            ]
        )
    note = "Median ±half the interquartile range; the median alone for a single run."
    return sheet(f"Times in {unit}", ["problem", *record.solvers], [rows], note)


def _time(row: Measurement, length: float) -> str:
    if row.excluded or not row.success:
        return "-" if row.excluded else _failure(row)
    times = summary(row.seconds)
    return wording.digits(times.median / length) + (
        "" if times.spread is None else f" ±{100 * times.spread:.0f}%"
    )


def _failure(row: Measurement) -> str:
    if row.false_success:
        return "wrong"
    return "inexact" if row.claimed else "failed"


def _failures(record: BenchRecord) -> Section:
    header, rows = ["problem", "solver", "residual", "how it ended"], []
    for row in record.measurements:
        if not row.success and not row.excluded:
            words = row.statement.split()
            if row.claimed:
                words.insert(0, f"{_failure(row)}:")
            ending = " ".join(words)
            rows.append(
                [row.problem, row.solver, wording.short(row.scaled_residual), ending]
            )
    return sheet("Not solved", header, [rows])


def _exclusions(record: BenchRecord) -> Section:
    reasons = Counter(
        (row.solver, row.statement) for row in record.measurements if row.excluded
    )
    rows = [
        [solver, str(problems), reason]
        for (solver, reason), problems in reasons.items()
    ]
    return sheet("Excluded", ["solver", "problems", "why"], [rows])


MAX_PANELS = 4  # in the figure, so that all axes fit on a page
# Problems that a performance profile needs: its steps are fractions of their number,
# and a few large steps show little.
MIN_PROBLEMS = 5


def figure(record: BenchRecord) -> Picture:
    """Return the figure of a bench with at least one measurement."""
    panels = _panels(record)
    medians, in_seconds = times(record), is_over_time(record)
    ratios = (
        {
            name: list(ratios_of_solver.values())
            for name, ratios_of_solver in medians.items()
        }
        if in_seconds
        else performance_ratios(medians)
    )
    profiles = [
        Profile(method_of(name), name, ratios_of_solver, in_seconds)
        for name, ratios_of_solver in ratios.items()
        if ratios_of_solver
    ]
    if panels and len({row.problem for row in record.measurements}) < MIN_PROBLEMS:
        profiles = []
    return Picture("bench", (profiles, panels), conditions(record))


def _panels(record: BenchRecord) -> list[Panel]:
    """Return the panels of the largest problem of each series, those with the most
    successes and longest curves first. A peer, of which only the result is known, is a
    single point."""
    problems = [
        list(group)
        for _, group in groupby(record.measurements, key=lambda row: row.problem)
    ]
    problems.sort(
        key=lambda rows: (
            -sum(row.success for row in rows),
            -max(len(row.curve or ()) for row in rows),
        )
    )
    largest: dict[str, list[Measurement]] = {}
    for rows in problems:
        name = (
            series(rows[0].family, rows[0].parameters)
            if rows[0].family
            else rows[0].problem
        )
        if name not in largest or rows[0].n > largest[name][0].n:
            largest[name] = rows
    panels = []
    for rows in [rows for rows in largest.values() if any(row.curve for row in rows)][
        :MAX_PANELS
    ]:
        measure = next(row.curve_of for row in rows if row.curve_of)
        curves = []
        for row in rows:
            end = row.error if measure == "error" else row.residual
            points: Sequence[tuple[int | None, float, float | None]] = row.curve or []
            if not points and not row.excluded and end is not None:
                points = [(None, summary(row.seconds).median, end)]
            if points:
                k, seconds, errors = zip(*points, strict=True)
                curves.append(
                    Curve(
                        method_of(row.solver),
                        row.solver,
                        k,
                        seconds,
                        errors,
                        row.success,
                    )
                )
        panels.append(Panel(rows[0].problem, measure, curves))
    return panels


COPIED = [
    each.name
    for each in fields(Measurement)
    if each.name not in ("seconds", "curve_of", "curve")
]


def render(
    record: BenchRecord, format_name: str, width: int | None, color: bool
) -> str:
    def document(*_: object) -> Document:
        makers = (
            _solvers,
            _by_kind,
            _compared_with_peers,
            _over_time,
            _times,
            _failures,
            _exclusions,
        )
        sheets = [
            section
            for section in (make(record) for make in makers)
            if section.tables[0].rows
        ]
        name = title(record)
        drawn = partial(figure, record) if record.measurements else None
        first = Section(name, facts=conditions(record), figure=drawn)
        return Document(name, [first, *sheets])

    report = Report(
        document,
        lambda: [plain(record)],
        lambda: (_rows(record), conditions(record)),
        PIPE_WIDTH,
    )
    return report.render(format_name, width, color)


def _rows(record: BenchRecord) -> Iterator[Sequence[object]]:
    """Yield a header, and the cells of each measurement; parameters and booleans are in
    JSON, missing values empty."""
    yield [*COPIED, "median_seconds", "lower_quartile", "upper_quartile", "repeats"]
    for row in record.measurements:
        times = summary(row.seconds) if row.seconds else ("", "", "", 0)
        yield [*(cell(getattr(row, name)) for name in COPIED), *times]
