"""The tables of iterates in Markdown."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lcpcli.report.iterations import LEFT, IterationTable


def render(tables: Sequence[IterationTable]) -> str:
    """One section per problem: a single result and its iterates, or the iterates and then one line per method."""
    return "\n".join(_section(table) for table in tables)


def _section(table: IterationTable) -> str:
    title = f"### {escape(table.title)}"
    remarks = [escape(line) for line in (*table.facts, *table.remarks)]
    iterates = grid(table.header, [row for group in table.groups for row in group], LEFT)
    parts = [title, iterates, grid(table.summary_header, table.summary, LEFT), *remarks]
    if table.verdict:
        parts = [title, f"**{escape(table.verdict)}**", *remarks, iterates]
    return "\n\n".join([*parts, escape(table.provenance)]) + "\n"


def grid(header: list[str], rows: list[list[str]], left: Collection[str]) -> str:
    """A table; `left` are the names of the left-aligned columns."""
    marks = [":--" if name in left else "--:" for name in header]
    return "\n".join(f"| {' | '.join(map(escape, row))} |" for row in (header, marks, *rows))


def escape(text: str) -> str:
    """Text with Markdown's special characters escaped."""
    for mark in "\\|*_<`[":
        text = text.replace(mark, "\\" + mark)
    return text
