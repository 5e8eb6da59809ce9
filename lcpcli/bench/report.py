"""The report on a bench, made from its record in one of `formats.FORMATS`; only JSON and CSV have all digits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial

from lcpcli.bench.record import BenchRecord, to_json
from lcpcli.bench.report_tables import conditions, draw_figure, sheets, title
from lcpcli.bench.statistics import summary
from lcpcli.report.document import Document, Section
from lcpcli.report.formats import typeset
from lcpcli.report.result_csv import written
from lcpcli.report.wording import PIPE_WIDTH

COPIED = (
    *("problem", "family", "n", "seed", "parameters", "solver", "kind", "status", "statement", "claimed", "success"),
    *("false_success", "residual", "scaled_residual", "error", "condition", "forward_error", "optimality"),
    *("iterations", "evaluations", "setup_seconds"),
)
COMPUTED = ("median_seconds", "lower_quartile", "upper_quartile", "repeats")


def render(record: BenchRecord, form: str, width: int | None, color: bool) -> str:
    """Return the record as text in a format.

    width, color : the width of the terminal, None if there is none, and whether it shows colours.
    """
    if form == "json":
        return to_json(record)
    name, facts = title(record), conditions(record)
    if form == "csv":
        return _csv(record, facts)
    tables = sheets(record, width or PIPE_WIDTH if form == "table" else None)
    figure = partial(draw_figure, record, "svg") if record.measurements else None
    return typeset(Document(name, [Section(name, facts=facts, figure=figure), *tables]), form, width, color)


def _csv(record: BenchRecord, comments: Sequence[str]) -> str:
    """Return comments on the conditions, a header, and one line per measurement; parameters and booleans are in JSON,
    missing values are empty."""
    rows: list[Sequence[object]] = [[*COPIED, *COMPUTED]]
    for row in record.measurements:
        values = [getattr(row, name) for name in COPIED]
        cells = [v if v is None or isinstance(v, str) else json.dumps(v, ensure_ascii=False) for v in values]
        times = vars(summary(row.seconds)).values() if row.seconds else ("", "", "", 0)
        rows.append([*cells, *times])
    return written(rows, comments)
