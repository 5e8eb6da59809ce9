"""A bench in Markdown and in LaTeX."""

from __future__ import annotations

from collections.abc import Callable

from lcpcli.bench.report.sheet import LEFT, Sheet
from lcpcli.bench.report.sheets import Report
from lcpcli.report import markup


def in_markdown(report: Report) -> str:
    """A heading, the conditions of measurement, and one section per table."""
    parts = [
        f"## {markup.escape_markdown(report.title)}",
        *(f"- {markup.escape_markdown(line)}" for line in report.lines),
    ]
    head = "\n".join([parts[0], "", *parts[1:]])
    return "\n\n".join([head, *(_section(sheet) for sheet in report.sheets)]) + "\n"


def in_latex(report: Report) -> str:
    """A comment with the conditions of measurement, then one table environment per table, ready to be \\input."""
    head = [f"% {' '.join(line.split())}" for line in (report.title, *report.lines)]
    labels = markup.labels([sheet.title for sheet in report.sheets])
    floats = [_environment(sheet, label) for sheet, label in zip(report.sheets, labels, strict=True)]
    return "\n".join([markup.NEEDED, *head, *floats]) + "\n"


def _section(sheet: Sheet) -> str:
    rows = [row for group in sheet.groups for row in group]
    notes = [markup.escape_markdown(note) for note in sheet.notes]
    return "\n\n".join([f"### {markup.escape_markdown(sheet.title)}", markup.grid(sheet.header, rows, LEFT), *notes])


def _environment(sheet: Sheet, label: str) -> str:
    return markup.float_of(sheet.title, label, [markup.tabular(sheet.header, sheet.groups, LEFT)], sheet.notes)


RENDERERS: dict[str, Callable[[Report], str]] = {"markdown": in_markdown, "latex": in_latex}
