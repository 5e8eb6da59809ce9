"""From the record of a bench to text: pure functions, one module per format. Nothing here prints or writes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.bench.record import Record

PAGE = 80  # columns of a table without a terminal


def render(record: Record, form: str, width: int | None, color: bool) -> str:
    """The record as text in a format.

    width, color : of the terminal; width is None if there is none.
    """
    if form == "json":
        from lcpcli.bench.record import to_json

        return to_json(record)
    if form == "csv":
        from lcpcli.bench.report import csv_rows

        return csv_rows.render(record)
    from lcpcli.bench.report import sheets

    if form in ("markdown", "latex"):
        from lcpcli.bench.report import markup

        return markup.RENDERERS[form](sheets.build(record, None))
    from lcpcli.bench.report import terminal

    return terminal.render(sheets.build(record, width or PAGE), width or PAGE, color)
