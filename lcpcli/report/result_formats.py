"""What is reported, in each of the formats: any report, and results, one or many. In
JSON all keys are always present: null for missing and infinite values."""

from __future__ import annotations

import csv
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from io import StringIO
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

from lcpcli.errors import visible, visible_json
from lcpcli.files.contents import NO_SOURCE, Source
from lcpcli.files.formats import is_model
from lcpcli.methods.registry import declared
from lcpcli.model.formulation import Answer
from lcpcli.report import columns, wording
from lcpcli.report.columns import Selection
from lcpcli.report.document import Document, typeset
from lcpcli.version import VERSION

if TYPE_CHECKING:
    from lcpcli.errors import LCPError
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result

BAD_INPUT = "bad_input"  # the status of an input that cannot be used
LOST = "breakdown"  # the status of an input whose result was lost
# Widths, for one of many problems: of its name at most, half a line; of a name that is
# cut; of the item of a file in it; and of the rest of its row but for the method.
WIDEST_NAME, MIN_OF_NAME, ITEM, OTHERS = 40, 16, len(":1000"), 51


class ProblemRow(NamedTuple):
    """The cells of a problem in a table of many. by : the methods and the objective."""

    name: str
    n: str = ""
    status: str = ""
    residual: str = ""
    time: str = ""
    k: str = ""
    by: Sequence[str] = ()


HEADING = ProblemRow("problem", "n", "status", "residual", "time", "k", ["by"])


class Layout(NamedTuple):
    """The columns of a table of many problems. name : the width of the names. width :
    that of the rows, None for no limit; then no name is cut off."""

    name: int = 0
    width: int | None = None

    @classmethod
    def of(cls, files: Sequence[str], width: int | None) -> Layout:
        """Return the layout for problems from these files on a terminal of this width,
        None for no terminal."""
        longest = min(max(len(visible(file)) for file in files) + ITEM, WIDEST_NAME)
        return cls(
            longest
            if width is None
            else max(min(longest, width - OTHERS), MIN_OF_NAME),
            width,
        )

    def row(self, shown: ProblemRow) -> str:
        """Return the row of a problem as text, of which only the name is cut off; of
        `by` the last ones that fit are shown."""
        name = visible(shown.name)
        if self.width is not None and len(name) > self.name:
            name = wording.ELLIPSIS + name[len(wording.ELLIPSIS) - self.name :]
        cells = [
            f"{name:{self.name}}",
            f"{shown.n:>6}",
            f"{shown.status:15}",
            f"{shown.residual:>8}",
            f"{shown.time:>7}",
            f"{shown.k:>5}",
        ]
        names_shown = list(map(visible, shown.by))
        while len(row := "  ".join([*cells, ", ".join(names_shown)]).rstrip()) > (
            self.width or len(row)
        ):
            (names_shown or cells).pop(0 if names_shown else -1)
        return row + "\n"


class Report(NamedTuple):
    """What a command reports, of which each format shows a part: JSON the records, CSV
    the rows, the others a document.

    document : returns the document for a format and the width of a terminal, None if
        there is none.
    records : returns objects of plain values. rows : returns rows of cells, and lines
    of comments above them; None if CSV has the keys and values of the records. pipe :
    the width where there is no terminal; None for no limit.
    """

    document: Callable[[str, int | None], Document]
    records: Callable[[], Iterable[Mapping[str, Any]]]
    rows: Callable[[], tuple[Iterable[Sequence[Any]], Iterable[str]]] | None = None
    pipe: int | None = None

    def render(
        self, format_name: str = "table", width: int | None = None, color: bool = False
    ) -> str:
        """Return the report as text in a format. width, color : as for `typeset`."""
        if format_name == "json":
            return "".join(map(line, self.records()))
        if format_name == "csv":
            if self.rows is not None:
                return written(*self.rows())
            pairs = (
                (key, cell(value))
                for each in self.records()
                for key, value in each.items()
            )
            return written([("key", "value"), *pairs])
        return typeset(
            self.document(format_name, width), format_name, width or self.pipe, color
        )


