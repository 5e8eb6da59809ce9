"""The answer as CSV with all digits: comments on how it was found, a header, then one line per component."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO

from lcpcli.report import provenance, summary
from lcpcli.solving.result import Result


def render(results: Sequence[Result], compared: bool) -> str:
    """Columns component (from 1), z, w and, if a problem has bounds, state; of results that are compared, problem and
    method before them."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    mixed = any(result.problem.is_mixed for result in results)
    writer.writerow([*(["problem", "method"] if compared else []), "component", "z", "w", *["state"] * mixed])
    for result in results:
        start = [result.problem.name, summary.name(result)] if compared else []
        states = [[state] for state in result.basis] if mixed else [[]] * result.problem.n
        for i, (z, w, state) in enumerate(zip(result.z.tolist(), result.w.tolist(), states, strict=True), 1):
            writer.writerow([*start, i, repr(z), repr(w), *state])
    return "".join(f"# {line}\n" for line in provenance.lines(results)) + out.getvalue()
