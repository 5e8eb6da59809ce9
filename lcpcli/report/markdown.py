"""The tables of iterates in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.report.iterations import IterationTable


def render(tables: Sequence[IterationTable]) -> str:
    """One section a problem: the iterates, then a line a method."""
    return "\n".join(_section(table) for table in tables)


def _section(table: IterationTable) -> str:
    parts = [f"### {_escape(table.title)}", _table(table.header, [row for group in table.groups for row in group])]
    parts.append(_table(table.summary_header, table.summary))
    parts += [_escape(remark) for remark in table.remarks]
    return "\n\n".join(parts) + "\n"


def _table(header: list[str], rows: list[list[str]]) -> str:
    marks = [":--" if name in ("method", "status") else "--:" for name in header]
    return "\n".join(f"| {' | '.join(map(_escape, row))} |" for row in (header, marks, *rows))


def _escape(text: str) -> str:
    for mark in "\\|*_<":
        text = text.replace(mark, "\\" + mark)
    return text