def results_report(
    runs: Sequence[Sequence[Result]],
    sources: Sequence[Source],
    paths: Sequence[Sequence[str]],
    selection: Selection,
    faults: Sequence[tuple[Source, LCPError]] = (),
) -> Report:
    """Return the report on results.

    runs, sources : the results, grouped by problem, and the source of each problem.
    paths : the files of each problem, as advice names them.
    faults : the sources of problems that could not be read, with errors, for JSON.
    """

    def document(format_name: str, width: int | None) -> Document:
        from lcpcli.report import tables

        return tables.document(
            runs,
            [
                tables.build(run, selection, width, format_name, files)
                for run, files in zip(runs, paths, strict=True)
            ],
        )

    def records() -> Iterable[Mapping[str, Any]]:
        yield from (
            data(each, source)
            for results, source in zip(runs, sources, strict=True)
            for each in results
        )
        yield from (
            record_without_result(
                source, BAD_INPUT, str(error), field_in(error, source)
            )
            for source, error in faults
        )

    def rows() -> tuple[Iterable[Sequence[Any]], Iterable[str]]:
        """Return the rows of the CSV, with their header, and lines of comments above
        them."""
        from lcpcli.report import result_csv

        results = list(chain.from_iterable(runs))
        if selection.iterates:
            return result_csv.iterates(results, selection.columns, selection.names)
        if selection.swept:
            return result_csv.runs(results)
        return result_csv.answers(results, selection.compared, selection.names)

    return Report(document, records, rows)


def heading(format_name: str, layout: Layout) -> str:
    if format_name == "table":
        return layout.row(HEADING)
    return "" if format_name == "json" else "problem,component,z,w,state,name\n"


def of_result(result: Result, source: Source, format_name: str, layout: Layout) -> str:
    if format_name == "json":
        return line(data(result, source))
    if format_name == "csv":
        from lcpcli.report import result_csv

        return written(*result_csv.part(result, str(source)))
    shown = ProblemRow(
        name=str(source),
        n=str(result.problem.n),
        status=result.word.replace("_", " "),
        residual=wording.residual(result),
        time=wording.duration(result.seconds),
        k=str(result.iterations),
        by=[*result.route, *wording.headline(result)],
    )
    return layout.row(shown)


def without_result(
    source: Source,
    status: str,
    message: str,
    field: str | None,
    format_name: str,
    layout: Layout,
) -> str:
    """Return the text of a problem that could not be read, or whose result was lost."""
    if format_name == "json":
        return line(record_without_result(source, status, message, field))
    if format_name == "csv":
        return written([], [message])
    return layout.row(ProblemRow(str(source), status=status.replace("_", " ")))


def cell(value: Any) -> str | None:
    """Return a value for JSON as a cell: a text as it is, anything else in JSON."""
    return value if value is None or isinstance(value, str) else text(value)


def written(rows: Iterable[Sequence[Any]], comments: Iterable[str] = ()) -> str:
    """Return rows of cells as CSV below lines of comments; None becomes an empty
    cell."""
    out = _Lines()
    csv.writer(out, lineterminator=_Lines.END).writerows(rows)
    return "".join(f"# {visible(line)}\n" for line in comments) + out.getvalue()


class _Lines(StringIO):
    """Lines of CSV, each with a final line feed. The writer quotes cells with a
    character of its line terminator, so a terminator with # and \\r has it quote all
    cells that would begin a comment or lose a carriage return."""

    END = "#\r\n"

    def write(self, line: str) -> int:
        return super().write(line.removesuffix(self.END) + "\n")


# A schema for each record, whose properties are its keys, in their order.
SCHEMAS = os.path.join(os.path.dirname(__file__), os.pardir, "schemas")


@cache
def keys_of(name: str) -> dict[str, Any]:
    """Return the keys of a record of this name in their order, with their schemas."""
    with open(os.path.join(SCHEMAS, f"{name}.json"), encoding="utf-8") as file:
        properties: dict[str, Any] = json.load(file)["properties"]
    return properties


def as_list(lines: str) -> str:
    """Return lines of JSON as one JSON text: the object in the only one, or the list of
    several, one in each line."""
    objects = lines.removesuffix("\n").split("\n")
    return lines if len(objects) == 1 else "[\n" + ",\n".join(objects) + "\n]\n"


def line(record: Mapping[str, Any]) -> str:
    return text(record) + "\n"


ENCODER = json.JSONEncoder(allow_nan=False, ensure_ascii=False)


def text(value: Any) -> str:
    return visible_json(ENCODER.encode(value))


def record_without_result(
    source: Source, status: str, message: str, field: str | None
) -> dict[str, Any]:
    """Return the record of an input that cannot be used, or whose result was lost, with
    its mark in a log. field : what is wrong in the file, or on the command line."""
    return {
        **source_record(source),
        "field": field,
        "status": status,
        "message": message,
        "solved": False,
        **(source.mark or {}),
    }


