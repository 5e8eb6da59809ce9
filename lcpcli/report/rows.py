"""Many problems, one after another: what is written of each as soon as it is known."""

from __future__ import annotations

from collections.abc import Sequence

from lcpcli.files.contents import Source
from lcpcli.report import answer_csv, json_lines, numbers, provenance, summary
from lcpcli.solving.result import Result

FORMS = ("table", "json", "csv")  # the formats in which each problem has a part of its own
WIDEST, ITEM = 40, len(":1000")  # columns of a table for the name of a problem, and of those for the item in a file


def width_of(files: Sequence[str]) -> int:
    """The columns for the names of problems from these files."""
    return min(max(map(len, files)) + ITEM, WIDEST)


def heading(form: str, width: int) -> str:
    """What comes before the first problem. width : of the names of problems."""
    if form == "table":
        return _row(width, "problem", "n", "status", "k", "residual", "time", "by")
    return answer_csv.text([["problem", *answer_csv.COLUMNS, answer_csv.STATE, "name"]]) if form == "csv" else ""


def of_result(result: Result, source: Source, form: str, width: int) -> str:
    """The part of a problem that was read there and has a result."""
    if form == "json":
        return json_lines.line(json_lines.data(result, source), source)
    if form == "csv":
        told = provenance.lines([result])[1:]
        return answer_csv.comments(told) + answer_csv.rows(
            result, [str(source)], mixed=True, ends=answer_csv.names(result.problem)
        )
    return _row(
        width,
        str(source),
        str(result.problem.n),
        _words(result.word),
        str(result.iterations),
        summary.residual(result),
        numbers.duration(result.seconds),
        ", ".join(result.route),
    )


def without_result(source: Source, status: str, message: str, form: str, width: int) -> str:
    """The part of a problem that could not be read, or whose result was lost."""
    if form == "json":
        return json_lines.line(json_lines.without_result(source, status, message), source)
    if form == "csv":
        return answer_csv.comments([" ".join(message.split())])
    return _row(width, str(source), "", _words(status), "", "", "", "")


def _words(status: str) -> str:
    return status.replace("_", " ")


def _row(width: int, name: str, n: str, status: str, iterations: str, residual: str, seconds: str, by: str) -> str:
    cells = f"{name:{width}}  {n:>6}  {status:15}  {iterations:>5}  {residual:>8}  {seconds:>7}  {by}"
    return f"{cells.rstrip()}\n"
