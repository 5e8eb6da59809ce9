"""Problems in CSV: n rows of n + 1 columns [M | q], or one file with the rows of M and another with q.

Bounds of z are two more columns, headed lower and upper next to one headed q, in which an empty cell is no bound.

Columns are separated by semicolons, tabs, commas or blanks: the first of these that the first row contains. A header
of names, blank lines, lines that begin with # and a byte order mark are skipped; any line endings are accepted. A
header whose first name is empty, as pandas writes it, marks the first column as an index, which is skipped too; so
does one whose first name is followed by names alone below it, or, in a problem, by 0, 1, 2, ... or 1, 2, 3, ... in a
column too many. The decimal mark is a point or, where commas do not separate the columns, a comma.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ProblemError, count, quoted
from lcpcli.files import csv_cells
from lcpcli.files.content import decode
from lcpcli.files.csv_cells import NUMERIC, is_number
from lcpcli.files.formats import NEAREST
from lcpcli.files.keys import BOUNDS, OTHER_NAMES
from lcpcli.linalg import matrices
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import decimal
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.files.formats import Exact, Number
    from lcpcli.rational.problem import ExactParts

DELIMITERS = (";", "\t", ",")
SPREADSHEET_ERROR = re.compile(r"\s*#[A-Z][A-Z0-9/]*[!?]?\s*([;,\t]|$)")  # such as #N/A, #REF!, #DIV/0!
SHAPE = "give n rows of n + 1 columns (M and q) or of n columns (M alone)"
UNNAMED = "; is the first column an index? leave the first cell of the header empty"
HEADED = "name q, lower and upper in a header, if the last columns are these"


def parse(content: bytes, number: Number = float) -> Problem | Matrix:
    """The problem in a text of n rows of n + 1 columns, or M in one of n rows of n columns; number makes doubles."""
    rows, places, header, _ = _table(decode(content), number)
    if _is_counted(rows, places, header):
        rows, places = [row[1:] for row in rows], {name: i - 1 for name, i in places.items()}
    if places:
        return _mixed(rows, places)
    table = np.array(rows)
    n, columns = table.shape
    if columns == n:
        return table
    if columns != n + 1:
        raise ProblemError(
            "",
            f"has {count(n, 'row')} of {count(columns, 'column')}",
            _numbering(table)
            or (f"{SHAPE}, or {HEADED}" if columns in (n + 2, n + 3) else SHAPE)
            + UNNAMED * (columns == n + 2 and bool(header)),
        )
    return Problem(np.ascontiguousarray(table[:, :n]), np.ascontiguousarray(table[:, n]))


def _mixed(rows: list[list[Any]], places: dict[str, int]) -> Problem:
    """The problem in a table with columns for bounds."""
    parts: dict[str, Any] = {name: [row[i] for row in rows] for name, i in places.items()}
    M = [[value for i, value in enumerate(row) if i not in places.values()] for row in rows]
    if len(M[0]) != len(M):
        wanted = f"give M as many columns, beside {' and '.join(places)}"
        raise ProblemError("", f"has {count(len(M), 'row')} and {count(len(M[0]), 'column')} of M", wanted)
    return Problem(M, **parts)


def parse_vector(field: str, content: bytes, n: int | None = None, number: Number = float) -> Vector:
    """A vector from a text of one row or one column."""
    rows = _rows(decode(content), number)
    if len(rows) > 1 and len(rows[0]) > 1:
        shape = f"has {len(rows)} rows and {len(rows[0])} columns"
        raise ProblemError(field, shape, _numbering(np.array(rows)) or "give one row or one column")
    return as_vector(field, [x for row in rows for x in row], n)


def parse_columns(content: bytes) -> tuple[list[list[float]], list[str]]:
    """The rows of a table of numbers, and the names that its header gives the columns, if it has one."""
    rows, _, header, _ = _table(decode(content))
    return rows, header


def parse_payoffs(content: bytes) -> tuple[list[list[str]], list[str], list[str]]:
    """The rows of a table of numbers as they are written, fractions among them, its index and its header, if any."""
    rows, _, header, index = _table(decode(content), str)
    return rows, index, header


def parse_bound(field: str, content: bytes, number_of: Callable[[str], Any]) -> list[Any]:
    """The bounds in a text of one row or one column, None where there is none."""
    rows, *_ = _table(decode(content), number_of, all_bounds=True)
    if len(rows) > 1 and len(rows[0]) > 1:
        raise ProblemError(field, f"has {len(rows)} rows and {len(rows[0])} columns", "give one row or one column")
    return [x for row in rows for x in row]


def parse_exact(content: bytes) -> ExactParts:
    """What a text that `parse` has accepted holds, with all decimals."""
    from lcpcli.rational.problem import exact_parts

    return exact_parts(lambda number: parse(content, number))


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:
    """A vector that `parse_vector` has accepted, with all decimals."""
    from lcpcli.rational.numbers import exact_vector

    return exact_vector(lambda number: parse_vector(field, content, None, number))


def render(problem: Problem, exact: Exact = NEAREST) -> dict[str, bytes]:
    """[M | q], one row per line, with all digits; with bounds [M | q | lower | upper] below a header."""
    M = matrices.dense(problem.M)
    text = partial(_text, exact)
    rows = [list(map(text, row)) for row in np.column_stack((M, problem.q)).tolist()]
    if problem.is_mixed:
        bounds = zip(problem.box.lower.tolist(), problem.box.upper.tolist(), strict=True)
        rows = [[*row, *map(text, pair)] for row, pair in zip(rows, bounds, strict=True)]
        rows.insert(0, [*(f"M{i}" for i in range(1, problem.n + 1)), "q", *BOUNDS])
    return {"": "".join(f"{','.join(row)}\n" for row in rows).encode()}


def _text(exact: Exact, x: float) -> str:
    return decimal(exact[x]) if x in exact else "" if math.isinf(x) else repr(x)


def is_comment(line: str) -> bool:
    """Whether a line begins with #, but not with an error that a spreadsheet has left in its first cell."""
    return line.lstrip().startswith("#") and not SPREADSHEET_ERROR.match(line)


