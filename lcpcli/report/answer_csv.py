"""The answer as CSV with all digits: comments on how it was found, a header, then one line per component."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO

from lcpcli.report import provenance, summary
from lcpcli.solving.result import Result


def render(results: Sequence[Result], compared: bool) -> str:
    """Columns component (from 1), z and w; of results that are compared, problem and method before them."""
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(["problem", "method"] if compared else []), "component", "z", "w"])
    for result in results:
        start = [result.problem.name, summary.name(result)] if compared else []
        for i, (z, w) in enumerate(zip(result.z.tolist(), result.w.tolist(), strict=True), 1):
            writer.writerow([*start, i, repr(z), repr(w)])
    return "".join(f"# {line}\n" for line in provenance.lines(results)) + out.getvalue()
