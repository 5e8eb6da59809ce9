"""Results as panels of a figure: one panel per problem, one curve per run."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.report import numbers, provenance, summary
from lcpcli.report.figures.data import Curve, Panel
from lcpcli.solving.result import Result


def panels(runs: Sequence[Sequence[Result]]) -> list[Panel]:
    """The curves of the runs, grouped by problem; each run must have recorded a `curve` or a trace.

    Errors are drawn if a solution is known or computed, else residuals. Time is that of the rows.
    """
    return [_panel(results) for results in runs]


def _panel(results: Sequence[Result]) -> Panel:
    problem = results[0].problem
    measure = "error" if problem.solutions else "residual"
    name = numbers.title(problem)
    title = ", ".join((*([name] if name else []), numbers.size(problem)))
    return Panel(title, measure, [_curve(result) for result in results], "; ".join(provenance.lines(results)))


def _curve(result: Result) -> Curve:
    kept = result.curve or result.trace
    rows = kept.rows if kept else []
    known = bool(result.problem.solutions)
    return Curve(
        name=result.method,
        label=summary.name(result).replace(" warm", ", warm"),
        k=[row.k for row in rows],
        seconds=[row.seconds for row in rows],
        errors=[row.error if known else row.residual for row in rows],
        solved=result.solved,
    )
