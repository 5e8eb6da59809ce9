"""The answer as CSV with all digits: comments on how it was found, a header, then one line per component."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from io import StringIO
from typing import Any

from lcpcli.report import provenance, summary
from lcpcli.solving.result import Result

COLUMNS = ("component", "z", "w")  # components from 1
STATE = "state"


def render(results: Sequence[Result], compared: bool) -> str:
    """Columns component, z, w and, if a problem has bounds, state; of results that are compared, problem and method
    before them."""
    mixed = any(result.problem.is_mixed for result in results)
    header = [*(["problem", "method"] if compared else []), *COLUMNS, *[STATE] * mixed]
    lines = [rows(result, [result.problem.name, summary.name(result)] * compared, mixed) for result in results]
    return comments(provenance.lines(results)) + text([header]) + "".join(lines)


def rows(result: Result, start: Sequence[str], mixed: bool) -> str:
    """A line for each component of a result, which starts with these cells; mixed is whether there is a state."""
    states = [[state] for state in result.basis] if mixed else [[]] * result.problem.n
    return text(
        [*start, i, repr(z), repr(w), *state]
        for i, (z, w, state) in enumerate(zip(result.z.tolist(), result.w.tolist(), states, strict=True), 1)
    )


def comments(lines: Sequence[str]) -> str:
    """Lines of text as comments."""
    return "".join(f"# {line}\n" for line in lines)


def text(cells: Iterable[Sequence[Any]]) -> str:
    """Rows of cells as CSV."""
    out = StringIO()
    csv.writer(out, lineterminator="\n").writerows(cells)
    return out.getvalue()