def field_in(error: LCPError, source: Source) -> str | None:
    """Return where an error is within the file and the line; None if it says no
    more."""
    shown_apart = (error.file, f"line {source.item}", "")
    return ": ".join([part for part in error.parts if part not in shown_apart]) or None


def data(result: Result, source: Source = NO_SOURCE) -> dict[str, Any]:
    """Return a result as the object of its line, with the mark of its problem in a
    log."""
    problem = result.problem
    bound = result.bound
    exact = result.exact
    curve = result.curve
    trace = result.trace
    vectors = {name: getattr(exact, name, None) for name in ("z", "w", "y")}
    # The notes of other files are those of their authors.
    how_read = problem.note if is_model(source.file or "") else ""
    certificate = plain(result.certificate)
    if certificate:  # its vector in fractions, if floats are only close to the proof
        vector = certificate.pop("exact") or certificate["vector"]
        del certificate["is_certain_for_all"]
        head = {"kind": certificate.pop("kind"), "statement": certificate["statement"]}
        certificate = head | certificate | {"vector": vector}
    overrides = {
        **source_record(source, problem),
        "package": declared(result.method).package,
        "label": wording.name(result),
        "status": result.status.word,
        "message": "; ".join(filter(None, [result.message, how_read])),
        "advice": wording.advice(result) or None,
        "basis": result.basis if result.solved or problem.bounds else None,
        "error_bound": bound.value if bound else None,
        "error_bound_source": bound.source if bound and bound.proved else None,
        "reference": problem.reference if problem.solutions else None,
        "milestones": curve.milestones if curve and curve.levels else None,
        "certificate": certificate,
        "exact": exact
        and {
            "status": exact.status and exact.status.word,
            **vectors,
            "proof": exact.proof,
        },
        "answer": _answer(result),
        "conclusion_seconds": getattr(result.answer, "seconds", None),
        **vars(result.limits),
        "options": {
            name: value
            for name, value in result.options.items()
            if name not in wording.VECTORS
        },
        "trace": trace and columns.records(trace),
    }
    log_entry = dict(source.mark or {})
    if log_entry and result.interrupted:
        log_entry["interrupted"] = True
    return record(keys_of("result"), result, overrides) | log_entry


def record(
    keys: Iterable[str], thing: object, overrides: Mapping[str, Any], exact: bool = True
) -> dict[str, Any]:
    """Return the values of the keys, in their order, by `plain`: those in `overrides`,
    and the attributes of the object for other keys."""
    return {
        key: plain(overrides[key] if key in overrides else getattr(thing, key), exact)
        for key in keys
    }


def source_record(
    source: Source, problem: Problem | NonlinearProblem | None = None
) -> dict[str, Any]:
    values = {"version": VERSION, "file": source.file, "item": source.item}
    if problem is None:
        return values
    return values | {
        "problem": problem.name,
        "n": problem.n,
        "names": list(problem.names) if any(problem.names) else None,
    }


def plain(value: Any, exact: bool = True) -> Any:
    """Return a value for JSON: an object for a dataclass, None for a number that is not
    finite, and for a fraction a text, or unless `exact` a float, None if it is beyond
    double precision."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, (list, tuple)):
        kinds = {*map(type, value)}
        if (
            not exact
            and kinds
            and all(hasattr(kind, "limit_denominator") for kind in kinds)
        ):  # fractions, at once
            from lcpcli.rational.numbers import rounded

            return plain(rounded(value))
        return (
            list(value)
            if kinds <= {str, int}
            else [plain(entry, exact) for entry in value]
        )
    if isinstance(value, dict):
        return {key: plain(entry, exact) for key, entry in value.items()}
    if hasattr(value, "tolist"):
        is_finite = value.dtype == float and bool(
            abs(value).max(initial=0.0) < math.inf
        )
        return (
            value.tolist()
            if is_finite or value.dtype.kind in "bi"
            else plain(value.tolist(), exact)
        )
    if isinstance(value, Answer) and (answer_record := value.record()) is not None:
        return plain(answer_record, exact)
    if is_dataclass(value):
        return {
            field.name: plain(getattr(value, field.name), exact)
            for field in fields(value)
            if field.repr
        }
    from lcpcli.rational.numbers import text

    return text(value) if exact else plain([value], exact)[0]


def _answer(result: Result) -> dict[str, Any] | None:
    answer = result.answer
    if answer is None or result.problem.origin is None:
        return None
    origin = result.problem.origin.data()
    values = plain(answer)
    return {
        "kind": origin["kind"],
        **values,
        "rows": origin.get("rows"),
        "columns": origin.get("columns"),
    }
