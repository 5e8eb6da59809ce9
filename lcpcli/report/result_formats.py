"""What is reported, in each of the formats: any report, and results, one or many."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.errors import visible
from lcpcli.report.document import Document, typeset
from lcpcli.report.wording import ELLIPSIS

if TYPE_CHECKING:
    from lcpcli.files.contents import Source
    from lcpcli.solving.result import Result


FORMS = ("table", "json", "csv")  # the formats in which each of many problems has a part of its own
BAD_INPUT = "bad_input"  # the status of a problem that could not be read
# Of the row of one of many problems: the columns for its name, at most half a line, and at least where it is cut; for
# the item in a file within it; for all but the name and what it is solved by, with n and k or without them.
WIDEST_NAME, FEWEST_OF_NAME, ITEM, WITH_SIZES, WITHOUT_SIZES = 40, 16, len(":1000"), 51, 36


class Layout(NamedTuple):
    """The columns of a table of many problems.

    name : the width of the names. has_sizes : whether n and k are shown. room : what is left for the methods, None for
    no limit; then no name is cut off.
    """

    name: int = 0
    has_sizes: bool = True
    room: int | None = None

    @classmethod
    def of(cls, files: Sequence[str], width: int | None) -> Layout:
        """Return the layout for problems from these files on a terminal of this width, None for no terminal."""
        longest = min(max(len(visible(file)) for file in files) + ITEM, WIDEST_NAME)
        if width is None:
            return cls(longest)
        has_sizes = width - WITH_SIZES >= min(longest, FEWEST_OF_NAME)
        left = width - (WITH_SIZES if has_sizes else WITHOUT_SIZES)
        name = max(min(longest, left), FEWEST_OF_NAME)
        return cls(name, has_sizes, left - name - 2)

    def row(self, name: str, n: str, status: str, k: str, residual: str, time: str, by: Sequence[str]) -> str:
        """Return the row of a problem. by : the methods and the objective; the last ones that fit are shown."""
        name = visible(name)
        if self.room is not None:
            name = name if len(name) <= self.name else ELLIPSIS + name[len(ELLIPSIS) - self.name :]
            while by and len(", ".join(by)) > self.room:
                by = by[1:]
        sizes = [[f"{n:>6}"], [f"{k:>5}"]] if self.has_sizes else [[], []]
        cells = [f"{name:{self.name}}", *sizes[0], f"{status:15}", *sizes[1], f"{residual:>8}", f"{time:>7}"]
        return "  ".join([*cells, visible(", ".join(by))]).rstrip() + "\n"


class Report(NamedTuple):
    """What a command reports, of which each format shows a part: JSON the records, CSV the rows, the others a document.

    document : returns the document for a format and the width of a terminal, None if there is none.
    records : returns objects of plain values. rows : returns rows of cells, and lines of comments above them; None if
    CSV has the keys and values of the records.
    """

    document: Callable[[str, int | None], Document]
    records: Callable[[], Iterable[Mapping[str, Any]]]
    rows: Callable[[], tuple[Iterable[Sequence[Any]], Iterable[str]]] | None = None

    def render(self, form: str, width: int | None = None, color: bool = False) -> str:
        """Return the report as text in a format. width, color : as for `typeset`."""
        if form == "json":
            from lcpcli.report import json_lines

            return "".join(map(json_lines.line, self.records()))
        if form == "csv":
            from lcpcli.report import result_csv

            return result_csv.records_text(self.records()) if self.rows is None else result_csv.written(*self.rows())
        return typeset(self.document(form, width), form, width, color)


def report(
    runs: Sequence[Sequence[Result]],
    sources: Sequence[Source],
    faults: Sequence[tuple[Source, Exception]] = (),
    *,
    compared: bool = True,
    swept: bool = False,
    whole: bool = False,
    iterates: bool = False,
    columns: Sequence[str] = (),
    names: Sequence[str] = (),
) -> Report:
    """Return the report on results.

    runs : the results, grouped by problem. sources : the place of each problem.
    faults : the places of problems that could not be read, with their errors, which JSON has too.
    compared : whether the iterates come first and then one line per result; else the result comes first.
    swept : whether the runs differ by values of options, so that CSV has a row for each.
    whole : whether a result that comes first shows all components of z.
    iterates : whether CSV is made of the iterates instead of the answers.
    columns : the columns of the iterates in a table, as for `tables.build`. names : of the unknowns that are shown, as
    for `selection.places`.
    """

    def document(form: str, width: int | None) -> Document:
        from lcpcli.report import tables

        sections = [tables.build(run, width, compared, whole, form, columns, names) for run in runs]
        return tables.document(runs, sections)

    def records() -> Iterable[Mapping[str, Any]]:
        from lcpcli.report import json_lines

        yield from (json_lines.data(each, place) for own, place in zip(runs, sources, strict=True) for each in own)
        yield from (json_lines.without_result(place, BAD_INPUT, str(fault)) for place, fault in faults)

    def rows() -> tuple[Iterable[Sequence[Any]], Iterable[str]]:
        from lcpcli.report import result_csv

        results = list(chain.from_iterable(runs))
        if iterates:
            return result_csv.iterates(results, columns, names)
        return result_csv.runs(results) if swept else result_csv.answers(results, compared, names)

    return Report(document, records, rows)


def heading(form: str, layout: Layout) -> str:
    """Return the heading before the first of many problems."""
    if form == "table":
        return layout.row("problem", "n", "status", "k", "residual", "time", ["by"])
    if form == "json":
        return ""
    from lcpcli.report import result_csv

    return result_csv.written([["problem", *result_csv.COLUMNS, result_csv.STATE, "name"]])


def of_result(result: Result, source: Source, form: str, layout: Layout) -> str:
    """Return the text of a problem, read from this source, that has a result."""
    if form == "json":
        from lcpcli.report import json_lines

        return json_lines.line(json_lines.data(result, source))
    if form == "csv":
        from lcpcli.report import result_csv

        return result_csv.part(result, str(source))
    from lcpcli.report import wording

    n, k, seconds = str(result.problem.n), str(result.iterations), wording.duration(result.seconds)
    status, by = result.word.replace("_", " "), [*result.route, *wording.objective(result)]
    return layout.row(str(source), n, status, k, wording.residual(result), seconds, by)


def without_result(source: Source, status: str, message: str, form: str, layout: Layout) -> str:
    """Return the text of a problem that could not be read, or whose result was lost."""
    if form == "json":
        from lcpcli.report import json_lines

        return json_lines.line(json_lines.without_result(source, status, message))
    if form == "csv":
        from lcpcli.report import result_csv

        return result_csv.written([], [message])
    return layout.row(str(source), "", status.replace("_", " "), "", "", "", [])
