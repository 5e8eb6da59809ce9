"""Problems in CSV: n rows of n + 1 columns [M | q], or one file with the rows of M and another with q.

Columns are separated by semicolons, tabs, commas or blanks: the first of these that the first row contains. A header
of names, blank lines, lines that begin with # and a byte order mark are skipped; any line endings are accepted. A
header whose first name is empty, as pandas writes it, marks the first column as an index, which is skipped too. The
decimal mark is a point or, where commas do not separate the columns, a comma.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ProblemError, count, misread, quoted
from lcpcli.files.content import decode
from lcpcli.linalg import matrices
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.rational.problem import Rows

DELIMITERS = (";", "\t", ",")
NUMERIC = re.compile(r"\s*[-+]?\.?\d")  # begins like a number, so it is not a name in a header
SPREADSHEET_ERROR = re.compile(r"\s*#[A-Z][A-Z0-9/]*[!?]?\s*([;,\t]|$)")  # such as #N/A, #REF!, #DIV/0!
NAME = re.compile(r"[^\W\d]")  # begins like a name


def parse(content: bytes) -> Problem | Matrix:
    """The problem in a text of n rows of n + 1 columns, or M in one of n rows of n columns."""
    table = np.array(_rows(decode(content)))
    n, columns = table.shape
    if columns == n:
        return table
    if columns != n + 1:
        raise ProblemError(
            "",
            f"has {count(n, 'row')} of {count(columns, 'column')}",
            _numbering(table) or "give n rows of n + 1 columns (M and q) or of n columns (M alone)",
        )
    return Problem(np.ascontiguousarray(table[:, :n]), np.ascontiguousarray(table[:, n]))


def parse_vector(field: str, content: bytes, n: int | None = None) -> Vector:
    """A vector of length n, any length if None, from a text of one row or one column."""
    rows = _rows(decode(content))
    if len(rows) > 1 and len(rows[0]) > 1:
        shape = f"has {len(rows)} rows and {len(rows[0])} columns"
        raise ProblemError(field, shape, _numbering(np.array(rows)) or "give one row or one column")
    return as_vector(field, [x for row in rows for x in row], n)


def parse_exact(content: bytes) -> tuple[Rows, list[Fraction] | None]:
    """M and, if there is a last column for it, q of a text that `parse` has accepted, with all decimals."""
    from lcpcli.rational.numbers import fraction

    table = _rows(decode(content), fraction)
    n = len(table)
    M = [{j: value for j, value in enumerate(row[:n]) if value} for row in table]
    return M, [row[n] for row in table] if len(table[0]) > n else None


def parse_exact_vector(field: str, content: bytes) -> list[Fraction]:  # noqa: ARG001 (as in every format)
    """A vector that `parse_vector` has accepted, with all decimals."""
    from lcpcli.rational.numbers import fraction

    return [value for row in _rows(decode(content), fraction) for value in row]


def render(problem: Problem) -> dict[str, bytes]:
    """[M | q], one row per line, with all digits."""
    M = matrices.dense(problem.M)
    rows = np.column_stack((M, problem.q)).tolist()
    return {"": "".join(",".join(map(repr, row)) + "\n" for row in rows).encode()}


def is_comment(line: str) -> bool:
    """Whether a line begins with #, but not with an error that a spreadsheet has left in its first cell."""
    return line.lstrip().startswith("#") and not SPREADSHEET_ERROR.match(line)


def _rows(text: str, number_of: Callable[[str], Any] = float) -> list[list[Any]]:
    all_lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    lines = [(number, line) for number, line in enumerate(all_lines, 1) if line.strip() and not is_comment(line)]
    if not lines:
        raise ProblemError("", "contains no numbers", "give one row per line")
    delimiter = next((mark for mark in DELIMITERS if mark in lines[0][1]), None)
    first = _fields(*lines[0], delimiter)
    indexed = _heads_an_index(first)
    if indexed or not any(is_number(entry) or NUMERIC.match(entry) for entry in first):
        _refuse_misplaced_q(lines[0][0], first)
        del lines[0]
    commas = delimiter != "," and any("," in line for _, line in lines)
    rows = [
        [
            number_of(_numeric(entry, number, i, commas))
            for i, entry in enumerate(_fields(number, line, delimiter), 1)
            if i > indexed
        ]
        for number, line in lines
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
    return rows


def _heads_an_index(header: list[str]) -> bool:
    """Whether the first line is a header, as pandas writes it, whose first column is an index: it has no name, and the
    others have names or are numbered from 0."""
    first, *others = (name.strip() for name in header)
    return not first and bool(others) and all(name == str(i) or NAME.match(name) for i, name in enumerate(others))


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
    except csv.Error as error:
        raise ProblemError(f"line {number}", f"is not CSV ({error})", "correct it there") from None


def is_number(entry: str) -> bool:
    try:
        float(entry)
    except ValueError:
        return False
    return "_" not in entry


def _numeric(entry: str, line: int, column: int, commas: bool) -> str:
    """The entry, checked to be a finite number, with a decimal point.

    commas : whether the decimal mark of the file is a comma.
    """
    number = entry.replace(",", ".", 1) if commas else entry
    mixed = commas and "." in entry
    if is_number(number) and math.isfinite(float(number)) and not mixed:
        return number
    place = f"line {line}, column {column}"
    if not entry.strip():
        raise ProblemError(place, "is empty", "give a number")
    if mixed:
        hint = "use one decimal mark and no thousands separators"
        raise ProblemError(place, f"is {quoted(entry)} in a file with decimal commas", hint)
    if is_number(number):
        raise ProblemError(place, f"is {quoted(entry.strip())}", "give a finite number in double precision")
    raise ProblemError(place, *misread(entry, f"is {quoted(entry)}, not a number"))
