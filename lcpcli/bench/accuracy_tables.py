"""Tables on the accuracy of the solvers in a bench: how fast errors fall, up to what stiffness solvers succeed, and how
well programs are solved."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import groupby

from lcpcli.bench.record import BenchRecord, Measurement
from lcpcli.bench.statistics import shifted_geometric_mean, summary
from lcpcli.bench.suites import ALL, SUITES, Case
from lcpcli.bench.verdicts import ABSOLUTE, NATURAL, RELATIVE
from lcpcli.model.problem import WITHOUT_SOLUTION
from lcpcli.report import wording
from lcpcli.report.document import Section, Table
from lcpcli.report.wording import LEVELS

NO_ENTRY = "-"
LISTED_LEVEL = LEVELS[1]  # the level of error whose times are listed: the accuracy that most users want
COLUMNS = ((RELATIVE, 1e-6), (RELATIVE, 1e-9), (ABSOLUTE, 1e-6), (ABSOLUTE, 1e-9), (NATURAL, 1e-9))
NAMES = {RELATIVE: "rel.", ABSOLUTE: "abs.", NATURAL: "natural"}
SOLVED_TO = 1e-6  # relative residual of a program up to which a time counts: about the default tolerance of the peers
PROGRAM_SHIFT = 1e-2  # seconds, as programs take longer than complementarity problems of a few unknowns


WORDS = ("solver", "problem", "family", "how it ended", "why", "up", "then", "beside")  # headings of words
SENTENCES = ("how it ended", "why")  # among them


def sheet(
    title: str, header: Sequence[str], groups: Sequence[Sequence[Sequence[str]]], notes: Sequence[str] = ()
) -> Section:
    """Return the section of one table, with notes below it."""
    words, texts = ([j for j, name in enumerate(header) if name in names] for names in (WORDS, SENTENCES))
    return Section(title, tables=[Table(header, groups, words, texts, notes=notes)])


def reached(record: BenchRecord) -> Section:
    """Return the time that each method needs to reach an error of LISTED_LEVEL on each problem."""
    times = {
        name: [own.get(method, {}).get(LISTED_LEVEL) for method in record.methods] for name, own in competing(record)
    }
    length, unit = wording.common_unit(seconds for own in times.values() for seconds in own if seconds is not None)
    rows = [
        [name, *(NO_ENTRY if seconds is None else wording.digits(seconds / length) for seconds in own)]
        for name, own in times.items()
    ]
    title = f"Time in {unit} to an error of {wording.level(LISTED_LEVEL)} relative to the solution's largest component"
    return sheet(title, ["problem", *record.methods], [rows])


def competing(record: BenchRecord) -> Iterator[tuple[str, dict[str, dict[float, float]]]]:
    """Yield the problems with a known solution on which at least two methods ran: the name, and the seconds of each
    method until each level of error."""
    for name, group in groupby(record.measurements, key=lambda row: row.problem):
        measured = {row.solver: row.milestones for row in group if row.milestones is not None}
        if len(measured) >= 2:
            yield name, {solver: {level: at for level, _, at in own} for solver, own in measured.items()}


def is_ordered(record: BenchRecord) -> bool:
    """Return whether the suite is in order of stiffness."""
    return any(name == ALL or (name in SUITES and SUITES[name].ladders) for name in record.suite)


def stability(record: BenchRecord) -> Section:
    """Return one row per family and solver, or no rows if the suite is not in order of stiffness."""
    groups = [_rungs(record, *ladder) for ladder in ladders(record.cases)] if is_ordered(record) else []
    header = ["family", "up", "solver", "to", "error", "cond.", "then"]
    notes = [
        "to: the last value up to which all problems are solved, by recomputed residuals. error: the largest error on "
        "them, against the exact solution, in units of eps times the condition: the effect of rounding the data. "
        "cond.: the largest condition of their solutions. then: how the run on the next problem ends."
    ]
    return sheet("Stability", header, [group for group in groups if group], notes)


def ladders(cases: Sequence[Case]) -> list[tuple[str, str, dict[str, str]]]:
    """Return the families of the cases, the parameter that varies in each, and its values by case, in order of
    stiffness; a problem in a file belongs to no family."""
    families: dict[tuple[str, ...], list[Case]] = {}
    for case in cases:
        if case.family:
            families.setdefault((case.family, *case.parameters), []).append(case)
    found = []
    for (family, *parameters), own in families.items():
        axis = next((name for name in parameters if len({str(case.parameters[name]) for case in own}) > 1), "n")
        values = {case.name: str(case.parameters[axis] if axis in parameters else case.n) for case in own}
        found.append((family, axis, values))
    return found


def _rungs(record: BenchRecord, family: str, axis: str, values: dict[str, str]) -> list[list[str]]:
    """Return up to what stiffness each solver measured on a ladder succeeds, and how it ends at the next step."""
    group: list[list[str]] = []
    for solver in record.solvers:
        rows = {row.problem: row for row in record.measurements if row.solver == solver}
        own = [rows[problem] for problem in values if problem in rows]
        if len(own) < len(values) or any(row.excluded for row in own):
            continue
        good = next((i for i, row in enumerate(own) if not row.success), len(own))
        cells, then = [NO_ENTRY, "", ""], "all"
        if good:
            measures = ([row.forward_error for row in own[:good]], [row.condition for row in own[:good]])
            largest = (max((size for size in sizes if size is not None), default=None) for sizes in measures)
            cells = [values[own[good - 1].problem], *map(wording.short, largest)]
        if good < len(own):
            row = own[good]
            outcome = row.status.replace("_", " ") if row.kind == "method" or not row.claimed else "claims to solve it"
            then = f"{values[row.problem]}: {'wrong' if row.false_success else outcome}"
        group.append([*(["", ""] if group else [family, axis]), solver, *cells, then])
    return group


def optimality(record: BenchRecord) -> Section:
    """Return the number of programs that each solver solved, by three measures of accuracy, and the mean times; no rows
    if no program has a solution."""
    proved = {row.problem for row in record.measurements if row.kind == "method" and row.status in WITHOUT_SOLUTION}
    programs = {row.problem for row in record.measurements if row.optimality is not None} - proved
    solvers = record.solvers if programs else []
    means = {solver: _mean_time(record, _programs_of(record, solver, programs)) for solver in solvers}
    length, unit = wording.common_unit(mean for mean in means.values() if mean is not None)
    rows = []
    for solver, mean in means.items():
        own = _programs_of(record, solver, programs)
        counts = [len(own), *(sum(_within(row, measure, level) for row in own) for measure, level in COLUMNS)]
        rows.append([solver, *map(str, counts), "" if mean is None else wording.digits(mean / length)])
    levels = (f"{NAMES[measure]} {wording.level(level)}" for measure, level in COLUMNS)
    header = ["solver", "of", *levels, f"mean/{unit}"]
    notes = [
        "Solved up to these residuals, recomputed from the program: the largest of primal and dual residual and "
        "duality gap, relative to their own terms (rel.) and absolute (abs.), and the natural residual of z and w, "
        "relative to the terms of w. "
        f"mean: geometric mean of the times of programs solved to a relative {SOLVED_TO:g}, shifted by "
        f"{wording.duration(PROGRAM_SHIFT)}; other programs count as the time limit.",
    ]
    return sheet("Optimality", header, [rows], notes)


def _programs_of(record: BenchRecord, solver: str, programs: set[str]) -> list[Measurement]:
    """Return the measurements of a solver on the programs that it accepts."""
    return [row for row in record.measurements if row.solver == solver and row.problem in programs and not row.excluded]


def _mean_time(record: BenchRecord, own: Sequence[Measurement]) -> float | None:
    """Return the shifted geometric mean of the times, with the time limit for each failure; None if `own` is empty."""
    limit = record.options.time_limit
    times = [summary(row.seconds).median if _within(row, RELATIVE, SOLVED_TO) else limit for row in own]
    return shifted_geometric_mean(times, PROGRAM_SHIFT) if times else None


def _within(row: Measurement, measure: str, level: float) -> bool:
    return row.claimed and (row.optimality or {}).get(measure, math.inf) <= level
