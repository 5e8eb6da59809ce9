"""Reports in Markdown."""

from __future__ import annotations

import re

from lcpcli.report.document import Document, Section, Table


def render(document: Document, _: int | None, __: bool) -> str:
    """Return a report in Markdown; each section has a heading, the one that opens the
    report a larger one."""
    opens = len(document.sections) > 1
    levels = (
        "##" if opens and section.title == document.title else "###"
        for section in document.sections
    )
    return "\n".join(map(_section, document.sections, levels))


def _section(section: Section, level: str) -> str:
    verdict = [f"**{escape_markdown(section.verdict)}**"] if section.verdict else []
    tables = [
        part
        for table in section.tables
        for part in (_grid(table), *map(escape_markdown, table.notes))
    ]
    remarks = list(map(escape_markdown, section.remarks))
    parts = [
        f"{level} {escape_markdown(section.title)}",
        *verdict,
        *map(escape_markdown, section.facts),
    ]
    parts += [*remarks, *tables] if section.verdict else [*tables, *remarks]
    return (
        "\n\n".join(filter(None, [*parts, escape_markdown(section.provenance)])) + "\n"
    )


def _grid(table: Table) -> str:
    alignments = [
        ":--" if j in table.words else "--:" for j in range(len(table.header))
    ]
    header, *rows = (map(escape_markdown, row) for row in (table.header, *table.rows))
    return "\n".join(f"| {' | '.join(row)} |" for row in (header, alignments, *rows))


def escape_markdown(text: str) -> str:
    return re.sub(r"([\\|*_<`\[$~]|&(?=[#\w]))", r"\\\1", text)
