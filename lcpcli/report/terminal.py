"""Tables for people: rich on a terminal, the same as plain text into a pipe."""

from __future__ import annotations

from collections.abc import Sequence
from io import StringIO

from rich.box import Box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from lcpcli.report.iterations import IterationTable

RULES = Box("    \n    \n -- \n    \n -- \n -- \n    \n    \n", ascii=True)  # rules of dashes between groups, no frame
LEFT = ("method", "status")
UNLIMITED = 10_000
PIPE = 80
COLORS = {"solved": "green"}


def render(tables: Sequence[IterationTable], width: int | None, color: bool) -> str:
    """The tables as text for a terminal of that width; None stands for a pipe. No number is ever cut or broken."""
    out = StringIO()
    console = _console(out, UNLIMITED, color)
    for i, table in enumerate(tables):
        if i:
            console.print()
        console.print(Text(table.title, style="bold"))
        console.print(_grid([table.header], [_label_down(group) for group in table.groups], width))
        console.print(_grid([table.summary_header], [table.summary], width))
        for remark in table.remarks:
            console.print(Text(remark, style="yellow"))
    return _without_trailing_blanks(out)


def listing(header: Sequence[str], rows: Sequence[Sequence[str]], width: int | None, color: bool) -> str:
    """A list of words in columns, folded to that width, 80 for a pipe; the first column is never folded."""
    out = StringIO()
    grid = Table(box=RULES, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    for i, name in enumerate(header):
        grid.add_column(name, no_wrap=i == 0)
    for row in rows:
        grid.add_row(*map(Text, row))
    _console(out, width or PIPE, color).print(grid)
    return _without_trailing_blanks(out)


def _console(out: StringIO, width: int, color: bool) -> Console:
    return Console(
        file=out,
        width=width,
        force_terminal=color,
        color_system="standard" if color else None,
        no_color=not color,
        legacy_windows=False,
        highlight=False,
        emoji=False,
    )


def _without_trailing_blanks(out: StringIO) -> str:
    return "".join(line.rstrip() + "\n" for line in out.getvalue().splitlines())


def _label_down(group: list[list[str]]) -> list[list[str]]:
    """The group with its method's name down the first column, a word a row as in the paper, if it has the rows."""
    words = group[0][0].replace("-", "- ").split() if group else []
    if len(words) > len(group) or any(row[0] for row in group[1:]):
        return group
    return [[word, *row[1:]] for word, row in zip(words + [""] * (len(group) - len(words)), group, strict=True)]


def _grid(header: Sequence[list[str]], groups: Sequence[list[list[str]]], width: int | None) -> Table:
    rows = [*header, *(row for group in groups for row in group)]
    widest = [max(map(len, column)) for column in zip(*rows, strict=True)]
    gap = 2 if sum(widest) + 2 * len(widest) <= (width or PIPE) else 1
    grid = Table(box=RULES, show_edge=False, pad_edge=False, padding=(0, gap - 1, 0, 0), header_style="bold")
    for name in header[0]:
        grid.add_column(name, justify="left" if name in LEFT else "right")
    for group in groups:
        for row in group:
            grid.add_row(*(Text(cell, style=COLORS.get(cell, "")) for cell in row), end_section=row is group[-1])
    return grid
