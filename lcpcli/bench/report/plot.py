"""A bench as a figure: performance profile, error against time on a few problems, and growth of the time with n."""

from __future__ import annotations

from itertools import groupby

from lcpcli.bench.record import Measurement, Record
from lcpcli.bench.report.sheets import conditions
from lcpcli.bench.scores import growths, times
from lcpcli.bench.statistics import Fit, performance_ratios, summary
from lcpcli.bench.suites import series
from lcpcli.report import plotting as figures
from lcpcli.report.figures.data import Curve, Growth, GrowthPanel, Panel, Power, Profile

MOST_PANELS = 4
LEAST_PROBLEMS = 5  # for a performance profile, whose steps are shares of them


def draw(record: Record, form: str) -> bytes:
    """The figure of a bench with at least one measurement; form is one of `figures.FORMS`."""
    panels, growth_panels = _panels(record), _growth_panels(record)
    profiles = [
        Profile(_method(name), name, ratios) for name, ratios in performance_ratios(times(record)).items() if ratios
    ]
    measured = len({row.problem for row in record.measurements})
    if measured < LEAST_PROBLEMS and (panels or growth_panels):
        profiles = []
    return figures.bench(profiles, panels, growth_panels, form, conditions(record))


def _method(solver: str) -> str:
    """The method of a solver, which decides how it is drawn: shi of shi:p=10."""
    return solver.partition(":")[0]


def _panels(record: Record) -> list[Panel]:
    """The problems with the most successes, the largest of each series and the one with the longest curves first."""
    problems = [list(group) for _, group in groupby(record.measurements, key=lambda row: row.problem)]
    problems.sort(key=lambda rows: (sum(row.success for row in rows), max(_points(row) for row in rows)), reverse=True)
    largest: dict[str, list[Measurement]] = {}
    for rows in problems:
        name = series(rows[0].family, rows[0].parameters) if rows[0].family else rows[0].problem
        if name not in largest or rows[0].n > largest[name][0].n:
            largest[name] = rows
    drawable = [rows for rows in largest.values() if any(row.curve for row in rows)]
    return [_panel(rows) for rows in drawable[:MOST_PANELS]]


def _points(row: Measurement) -> int:
    return len(row.curve or ())


def _panel(rows: list[Measurement]) -> Panel:
    measure = next(row.curve_of for row in rows if row.curve_of)
    curves = [_curve(row, measure) for row in rows if not row.excluded]
    return Panel(rows[0].problem, measure, [curve for curve in curves if curve.k])


def _curve(row: Measurement, measure: str) -> Curve:
    """A method's curve; a peer, of which only the end is known, is a single point."""
    if row.curve:
        k, seconds, errors = zip(*row.curve, strict=True)
        return Curve(_method(row.solver), row.solver, k, seconds, errors, row.success)
    end = row.error if measure == "error" else row.residual
    if end is None:
        return Curve(_method(row.solver), row.solver, [], [], [], row.success)
    return Curve(_method(row.solver), row.solver, [None], [summary(row.seconds).median], [end], row.success)


def _power(fit: Fit | None) -> Power | None:
    return None if fit is None else Power(fit.exponent, fit.margin, fit.coefficient)


def _growth_panels(record: Record) -> list[GrowthPanel]:
    panels = []
    for name, own in groupby(growths(record), key=lambda growth: growth.series):
        lines = [
            Growth(
                name=_method(growth.solver),
                label=growth.solver,
                n=[n for n, _ in growth.points],
                seconds=[times.median for _, times in growth.points],
                lower=[times.lower for _, times in growth.points],
                upper=[times.upper for _, times in growth.points],
                fit=_power(growth.fit),
            )
            for growth in own
        ]
        panels.append(GrowthPanel(name, lines))
    return panels[:MOST_PANELS]
