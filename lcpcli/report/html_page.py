"""A report as one HTML page, which needs neither network nor JavaScript, and prints.
Figures are drawn if matplotlib is installed; else a note says how to install it."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from importlib.util import find_spec

from lcpcli.errors import missing
from lcpcli.report.document import Document, Section, Table

STYLE = """
:root { color-scheme: light dark; --line: #8888; --soft: #8882; --good: #1f8f3f; \
--bad: #d9363e }
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; max-width: 76rem; \
padding: 1rem 1.5rem 3rem }
h1 { font-size: 1.5rem; margin: 0.5rem 0 }
h2 { font-size: 1.2rem; margin: 2rem 0 0.5rem; border-bottom: 1px solid var(--line); \
padding-bottom: 0.25rem }
p { margin: 0.4rem 0; overflow-wrap: anywhere }
.verdict { font-weight: 600; color: var(--bad) }
.settled { color: var(--good) }
.notes { opacity: 0.85; font-size: 0.9rem }
figure { margin: 1rem 0; overflow-x: auto }
figure img { background: white }
.wide { overflow-x: auto; margin: 0.75rem 0 }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; \
font-size: 0.9rem }
th, td { padding: 0.2rem 0.75rem; text-align: right; vertical-align: top; \
white-space: nowrap }
th.left, td.left, th.text, td.text { text-align: left }
td.text { white-space: normal; min-width: 12rem }
thead th { position: sticky; top: 0; background: Canvas; \
border-bottom: 1px solid var(--line) }
tbody + tbody tr:first-child td { border-top: 1px solid var(--line) }
tbody tr:hover { background: var(--soft) }
summary { cursor: pointer; margin-top: 0.75rem }
@media print { details > :not(summary) { display: block } }
"""

# Rows of a table with a name that a page shows at once, about a screen; more are folded
# into one line.
MAX_OPEN = 30


def render(document: Document, _: int | None, __: bool) -> str:
    title = escape(document.title)
    head = (
        '<meta charset="utf-8"><meta name="viewport" '
        f'content="width=device-width"><title>{title}</title>'
    )
    parts = [head, f"<style>{STYLE}</style>", f"<h1>{title}</h1>"]
    for section in document.sections:
        if section.title != document.title:
            parts.append(f"<h2>{escape(section.title)}</h2>")
        parts += _section(section)
    return '<!doctype html>\n<html lang="en">\n' + "\n".join(parts) + "\n</html>\n"


def part(section: Section) -> str:
    """Return a section as a part of another page, as a notebook is one."""
    (shown,) = Document(section.title, [section]).visible().sections
    parts = [
        '<div class="lcp"><style>.lcp .left { text-align: left }</style>',
        f"<b>{escape(shown.title)}</b>",
    ]
    return "\n".join([*parts, *_section(shown), "</div>"])


def _section(section: Section) -> list[str]:
    """Return the parts of a section: the answer, which is the verdict with what it
    means, the facts and the tables without a name; the figure, the tables with a name,
    and notes."""
    first = [section.verdict] * bool(section.verdict)
    verdict_class = "verdict settled" if section.is_as_requested else "verdict"
    parts = [_line(text, verdict_class) for text in first]
    notes = [*([] if first else section.remarks), *filter(None, [section.provenance])]
    parts += [
        _line(text, "")
        for text in (*(section.remarks if first else []), *section.facts)
    ]
    unnamed = [table for table in section.tables if not table.name]
    parts += [part for table in unnamed for part in _table(table)]
    if section.figure is not None and find_spec("matplotlib") is None:
        notes.insert(
            0,
            f"The figure {': '.join(missing('matplotlib'))}.",
        )
    elif section.figure is not None:
        drawn = b64encode(section.figure().content("svg")).decode()
        data = f"data:image/svg+xml;base64,{drawn}"
        parts.append(
            f'<figure><img alt="{escape(section.title)}" src="{data}"></figure>'
        )
    named = [table for table in section.tables if table.name]
    parts += [part for table in named for part in _table(table)]
    return [*parts, *(_line(text, "notes") for text in notes)]


def _table(table: Table) -> list[str]:
    kinds = {**dict.fromkeys(table.words, "left"), **dict.fromkeys(table.texts, "text")}
    css_classes = [
        f' class="{kinds[j]}"' if j in kinds else "" for j in range(len(table.header))
    ]

    def row(kind: str, cells: Sequence[str]) -> str:
        shown = zip(cells, css_classes, strict=True)
        tags = (
            f"<{kind}{css_class}>{escape(cell)}</{kind}>" for cell, css_class in shown
        )
        return f"<tr>{''.join(tags)}</tr>"

    bodies = [f"<thead>{row('th', table.header)}</thead>"] * any(table.header)
    bodies += [
        f"<tbody>{''.join(row('td', cells) for cells in group)}</tbody>"
        for group in table.groups
    ]
    grid = f'<div class="wide"><table>{"".join(bodies)}</table></div>'
    if table.name:
        opened = " open" if len(table.rows) <= MAX_OPEN else ""
        grid = (
            f"<details{opened}><summary>{escape(table.name)}</summary>{grid}</details>"
        )
    return [grid, *(_line(text, "notes") for text in table.notes)]


def _line(text: str, css_class: str) -> str:
    return f'<p class="{css_class}">{escape(text)}</p>'
