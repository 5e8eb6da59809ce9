"""The report on a bench, made from its record in one of suites.FORMATS; only JSON and CSV have all digits."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from dataclasses import astuple
from importlib.util import find_spec
from io import StringIO

from lcpcli.bench.accuracy_tables import Sheet
from lcpcli.bench.record import BenchRecord, to_json
from lcpcli.bench.report_tables import conditions, draw_figure, sheets, title
from lcpcli.bench.statistics import summary
from lcpcli.report import markup
from lcpcli.report.markup import escape_markdown
from lcpcli.report.result_csv import written
from lcpcli.report.wording import PIPE_WIDTH, all_visible, in_a_line

LEFT = ("solver", "problem", "family", "how it ended", "why", "up", "then", "beside")  # left-aligned columns
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
    head = [title(record), *conditions(record)]
    if form == "csv":
        return _csv(record, head[1:])
    tables = sheets(record, width or PIPE_WIDTH if form == "table" else None)
    picture = _picture(record) if form == "html" and record.measurements else None
    return typeset(head, tables, form, width, color, picture)


def typeset(
    head: Sequence[str],
    tables: Sequence[Sheet],
    form: str,
    width: int | None,
    color: bool,
    picture: bytes | None = None,
) -> str:
    """Return tables as text, HTML, Markdown or LaTeX, below lines of which the first is the title, and a picture in
    HTML. width, color : as for `render`."""
    head, tables = all_visible(head), [Sheet(*map(all_visible, astuple(sheet))) for sheet in tables]
    if form == "table":
        return _text(head, tables, width or PIPE_WIDTH, color)
    if form == "html":
        return _html(head, tables, picture)
    return _markdown(head, tables) if form == "markdown" else _latex(head, tables)


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


def _markdown(head: Sequence[str], shown: Sequence[Sheet]) -> str:
    name, *lines = map(escape_markdown, head)
    parts = ["\n".join([f"## {name}", "", *(f"- {line}" for line in lines)])]
    for sheet in shown:
        rows = [row for group in sheet.groups for row in group]
        table = markup.grid(sheet.header, rows, LEFT)
        parts += [f"### {escape_markdown(sheet.title)}", table, *map(escape_markdown, sheet.notes)]
    return "\n\n".join(parts) + "\n"


def _latex(head: Sequence[str], shown: Sequence[Sheet]) -> str:
    lines = [markup.NEEDED, *(f"% {in_a_line(line)}" for line in head)]
    for sheet, label in zip(shown, markup.labels([sheet.title for sheet in shown]), strict=True):
        table = markup.tabular(sheet.header, sheet.groups, LEFT)
        lines.append(markup.float_of(sheet.title, label, [table], sheet.notes))
    return "\n".join(lines) + "\n"


def _html(head: Sequence[str], tables: Sequence[Sheet], picture: bytes | None) -> str:
    """Return a page with the picture, if there is one, and one section per table."""
    from lcpcli.report import html_page

    first = [html_page.Section("Profiles and curves", picture=picture)] if picture else []
    others = [
        html_page.Section(sheet.title, tables=[html_page.grid(sheet.header, sheet.groups, LEFT)], notes=sheet.notes)
        for sheet in tables
    ]
    return html_page.page(head[0], [*first, *others], head[1:])


def _picture(record: BenchRecord) -> bytes | None:
    return draw_figure(record, "svg") if find_spec("matplotlib") is not None else None


def _text(head: Sequence[str], shown: Sequence[Sheet], width: int, color: bool) -> str:
    """Return the report as text of this width, styled by rich on a terminal. Numbers are never truncated or broken."""
    from rich.text import Text

    from lcpcli.report.terminal import UNLIMITED, console_on, grid, trim

    out = StringIO()
    console = console_on(out, UNLIMITED, color)

    def show(lines: Sequence[str], style: str = "") -> None:
        for line in lines:
            for part in textwrap.wrap(line, width, break_long_words=False, break_on_hyphens=False):
                console.print(Text(part, style=style))

    show(head[:1], "bold")
    show(head[1:])
    for sheet in shown:
        console.print()
        show([sheet.title], "bold")
        console.print(grid(sheet.header, sheet.groups, width, LEFT))
        show(sheet.notes, "dim")
    return trim(out)
