"""Results as text: pure functions, one module per format. Nothing here prints or writes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lcpcli.files.contents import Source
    from lcpcli.report.result_table import ResultTable
    from lcpcli.solving.result import Result


BAD_INPUT = "bad_input"  # the status of a problem that could not be read


def unread(faults: Sequence[tuple[Source, Exception]]) -> str:
    """Problems that could not be read, with what is wrong, as JSON."""
    from lcpcli.report.json_lines import line, without_result

    return "".join(line(without_result(source, BAD_INPUT, str(fault))) for source, fault in faults)


def render(
    runs: Sequence[Sequence[Result]],
    sources: Sequence[Source],
    form: str,
    width: int | None,
    color: bool,
    *,
    compared: bool = True,
    whole: bool = False,
    iterates: bool = False,
) -> str:
    """The results as text in a format.

    runs : grouped by problem. sources : where each problem was read.
    width, color : of the terminal; width is None if there is none.
    compared : whether the iterates come first and then one line per result; else the result comes first.
    whole : whether a result that comes first shows all components of z.
    iterates : whether CSV is made of the iterates instead of the answers.
    """
    if form == "json":
        from lcpcli.report import json_lines

        return "".join(json_lines.render(own, source) for own, source in zip(runs, sources, strict=True))
    if form == "csv":
        from lcpcli.report import answer_csv, trace_csv

        results = list(chain.from_iterable(runs))
        return trace_csv.render(results) if iterates else answer_csv.render(results, compared)
    from lcpcli.report import iterations

    return typeset([iterations.build(run, width, compared, whole, form) for run in runs], form, width, color)


def typeset(tables: Sequence[ResultTable], form: str, width: int | None, color: bool) -> str:
    """Tables as text in a format."""
    if form == "markdown":
        from lcpcli.report import markdown

        return markdown.render(tables)
    if form == "latex":
        from lcpcli.report import latex

        return latex.render(tables)
    from lcpcli.report import terminal

    return terminal.render(tables, width, color)
