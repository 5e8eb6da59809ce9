"""How many programs each solver solved, by three measures of accuracy, and the mean time of that."""

from __future__ import annotations

import math

from lcpcli.bench.optimality import ABSOLUTE, NATURAL, RELATIVE
from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.report.sheet import Sheet
from lcpcli.bench.statistics import shifted_geometric_mean, summary
from lcpcli.model.problem import WITHOUT_SOLUTION
from lcpcli.report import wording

COLUMNS = ((RELATIVE, 1e-6), (RELATIVE, 1e-9), (ABSOLUTE, 1e-6), (ABSOLUTE, 1e-9), (NATURAL, 1e-9))
NAMES = {RELATIVE: "rel.", ABSOLUTE: "abs.", NATURAL: "natural"}
COUNTED = 1e-6  # relative residual up to which a time counts
SHIFT = 1e-2  # seconds, as programs take longer than complementarity problems of a few unknowns


def build(record: Record) -> Sheet:
    """One row per solver; nothing unless there are programs with a solution."""
    proved = {row.problem for row in record.measurements if row.kind == "method" and row.status in WITHOUT_SOLUTION}
    programs = {row.problem for row in record.measurements if row.optimality is not None} - proved
    rows = [_row(record, solver, programs) for solver in record.solvers] if programs else []
    levels = [f"{NAMES[measure]} {level:.0e}".replace("e-0", "e-") for measure, level in COLUMNS]
    header = ["solver", "of", *levels, "mean time"]
    notes = [
        "Solved up to these residuals, recomputed from the program: the largest of primal and dual residual and "
        "duality gap, relative to their own terms (rel.) and absolute (abs.), and the natural residual of z and w, "
        "relative to the terms of w. "
        f"mean time: of those solved to a relative {COUNTED:g}, a geometric mean shifted by {wording.duration(SHIFT)}; "
        "the others count as the time limit.",
    ]
    return Sheet("Optimality", header, [rows] if rows else [], notes)


def _row(record: Record, solver: str, programs: set[str]) -> list[str]:
    own = [row for row in record.measurements if row.solver == solver and row.problem in programs and not row.excluded]
    counts = [sum(_within(row, measure, level) for row in own) for measure, level in COLUMNS]
    limit = record.options.time_limit
    times = [summary(row.seconds).median if _within(row, RELATIVE, COUNTED) else limit for row in own]
    mean = wording.duration(shifted_geometric_mean(times, SHIFT)) if times else ""
    return [solver, str(len(own)), *map(str, counts), mean]


def _within(row: Measurement, measure: str, level: float) -> bool:
    return row.claimed and (row.optimality or {}).get(measure, math.inf) <= level
