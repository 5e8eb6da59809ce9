"""Reports and pages of help as text: styled by rich on a terminal, plain in a pipe."""

from __future__ import annotations

import re
from collections.abc import Sequence
from io import StringIO
from typing import Literal

from rich.box import Box
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text
from rich.theme import Theme

from lcpcli.report.document import Document, Table
from lcpcli.report.wording import PIPE_WIDTH, folded

# Rules of dashes between groups, no frame.
RULES = Box("    \n    \n -- \n    \n -- \n -- \n    \n    \n", ascii=True)
# Columns where there is no limit, as rich needs a number: more than any table has.
UNLIMITED = 10_000
PAGE_WIDTH = 120  # columns of a pipe within which no name of a method is written down
MIN_OF_TEXT = 8  # characters of a column of sentences, however wide the others are
# The largest share of the width for the columns that each part of a folded table
# repeats; the others need the remaining width.
REPEATED = 0.7
# These styles are legible on light and dark backgrounds.
STYLES = {"solved": "green", "FALSE": "bold red"}
REMARK = "magenta"
# The styles of a page, instead of colours that need a dark background.
PAGE = {
    "markdown.code": "bold",
    "markdown.code_block": "none",
    "markdown.h1": "bold",
    "markdown.h2": "bold",
}


def render(document: Document, width: int | None, color: bool) -> str:
    """Return a report as text for a terminal of this width; None for a pipe. Numbers
    are never truncated or broken."""
    out = StringIO()
    console = console_on(out, UNLIMITED, color)

    def show(lines: Sequence[str], style: str = "", width: int | None = width) -> None:
        parts = [part for line in lines for part in folded(line, width)]
        if parts:
            console.print(Text("\n".join(parts), style=style))

    for i, section in enumerate(document.sections):
        if i:
            console.print()
        show([section.title], "bold")
        verdict_style = f"bold {STYLES['solved'] if section.is_as_requested else 'red'}"
        show([section.verdict] * bool(section.verdict), verdict_style)
        show(section.facts)
        if section.verdict:  # the result first
            show(section.remarks, REMARK)
        for j, table in enumerate(section.tables):
            if section.verdict or (table.texts and (j or section.facts)):
                console.print()
            _print(console, table, width)
            show(table.notes, "", width or PIPE_WIDTH)
        if not section.verdict:
            show(section.remarks, REMARK)
        show([section.provenance] * bool(section.provenance), "", width or PIPE_WIDTH)
    return trim(out)


def page(text: str, width: int, color: bool) -> str:
    """Return a page of help, written in Markdown, as text of this width."""
    from rich.markdown import Markdown

    out = StringIO()
    console = console_on(out, width, color)
    console.push_theme(Theme(PAGE))
    console.print(Markdown(text, code_theme="ansi_light", hyperlinks=False))
    return re.sub(r"\n{3,}", "\n\n", trim(out))


def console_on(out: StringIO, width: int, color: bool) -> Console:
    """Return a console of this width that writes to `out`; no number in the environment
    changes its size."""
    return Console(
        file=out,
        width=width,
        height=UNLIMITED,
        force_terminal=color,
        color_system="standard" if color else None,
        no_color=not color,
        legacy_windows=False,
        highlight=False,
        markup=False,
        emoji=False,
    )


def trim(out: StringIO) -> str:
    """Return the text in `out` without trailing blanks."""
    return "".join(line.rstrip() + "\n" for line in out.getvalue().splitlines())


def _label_down(group: Sequence[Sequence[str]]) -> Sequence[Sequence[str]]:
    """Return the group with its label down the first column, one word per row as in the
    paper, if it fits."""
    name, _, options = group[0][0].partition(":")
    words = [*name.replace("-", "- ").split(), *options.replace(",", " ").split()]
    if len(words) > len(group) or any(row[0] for row in group[1:]):
        return group
    return [
        [word, *row[1:]]
        for word, row in zip(
            words + [""] * (len(group) - len(words)), group, strict=True
        )
    ]


def _print(console: Console, table: Table, width: int | None) -> None:
    """Print a table with a rule between groups: its sentences wrapped if it has any,
    else in parts that repeat its leading columns of words if it is too wide."""
    widths, available_width = table.widths(), width or UNLIMITED
    if table.texts:
        min_width = sum(
            MIN_OF_TEXT if j in table.texts else widest + 1
            for j, widest in enumerate(widths)
        )
        console.print(
            _grid(table, range(len(widths)), 1),
            width=max(width or PIPE_WIDTH, min_width),
        )
        return
    if table.name and sum(widths) + len(widths) > (width or PAGE_WIDTH):
        table = table._replace(groups=list(map(_label_down, table.groups)))
        widths = table.widths()
    gap = 2 if sum(widths) + 2 * len(widths) <= (width or PIPE_WIDTH) else 1
    keys = 0
    while keys in table.words and sum(widths[: keys + 1]) <= REPEATED * available_width:
        keys += 1
    for columns in _folds(widths, keys, gap, available_width):
        console.print(_grid(table, columns, gap - 1))


def _grid(table: Table, columns: Sequence[int], gap: int) -> Grid:
    grid = Grid(
        box=RULES,
        show_edge=False,
        pad_edge=False,
        padding=(0, gap, 0, 0),
        header_style="bold",
    )
    grid.show_header = any(table.header)
    for j in columns:
        is_whole = bool(table.texts) and j not in table.texts
        justify: Literal["left", "right"] = "left" if j in table.words else "right"
        grid.add_column(
            table.header[j], justify=justify, no_wrap=is_whole, overflow="fold"
        )
    for group in table.groups:
        for row in group:
            grid.add_row(
                *(Text(row[j], STYLES.get(row[j], "")) for j in columns),
                end_section=row is group[-1],
            )
    return grid


def _folds(widest: Sequence[int], keys: int, gap: int, width: int) -> list[list[int]]:
    """Return the columns of each part of a table folded to this width; every part has
    the first `keys` columns."""
    parts = [list(range(keys))]
    for j in range(keys, len(widest)):
        if (
            len(parts[-1]) > keys
            and sum(widest[i] + gap for i in [*parts[-1], j]) - gap > width
        ):
            parts.append(list(range(keys)))
        parts[-1].append(j)
    return parts
