"""Results as text: pure functions, one module per format. Nothing here prints or writes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.solving.result import Result


def render(
    runs: Sequence[Sequence[Result]],
    form: str,
    width: int | None,
    color: bool,
    *,
    compared: bool = True,
    whole: bool = False,
    iterates: bool = False,
) -> str:
    """The results as text in a format.

    runs : grouped by problem.
    width, color : of the terminal; width is None if there is none.
    compared : whether the iterates come first and then one line per result; else the result comes first.
    whole : whether a result that comes first shows all components of z.
    iterates : whether CSV is made of the iterates instead of the answers.
    """
    if form == "json":
        from lcpcli.report import json_lines

        return json_lines.render(list(chain.from_iterable(runs)))
    if form == "csv":
        from lcpcli.report import answer_csv, trace_csv

        results = list(chain.from_iterable(runs))
        return trace_csv.render(results) if iterates else answer_csv.render(results, compared)
    from lcpcli.report import iterations

    tables = [iterations.build(run, width, compared, whole) for run in runs]
    if form == "markdown":
        from lcpcli.report import markdown

        return markdown.render(tables)
    if form == "latex":
        from lcpcli.report import latex

        return latex.render(tables)
    from lcpcli.report import terminal

    return terminal.render(tables, width, color)
