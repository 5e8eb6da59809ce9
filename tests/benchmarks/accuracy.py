"""What a bench says of accuracy beyond its own tables: accuracy.py RECORD.json, a file written by lcp bench -o

Tables: how far each solver gets as the problems of `lcp bench stiff` and `extreme` become stiffer; the times to an
error of 1e-6; how often each method is first to reach an error; and the convergence factors of fixed-point, measured
and from theory.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby, product

import numpy as np

from lcpcli.bench import record as records
from lcpcli.bench.record import BenchRecord
from lcpcli.bench.report import sheet
from lcpcli.bench.suites import EXTREME, STIFF, Case, prepare
from lcpcli.errors import count
from lcpcli.inspection.theory import contraction
from lcpcli.model.problem import Problem
from lcpcli.report import wording
from lcpcli.report.document import Document, Section, typeset
from lcpcli.report.wording import LEVELS

NO_ENTRY = "-"
LISTED_LEVEL = LEVELS[1]  # the level of error whose times are listed: the accuracy that most users want
ALIKE = 1.02  # times within this factor count as equal, as repeated measurements differ by as much
RATE_BEGINS, RATE_ENDS = 1e-2, 1e-9  # errors, relative to the solution: after the first phase, and before rounding
MOST_WITH_RATE = 400  # unknowns up to which the theoretical factors, from dense eigenvalues, take less than a second
LEAST_ITERATES = 8  # for a rate by least squares, which fewer would leave uncertain
Curve = Sequence[tuple[int, float, float | None]]


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


def stability(record: BenchRecord) -> Section:
    """Return one row per family and solver, of families whose cases are in order of stiffness."""
    ordered = [each for each in record.cases if each in (*STIFF, *EXTREME)]
    groups = [_rungs(record, *ladder) for ladder in ladders(ordered)]
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


def firsts(record: BenchRecord) -> Section:
    """Return on how many problems each method reached each level of error first; methods that tie all count."""
    problems, wins = [own for _, own in competing(record)], Counter[tuple[str, float]]()
    for own, level in product(problems, LEVELS):
        times = {method: reached[level] for method, reached in own.items() if level in reached}
        wins.update((method, level) for method in times if times[method] <= ALIKE * min(times.values()))
    rows = [[method, *(str(wins[method, level]) for level in LEVELS)] for method in record.methods if problems]
    header = ["solver", *(f"to {wording.level(level)}" for level in LEVELS)]
    notes = [f"Times within {ALIKE - 1:.0%} count as equal: several methods are then first."]
    return sheet(f"How often first to reach an error, on {count(len(problems), 'problem')}", header, [rows], notes)


def rates(record: BenchRecord) -> Section:
    """Return the convergence factors of fixed-point, measured and from theory."""
    factors = ("measured", "local", "bound")
    rows = []
    cases = {case.name: case for case in record.cases}
    for row in record.measurements:
        rate = None
        if row.solver == "fixed-point" and row.curve:
            problem = prepare(cases[row.problem])
            rate = rate_of_fixed_point(problem, row.curve) if isinstance(problem, Problem) else None
        if rate is not None:
            cells = [f"{rate[name]:.4f}" if name in rate else "" for name in factors]
            rows.append([row.problem, str(row.iterations), *cells])
    notes = [
        "measured: least-squares fit to the logarithms of the errors. local: the spectral radius of the iteration at a "
        "nondegenerate solution. bound: |(I + M)^-1 (I - M)|_2; max |1 - lambda| / |1 + lambda| for symmetric M."
    ]
    title = "Linear convergence of fixed-point: factor per iteration"
    return sheet(title, ["problem", "iterations", *factors], [rows], notes)


def rate_of_fixed_point(problem: Problem, curve: Curve) -> dict[str, float] | None:
    """Return the convergence factors of fixed-point: measured, the local one of theory if it exists, and the bound.

    The result is None if the run shows no rate, for several known solutions, or beyond MOST_WITH_RATE unknowns.
    """
    if len(problem.solutions) != 1 or problem.n > MOST_WITH_RATE:
        return None
    size, z = problem.size_of_solutions, problem.solutions[0]
    errors = [error if error is not None else 0.0 for _, _, error in curve]
    factor = empirical_rate([k for k, _, _ in curve], errors, RATE_BEGINS * size, RATE_ENDS * size)
    theory = contraction(problem, problem.box.x_of(z, problem.w(z))) if factor is not None else None
    if factor is None or theory is None:
        return None
    local = {} if theory.local is None else {"local": theory.local}
    return {"measured": factor, **local, "bound": theory.bound}


def empirical_rate(k: Sequence[int], errors: Sequence[float], largest: float, smallest: float) -> float | None:
    """Return the reduction of the error per iteration, by least squares on the logarithms of the errors, from the first
    error below `largest` to the last one above `smallest`; None for fewer than LEAST_ITERATES iterates."""
    below = next((i for i, error in enumerate(errors) if error < largest), len(errors))
    above = max((i for i, error in enumerate(errors) if error > smallest), default=-1)
    kept = [i for i in range(below, above + 1) if errors[i] > 0]
    if len(kept) < LEAST_ITERATES:
        return None
    slope = float(np.polyfit([k[i] for i in kept], [math.log(errors[i]) for i in kept], 1)[0])
    return math.exp(slope)


def main(path: str) -> None:
    record = records.read(path)
    tables = [own for own in (stability(record), reached(record), firsts(record), rates(record)) if own.tables[0].rows]
    print(typeset(Document(path, tables), "table", None, False), end="")


if __name__ == "__main__":
    main(sys.argv[1])
