"""From results to text: pure functions, one format a module. Nothing here prints or writes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.result import Result

FORMATS = {
    "table": "for people",
    "json": "one object a line, for scripts",
    "csv": "every iterate with all digits",
    "markdown": "the table in Markdown",
    "latex": "the table in LaTeX with booktabs",
}
TABLES = ("table", "markdown", "latex")  # those that show a choice of iterates and of components
LEVELS = (1e-3, 1e-6, 1e-9)  # of the error, relative to the solution, of which a comparison tells the time
SUFFIXES = {"": "table", ".txt": "table", ".json": "json", ".csv": "csv", ".md": "markdown", ".tex": "latex"}


def render(
    results: Sequence[Result], form: str, width: int | None, color: bool, *, compared: bool = True, whole: bool = False
) -> str:
    """The results, those on one problem one after the other, as text in a format.

    width, color : of the terminal; width is None where there is none.
    compared : whether the iterates come first and then a line a result; else the result comes first.
    whole : whether a result that comes first shows all of its z.
    """
    if form == "json":
        from lcpcli.report import json_lines

        return json_lines.render(results)
    if form == "csv":
        from lcpcli.report import csv_rows

        return csv_rows.render(results)
    from lcpcli.report import iterations

    runs = [list(run) for _, run in groupby(results, key=lambda result: id(result.problem))]
    tables = [iterations.build(run, width, compared, whole) for run in runs]
    if form == "markdown":
        from lcpcli.report import markdown

        return markdown.render(tables)
    if form == "latex":
        from lcpcli.report import latex

        return latex.render(tables)
    from lcpcli.report import terminal

    return terminal.render(tables, width, color)
