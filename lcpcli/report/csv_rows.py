"""The iterates as CSV with all digits: a header, then one line per iterate."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO

from lcpcli.solving.result import Result


def render(results: Sequence[Result]) -> str:
    """Columns problem, method, k, z1 ... zn, residual, error, seconds, step; missing values are empty."""
    n = max(result.problem.n for result in results)
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(
        ["problem", "method", "k", *(f"z{i + 1}" for i in range(n)), "residual", "error", "seconds", "step"]
    )
    for result in results:
        blanks = [""] * (n - result.problem.n)
        for row in result.trace.rows if result.trace else []:
            measures = [_cell(value) for value in (row.residual, row.error, row.seconds)]
            start = [result.problem.name, result.method, row.k]
            writer.writerow([*start, *map(repr, row.z.tolist()), *blanks, *measures, row.step])
    return out.getvalue()


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value)
