"""The report on a bench in each format, as pure functions from its record to text; only JSON and CSV have all digits.

Nothing heavy is imported, so that the formats can be listed in help.
"""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.bench.record import Record

FORMATS = {
    "table": "human-readable",
    "json": "the record, to resume from",
    "csv": "one row per measurement, all digits",
    "markdown": "the tables in Markdown",
    "latex": "the tables in LaTeX with booktabs",
}
PAGE = 80  # columns of a table without a terminal
LEFT = ("solver", "problem", "family", "how it ended", "why", "in", "up", "then")  # left-aligned columns
COPIED = (
    *("problem", "family", "n", "seed", "parameters", "solver", "kind", "status", "statement", "claimed", "success"),
    *("false_success", "residual", "scaled_residual", "error", "condition", "forward_error", "optimality"),
    *("iterations", "evaluations", "setup_seconds"),
)
COMPUTED = ("median_seconds", "lower_quartile", "upper_quartile", "repeats")


def render(record: Record, form: str, width: int | None, color: bool) -> str:
    """The record as text in a format.

    width, color : of the terminal; width is None if there is none.
    """
    if form == "json":
        from lcpcli.bench.record import to_json

        return to_json(record)
    if form == "csv":
        return _csv(record)
    if form == "table":
        return _text(record, width or PAGE, color)
    return _markdown(record) if form == "markdown" else _latex(record)


def _csv(record: Record) -> str:
    """Comments on how it was measured, a header, and one line per measurement: parameters are JSON, booleans as in
    JSON, missing values empty."""
    import csv
    import json
    from io import StringIO

    from lcpcli.bench.statistics import summary
    from lcpcli.bench.tables import conditions

    out = StringIO()
    out.writelines(f"# {line}\n" for line in conditions(record))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*COPIED, *COMPUTED])
    for row in record.measurements:
        values = [getattr(row, name) for name in COPIED]
        cells = ["" if v is None else v if isinstance(v, str) else json.dumps(v, ensure_ascii=False) for v in values]
        times = vars(summary(row.seconds)).values() if row.seconds else ("", "", "", 0)
        writer.writerow([*cells, *times])
    return out.getvalue()


def _markdown(record: Record) -> str:
    """A heading, the conditions of measurement, and one section per table."""
    from lcpcli.bench.tables import conditions, sheets, title
    from lcpcli.report.markup import escape_markdown, grid

    parts = [
        "\n".join(
            [f"## {escape_markdown(title(record))}", "", *(f"- {escape_markdown(line)}" for line in conditions(record))]
        )
    ]
    for sheet in sheets(record, None):
        rows = [row for group in sheet.groups for row in group]
        parts += [
            f"### {escape_markdown(sheet.title)}",
            grid(sheet.header, rows, LEFT),
            *map(escape_markdown, sheet.notes),
        ]
    return "\n\n".join(parts) + "\n"


def _latex(record: Record) -> str:
    """A comment with the conditions of measurement, then one table environment per table, ready to be \\input."""
    from lcpcli.bench import tables
    from lcpcli.report import markup

    head = (tables.title(record), *tables.conditions(record))
    lines = [markup.NEEDED, *(f"% {' '.join(line.split())}" for line in head)]
    sheets = tables.sheets(record, None)
    for sheet, label in zip(sheets, markup.labels([sheet.title for sheet in sheets]), strict=True):
        lines.append(
            markup.float_of(sheet.title, label, [markup.tabular(sheet.header, sheet.groups, LEFT)], sheet.notes)
        )
    return "\n".join(lines) + "\n"


def _text(record: Record, width: int, color: bool) -> str:
    """Text of that width, styled by rich on a terminal. Numbers are never truncated or broken."""
    from io import StringIO

    from rich.text import Text

    from lcpcli.bench.tables import conditions, sheets, title
    from lcpcli.report.terminal import UNLIMITED, console_on, grid, trimmed

    out = StringIO()
    console = console_on(out, UNLIMITED, color)

    def show(lines: list[str], style: str = "") -> None:
        for line in lines:
            for part in textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False):
                console.print(Text(part, style=style))

    show([title(record)], "bold")
    show(conditions(record))
    for sheet in sheets(record, width):
        console.print()
        show([sheet.title], "bold")
        console.print(grid(sheet.header, sheet.groups, width, LEFT))
        show(sheet.notes, "dim")
    return trimmed(out)