def _rows(text: str, number_of: Callable[[str], Any] = float) -> list[list[Any]]:
    """The numbers of a text without bounds."""
    rows, places, *_ = _table(text, number_of)
    if places:
        raise ProblemError("", f"has columns headed {', '.join(places)}", "give one row or one column of numbers")
    return rows


def _lines(text: str) -> list[tuple[int, str]]:
    """The lines that are not blank and no comments, with their numbers."""
    all_lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return [(number, line) for number, line in enumerate(all_lines, 1) if line.strip() and not is_comment(line)]


def _table(
    text: str, number_of: Callable[[str], Any] = float, all_bounds: bool = False
) -> tuple[list[list[Any]], dict[str, int], list[str], list[str]]:
    """The numbers of a text; if its header names bounds, the columns of q, lower and upper, from 0; the header and the
    index, empty if there are none. Absent bounds are None. With all_bounds, all numbers are bounds, and a header may
    name anything."""
    lines = _lines(text)
    if not lines:
        raise ProblemError("", "contains no numbers", "give one row per line")
    delimiter = next((mark for mark in DELIMITERS if mark in lines[0][1]), None)
    (top, first), *others = ((number, _fields(number, line, delimiter)) for number, line in lines)
    indexed = _heads_an_index(first, [row[0] for _, row in others])
    places: dict[str, int] = {}
    header: list[str] = []
    absent = all_bounds and any(map(csv_cells.is_absent, first))
    if indexed or not (absent or any(is_number(entry) or NUMERIC.match(entry) for entry in first)):
        places = {} if all_bounds else _places(top, first[indexed:])
        if not (places or all_bounds):
            _refuse_misplaced_q(top, first)
        header = [name.strip() for name in first[indexed:]]
        del lines[0]
    else:
        others.insert(0, (top, first))
    bounds = {places[name] + indexed + 1 for name in BOUNDS if name in places}
    commas = delimiter != "," and any("," in line for _, line in lines)
    rows = [
        [
            (csv_cells.bound if all_bounds or i in bounds else csv_cells.value)(entry, number, i, commas, number_of)
            for i, entry in enumerate(row, 1)
            if i > indexed
        ]
        for number, row in others
    ]
    for (number, _), row in zip(lines, rows, strict=True):
        if len(row) != len(rows[0]):
            raise ProblemError(
                f"line {number}",
                f"has {count(len(row), 'column')} where line {lines[0][0]} has {len(rows[0])}",
                "give every line the same number of columns",
            )
    if not rows:
        raise ProblemError("", "contains a header and no numbers", "give one row per line below it")
    return rows, places, header, [row[0].strip() for _, row in others] if indexed else []


