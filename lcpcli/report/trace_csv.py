"""The iterates as CSV with all digits, by the clock of the figures: comments, a header, then one line per iterate."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO

from lcpcli.report import provenance, summary
from lcpcli.solving.result import Result

OPENING = "# iterates, "  # by which a file is recognised as a trace


def render(results: Sequence[Result]) -> str:
    """Columns problem, method, k, z1 ... zn, residual, error, seconds, step, status; missing values are empty.

    status : in the last row of a run, how it ended; else empty.
    """
    n = max(result.problem.n for result in results)
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    measures = ["residual", "error", "seconds", "step", "status"]
    writer.writerow(["problem", "method", "k", *(f"z{i + 1}" for i in range(n)), *measures])
    for result in results:
        blanks = [""] * (n - result.problem.n)
        rows = result.trace.rows if result.trace else []
        for row in rows:
            numbers = [_cell(value) for value in (row.residual, row.error, row.seconds)]
            status = result.status.word if row is rows[-1] else ""
            start = [result.problem.name, summary.name(result), row.k]
            writer.writerow([*start, *map(repr, row.z.tolist()), *blanks, *numbers, row.step, status])
    head, *told = provenance.lines(results)
    return "".join(f"{line}\n" for line in (f"{OPENING}{head}", *(f"# {line}" for line in told))) + out.getvalue()


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value)
