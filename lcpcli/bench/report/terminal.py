"""A bench as text: styled by rich on a terminal, plain in a pipe."""

from __future__ import annotations

import textwrap
from io import StringIO

from rich.text import Text

from lcpcli.bench.report.sheet import LEFT
from lcpcli.bench.report.sheets import Report
from lcpcli.report.terminal import UNLIMITED, console_on, grid, trimmed


def render(report: Report, width: int, color: bool) -> str:
    """The report as text of that width. Numbers are never truncated or broken."""
    out = StringIO()
    console = console_on(out, UNLIMITED, color)
    for line in _wrapped(report.title, width):
        console.print(Text(line, style="bold"))
    for text in report.lines:
        for line in _wrapped(text, width):
            console.print(Text(line))
    for sheet in report.sheets:
        console.print()
        for line in _wrapped(sheet.title, width):
            console.print(Text(line, style="bold"))
        console.print(grid(sheet.header, sheet.groups, width, LEFT))
        for note in sheet.notes:
            for line in _wrapped(note, width):
                console.print(Text(line, style="dim"))
    return trimmed(out)


def _wrapped(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False)