def _places(line: int, header: list[str]) -> dict[str, int]:
    """The columns of q, lower and upper in a header that names a bound; else none."""
    names = [name.strip() for name in header]
    meant = [OTHER_NAMES.get(name.casefold(), name) for name in names[-3:]]
    for name, other in zip(names[-3:], meant, strict=True):
        if name not in BOUNDS and other in BOUNDS and "q" in names:
            place = f"line {line}, column {len(names) - 3 + names[-3:].index(name) + 1}"
            raise ProblemError(place, f"is headed {quoted(name)}", f"call it {other}, if it holds bounds of z")
    if not set(names) & set(BOUNDS):
        return {}
    for name in ("q", *BOUNDS):
        if names.count(name) > 1:
            raise ProblemError(f"line {line}", f"heads {names.count(name)} columns {name}", "keep one")
    if "q" not in names:
        raise ProblemError(f"line {line}", "heads columns of bounds, but none q", "name the column of q in it")
    return {name: names.index(name) for name in ("q", *BOUNDS) if name in names}


def _heads_an_index(header: list[str], below: list[str]) -> bool:
    """Whether the first line is a header whose first column is an index: it has no name, as pandas writes it, or one
    with names alone below it, and the others have names or are numbered from 0."""
    first, *others = (name.strip() for name in header)
    named = bool(below) and csv_cells.is_name(first) and all(map(csv_cells.is_name, below))
    return (
        (named or not first)
        and bool(others)
        and all(name == str(i) or csv_cells.NAME.match(name) for i, name in enumerate(others))
    )


def _is_counted(rows: list[list[Any]], places: dict[str, int], header: list[str]) -> bool:
    """Whether a table with a header and one column too many for a problem has a first one that only counts."""
    n, first = len(rows), [row[0] for row in rows]
    is_long = bool(header) and 0 not in places.values() and len(rows[0]) == n + (len(places) or 1) + 1
    return is_long and first in (list(range(n)), list(range(1, n + 1)))


def _numbering(table: Any) -> str:
    """The hint for a table whose first column or row only numbers the others, from 0; "" for any other."""
    rows, columns = table.shape
    if columns > 1 and np.array_equal(table[:, 0], np.arange(rows)):
        return "is the first column an index? save it with index=False"
    if rows > 1 and np.array_equal(table[0], np.arange(columns)):
        return "does the first row number the columns? save it with header=False"
    return ""


def _refuse_misplaced_q(line: int, header: list[str]) -> None:
    """A header is skipped, unless it puts q in a column other than the last."""
    names = [name.strip() for name in header]
    if "q" in names[:-1]:
        place = f"line {line}, column {names.index('q') + 1}"
        raise ProblemError(place, "is headed q, which must be the last column", "reorder the columns")


def _fields(number: int, line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        line, delimiter = " ".join(line.split()), " "
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))
    except csv.Error:
        most = csv.field_size_limit()
        long = f"it may have an entry of more than {most} characters"
        fault = long if len(line) > most else "its quotation marks do not match"
        raise ProblemError(f"line {number}", f"is not CSV ({fault})", "correct it there") from None
