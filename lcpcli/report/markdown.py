"""The tables of iterates in Markdown."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lcpcli.report.result_table import LEFT, ResultTable


def render(tables: Sequence[ResultTable]) -> str:
    """One section per problem: a single result and its iterates, or the iterates and then one line per method."""
    return "\n".join(_section(table) for table in tables)


def _section(table: ResultTable) -> str:
    title = f"### {escape(table.title)}"
    remarks = [escape(line) for line in (*table.facts, *table.remarks)]
    rows = [row for group in table.groups for row in group]
    iterates = grid(table.header, rows, LEFT) if rows else ""
    parts = [title, iterates, grid(table.summary_header, table.summary, LEFT), *remarks]
    if table.verdict:
        parts = [title, f"**{escape(table.verdict)}**", *remarks, iterates]
    return "\n\n".join(filter(None, [*parts, escape(table.provenance)])) + "\n"


def grid(header: list[str], rows: list[list[str]], left: Collection[str]) -> str:
    """A table; `left` are the names of the left-aligned columns."""
    marks = [":--" if name in left else "--:" for name in header]
    return "\n".join(f"| {' | '.join(map(escape, row))} |" for row in (header, marks, *rows))


def escape(text: str) -> str:
    """Text with Markdown's special characters escaped."""
    for mark in "\\|*_<`[":
        text = text.replace(mark, "\\" + mark)
    return text
