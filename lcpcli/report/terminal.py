"""Tables and pages of help as text: styled by rich on a terminal, plain in a pipe."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from io import StringIO

from rich.box import Box
from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from lcpcli.report.tables import LEFT, ResultTable
from lcpcli.report.wording import PIPE_WIDTH, folded

RULES = Box("    \n    \n -- \n    \n -- \n -- \n    \n    \n", ascii=True)  # rules of dashes between groups, no frame
UNLIMITED = 10_000  # columns where there is no limit, as rich needs a number: more than any table has
PAGE_WIDTH = 120  # columns of a pipe within which no name of a method is written down
REPEATED = 0.7  # of the width, for the columns that each part of a folded table repeats: others need room too
STYLES = {"solved": "green", "FALSE": "bold red"}  # legible on light and dark backgrounds
UNSOLVED = "red"
REMARK = "magenta"
# The styles of a page, in place of colours that need a dark background.
PAGE = {"markdown.code": "bold", "markdown.code_block": "none", "markdown.h1": "bold", "markdown.h2": "bold"}


def render(tables: Sequence[ResultTable], width: int | None, color: bool) -> str:
    """Return the tables as text for a terminal of this width; None for a pipe. Numbers are never truncated or
    broken."""
    out = StringIO()
    console = console_on(out, UNLIMITED, color)

    def show(lines: Sequence[str], style: str, width: int | None = width) -> None:
        parts = [part for line in lines for part in folded(line, width)]
        if parts:
            console.print(Text("\n".join(parts), style=style))

    for i, table in enumerate(tables):
        if i:
            console.print()
        show([table.title], "bold")
        if table.verdict:  # the result first
            show([table.verdict], f"bold {STYLES['solved'] if table.settled else UNSOLVED}")
            show(table.facts, "")
            show(table.remarks, REMARK)
            console.print()
        if table.groups:
            console.print(grid(table.header, _labelled(table, width), width, LEFT))
        if table.summary is not None:
            header, rows, best = table.summary
            if not color:
                header, rows = _starred(header, rows, best)
            console.print(grid(header, [rows], width, LEFT, best))
            if note := table.summary.note:
                show([f"{note}; * the shortest time" if best and not color else note], "")
        if not table.verdict:
            show(table.remarks, REMARK)
        show([table.provenance], "", width or PIPE_WIDTH)
    return trim(out)


def listing(header: Sequence[str], rows: Sequence[Sequence[str]], width: int | None, color: bool) -> str:
    """Return a list of words in columns, wrapped to this width, 80 for a pipe; the first column is never wrapped.

    header : may be empty.
    """
    out = StringIO()
    table = _ruled(1)
    table.show_header = bool(header)
    for i, name in enumerate(header or rows[0]):
        table.add_column(name, no_wrap=i == 0, overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    console_on(out, width or PIPE_WIDTH, color).print(table)
    return trim(out)


def page(text: str, width: int, color: bool) -> str:
    """Return a page of help, written in Markdown, as text of this width."""
    from rich.markdown import Markdown
    from rich.theme import Theme

    out = StringIO()
    console = console_on(out, width, color)
    console.push_theme(Theme(PAGE))
    console.print(Markdown(text, code_theme="ansi_light", hyperlinks=False))
    return re.sub(r"\n{3,}", "\n\n", trim(out))


def console_on(out: StringIO, width: int, color: bool) -> Console:
    """Return a console of this width that writes to `out`."""
    return Console(
        file=out,
        width=width,
        force_terminal=color,
        color_system="standard" if color else None,
        no_color=not color,
        legacy_windows=False,
        highlight=False,
        markup=False,
        emoji=False,
    )


def trim(out: StringIO) -> str:
    """Return the text in `out`, without trailing blanks."""
    return "".join(line.rstrip() + "\n" for line in out.getvalue().splitlines())


def _labelled(table: ResultTable, width: int | None) -> list[list[list[str]]]:
    """Return the groups, with the names of the methods written downwards if the table is too wide."""
    rows = [table.header, *(row for group in table.groups for row in group)]
    widest = sum(max(map(len, cells)) + 1 for cells in zip(*rows, strict=True))
    return [_label_down(group) for group in table.groups] if widest > (width or PAGE_WIDTH) else table.groups


def _starred(
    header: list[str], rows: list[list[str]], best: Collection[tuple[int, int]]
) -> tuple[list[str], list[list[str]]]:
    """Return the cells with a star after the best ones, where there is no bold type, and a blank after the others of
    their columns."""
    marked = {j for _, j in best}
    blank = [" " if j in marked else "" for j in range(len(header))]
    starred = [
        [cell + ("*" if (i, j) in best else blank[j]) for j, cell in enumerate(row)] for i, row in enumerate(rows)
    ]
    return list(map(str.__add__, header, blank)), starred


def _label_down(group: list[list[str]]) -> list[list[str]]:
    """Return the group with its method's name down the first column, one word per row as in the paper, if it fits."""
    name, _, options = (group[0][0] if group else "").partition(":")
    words = [*name.replace("-", "- ").split(), *options.replace(",", " ").split()]
    if len(words) > len(group) or any(row[0] for row in group[1:]):
        return group
    return [[word, *row[1:]] for word, row in zip(words + [""] * (len(group) - len(words)), group, strict=True)]


def _ruled(gap: int) -> Table:
    return Table(box=RULES, show_edge=False, pad_edge=False, padding=(0, gap, 0, 0), header_style="bold")


def grid(
    header: list[str],
    groups: Sequence[list[list[str]]],
    width: int | None,
    left: Collection[str],
    bold: Collection[tuple[int, int]] = (),
) -> Group:
    """Return a table with a rule between groups; a table that is too wide is folded, repeating its leading left
    columns.

    left : the names of the left-aligned columns.
    bold : rows and columns of the cells of the last group to be highlighted.
    """
    rows = [header, *(row for group in groups for row in group)]
    widest = [max(map(len, column)) for column in zip(*rows, strict=True)]
    room = width or UNLIMITED
    gap = 2 if sum(widest) + 2 * len(widest) <= (width or PIPE_WIDTH) else 1
    keys = next((j for j, name in enumerate(header) if name not in left or sum(widest[: j + 1]) > REPEATED * room), 0)
    tables = []
    for columns in _folds(widest, keys, gap, room):
        table = _ruled(gap - 1)
        for j in columns:
            table.add_column(header[j], justify="left" if header[j] in left else "right")
        for group in groups:
            marked = bold if group is groups[-1] else ()
            for i, row in enumerate(group):
                styles = (STYLES.get(row[j], "bold" if (i, j) in marked else "") for j in columns)
                cells = (Text(row[j], style=style) for j, style in zip(columns, styles, strict=True))
                table.add_row(*cells, end_section=row is group[-1])
        tables.append(table)
    return Group(*tables)


def _folds(widest: Sequence[int], keys: int, gap: int, width: int) -> list[list[int]]:
    """Return the columns of each part of a table folded to this width; every part has the first `keys` columns."""
    parts = [list(range(keys))]
    for j in range(keys, len(widest)):
        if len(parts[-1]) > keys and sum(widest[i] + gap for i in [*parts[-1], j]) - gap > width:
            parts.append(list(range(keys)))
        parts[-1].append(j)
    return parts
