"""A bench as a figure: performance profile, error against time on a few problems, and growth of the time with n."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.statistics import growths, method_of, performance_ratios, summary, times
from lcpcli.bench.suites import series
from lcpcli.bench.tables import conditions
from lcpcli.report import plotting as figures
from lcpcli.report.figures.data import Curve, Panel, Profile

MOST_PANELS = 4
LEAST_PROBLEMS = 5  # for a performance profile, whose steps are shares of them


def draw(record: Record, form: str) -> bytes:
    """The figure of a bench with at least one measurement; form is one of `figures.FORMS`."""
    panels, growth_panels = _panels(record), growths(record)[:MOST_PANELS]
    ratios = performance_ratios(times(record))
    profiles = [Profile(method_of(name), name, own) for name, own in ratios.items() if own]
    measured = len({row.problem for row in record.measurements})
    if measured < LEAST_PROBLEMS and (panels or growth_panels):
        profiles = []
    return figures.bench(profiles, panels, growth_panels, form, conditions(record))


def _panels(record: Record) -> list[Panel]:
    """The problems with the most successes, the largest of each series and the one with the longest curves first."""
    problems = [list(group) for _, group in groupby(record.measurements, key=lambda row: row.problem)]
    problems.sort(
        key=lambda rows: (sum(row.success for row in rows), max(len(row.curve or ()) for row in rows)), reverse=True
    )
    largest: dict[str, list[Measurement]] = {}
    for rows in problems:
        name = series(rows[0].family, rows[0].parameters) if rows[0].family else rows[0].problem
        if name not in largest or rows[0].n > largest[name][0].n:
            largest[name] = rows
    drawable = [rows for rows in largest.values() if any(row.curve for row in rows)]
    return [_panel(rows) for rows in drawable[:MOST_PANELS]]


def _panel(rows: list[Measurement]) -> Panel:
    """The curves of the methods; a peer, of which only the end is known, is a single point."""
    measure = next(row.curve_of for row in rows if row.curve_of)
    curves = []
    for row in rows:
        end = row.error if measure == "error" else row.residual
        points: Sequence[tuple[int | None, float, float | None]] = row.curve or []
        if not points and not row.excluded and end is not None:
            points = [(None, summary(row.seconds).median, end)]
        if points:
            k, seconds, errors = zip(*points, strict=True)
            curves.append(Curve(method_of(row.solver), row.solver, k, seconds, errors, row.success))
    return Panel(rows[0].problem, measure, curves)
