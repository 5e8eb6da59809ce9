"""Problems in CSV: n rows of n + 1 columns [M | q], or one file with the rows of M and
another with q; see `lcp help formats`. Bounds of z are two more columns, headed lower
and upper, next to one headed q; an empty cell means no bound.

Columns are separated by semicolons, tabs, commas or blanks: the first of these that the
first row contains. Blank lines, lines that begin with # and a byte order mark are
skipped, and so are a title above the table and empty trailing cells. Any line endings
are accepted. A header that is a column short is as R writes it, above an index.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache, cached_property, partial
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import (
    CORRECT_THERE,
    GIVE_NUMBER,
    IS_EMPTY,
    KEEP_ONE,
    ONE_ROW,
    REAL,
    ROW_OF_NUMBERS,
    ProblemError,
    count,
    numbers_for,
    quoted,
)
from lcpcli.files.contents import decode
from lcpcli.files.fields import BOUNDS, OTHER_NAMES, of_table
from lcpcli.files.formats import Exact, Number, refuse
from lcpcli.interrupts import in_time
from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import RATIO, decimal, double, places
from lcpcli.rational.numbers import text as ratio_text

# Begins like a number, so it is not a name in a header.
NUMERIC = re.compile(r"\s*[-+]?\.?\d")
# Two numbers, or one with a decimal comma.
DECIMALS = re.compile(r"\s*[-+]?\d+,\d+(e[-+]?\d+)?\s*", re.IGNORECASE)
# A name of an unknown that a header may have as it is.
HEADING = re.compile(r"[^\W\d][\w .()-]*|\d+")
# Headings of another meaning.
RESERVED = {"q", *BOUNDS, *OTHER_NAMES, "none", "null", "nan", "inf", "infinity"}
NAME = r"[^\W\d]"  # begins like a name
NUMBERED = re.compile(r"[MmZzXx]?_?\d+")  # a heading that only numbers a column
MANY = 3  # fewer numbers may be 1, 2, ... by chance
# A comment, but not an error such as #N/A or #REF!
COMMENT = re.compile(r"\s*#(?![A-Z][A-Z0-9/]*[!?]?\s*([;,\t]|$))")
SHAPE = "give n rows of n + 1 columns (M and q) or of n columns (M alone)"


class Table(NamedTuple):
    top: int  # the first line
    # The names in it, none if it is no header; where the numbers are read, without that
    # of an index.
    header: list[str]
    lines: list[tuple[int, list[str]]]  # the cells below it, by line
    delimiter: str  # between cells; "" for blanks
    indexed: bool  # whether the first column is an index
    commas: bool  # whether commas are decimal marks
    rows: list[list[Any]]  # the numbers; in columns of bounds, None means no bound
    # The columns of q, lower and upper, from 0, if the header names bounds.
    column_of: dict[str, int]

    @property
    def labels(self) -> list[str]:
        return [row[0].strip() for _, row in self.lines] if self.indexed else []


class Tables:
    """The table in a text, whose cells are separated once. grid : returns the cells;
    its argument says whether all of them are bounds, which may be absent."""

    def __init__(self, content: bytes) -> None:
        self.content, self.grid = content, cache(partial(grid_of, content))

    @cached_property
    def _of_doubles(self) -> Table:
        return table_of(self.grid(False))

    def table(self, number: Callable[[str], Any], are_bounds: bool = False) -> Table:
        """Return the cells with their numbers."""
        if number is float and not are_bounds:
            return self._of_doubles
        return table_of(self.grid(are_bounds), number, are_bounds)

    @property
    def names(self) -> list[str]:
        """Return the names of the columns of a square matrix; an empty list for another
        table."""
        grid = self.grid(False)
        names = grid.header[grid.indexed :]
        return names if len(names) == len(grid.lines) else []

    def require_order(self, names: Callable[[], Sequence[str]], field: str) -> None:
        """Raise ProblemError if the rows of a table below a header, or the columns of
        its only row, are labelled by these names in another order. names : returns the
        names, if there are labels; a result has none."""
        grid = self.grid(_is_bound(field))
        header = grid.header
        is_labelled = len(header) > 1 and is_header(header)
        if is_labelled and "component" not in header and (expected_names := names()):
            refuse_other_order([row[0] for _, row in grid.lines], expected_names)
            if len(grid.lines) == 1:
                refuse_other_order(header[grid.indexed :], expected_names)


def parse(content: bytes) -> Tables:
    return Tables(content)


def _hint_for_shape(n: int, columns: int) -> str:
    """Return what to do about a table without a header that is no M and q."""
    hint = SHAPE
    if 1 < columns - n < 4:
        hint += (
            ", or name q, lower and upper in a header, if the last columns are these"
        )
    if columns < n:
        hint += "; a fit of two tables, A and b, takes --lsq"
    if columns == n + 2:
        hint += "; is the first column an index? leave the first cell of a header empty"
    return hint


def fields(content: Tables, number: Number = float) -> dict[str, Any]:
    """Return M and q in n rows of n + 1 columns, or M alone in n rows of n, and what a
    header names."""
    table = content.table(number)
    rows = table.rows
    column_of = table.column_of
    header = table.header
    unknowns = [name for name in header if name not in ("q", *BOUNDS)][
        : len(table.labels)
    ]  # q may be headed otherwise
    refuse_other_order(table.labels, unknowns)
    n, first = len(rows), [row[0] for row in rows]
    is_long = (
        bool(header)
        and 0 not in column_of.values()
        and len(rows[0]) == n + (len(column_of) or 1) + 1
    )
    # The column only counts rows.
    if is_long and _counts(first):
        rows = [row[1:] for row in rows]
        column_of = {name: i - 1 for name, i in column_of.items()}
        header = header[1:]
    columns = len(rows[0])
    if not column_of:
        refuse(
            columns not in (n, n + 1),
            "",
            f"has {count(n, 'row')} of {count(columns, 'column')}",
            _hint_for_shape(n, columns),
        )
        names = _names(header[:n]) if len(header) == columns == n + 1 else {}
        if names and header[-1] != "q":
            _refuse_index(header[0], [row[0] for row in rows])
        return of_table(np.array(rows)) | names
    M = [
        [value for i, value in enumerate(row) if i not in column_of.values()]
        for row in rows
    ]
    wanted = f"give M as many columns, in addition to {' and '.join(column_of)}"
    refuse(
        len(M[0]) != n,
        "",
        f"has {count(n, 'row')} and {count(len(M[0]), 'column')} of M",
        wanted,
    )
    names = _names(
        [name for i, name in enumerate(header) if i not in column_of.values()]
    )
    return (
        {"M": M}
        | {name: [row[i] for row in rows] for name, i in column_of.items()}
        | names
    )


def _refuse_index(heading: str, first: list[Any]) -> None:
    """Raise ProblemError if the first column of M counts the rows, below a heading."""
    refuse(
        len(first) >= MANY and _counts(first),
        "",
        f"has M and q, or M alone beside an index {quoted(heading)}",
        "head the column of q with q, or leave the heading of the index empty",
    )


def _counts(column: list[Any]) -> bool:
    """Return whether the numbers, or the numbers in the texts, are those of the rows,
    from 0 or from 1."""
    n = len(column)
    numbers: list[Any] = [*range(n + 1)]
    if isinstance(column[0], str):
        numbers = list(map(str, numbers))
    return column in (numbers[:n], numbers[1:])


def _names(header: list[str]) -> dict[str, list[str]]:
    """Return the names of the unknowns in a header; none if two are alike, or if they
    only number the columns."""
    are_numbers = all(NUMBERED.fullmatch(name) for name in header)
    if all(name.isdecimal() for name in header):  # such as years
        are_numbers = list(map(int, header)) in (
            [*range(len(header))],
            [*range(1, len(header) + 1)],
        )
    return (
        {}
        if are_numbers or len(set(header)) < len(header) or not all(header)
        else {"names": header}
    )


def _is_bound(field: str) -> bool:
    return field.lstrip("-") in BOUNDS


def values(field: str, content: Tables, number: Number = float) -> list[Any]:
    table = content.table(number, _is_bound(field))
    rows, headed = table.rows, ", ".join(table.column_of)
    refuse(
        headed,
        "",
        f"has columns headed {headed}",
        ROW_OF_NUMBERS,
    )
    shape = f"has {len(rows)} rows and {len(rows[0])} columns"
    refuse(len(rows) > 1 and len(rows[0]) > 1, field, shape, ONE_ROW)
    return [x for row in rows for x in row]


def refuse_two_meanings(q: Tables, M: Tables) -> None:
    """Raise ProblemError if M has decimal commas and each line of q may be two numbers
    or one with a decimal comma."""
    of_q = q.grid(False)
    rows = [",".join(cells) for _, cells in of_q.lines]
    is_other = of_q.header or of_q.delimiter != ","
    are_decimals = not is_other and all(map(DECIMALS.fullmatch, rows))
    if are_decimals and M.grid(False).commas:
        hint = "add a header: q if the comma is a decimal mark, else two names"
        raise ProblemError("q", "has two columns, and M has decimal commas", hint)


def render(fields: Mapping[str, Any], exact: Exact) -> dict[str, bytes]:
    """Return [M | q], one row per line, with all digits; with bounds, [M | q | lower |
    upper]. Bounds, and names of the unknowns that a header can hold, are written below
    one."""
    refuse(
        not fields["q"].size,
        "",
        "cannot hold a problem without unknowns",
        "write .json",
    )
    vector_names = [name for name in ("q", *BOUNDS) if name in fields]
    table = np.column_stack(
        (matrices.dense(fields["M"]), *(fields[name] for name in vector_names))
    )

    def text(x: float) -> str:
        if x in exact:
            value = exact[x]
            return ratio_text(value) if places(value) is None else decimal(value)
        return "" if math.isinf(x) else repr(x)

    rows = [list(map(text, row)) for row in table.tolist()]
    names = fields.get("names", ())
    if len(vector_names) > 1 or can_head(names):
        rows.insert(
            0,
            [
                *(
                    names
                    if can_head(names)
                    else (f"M{i + 1}" for i in range(len(rows)))
                ),
                *vector_names,
            ],
        )
    return {"": "".join(f"{','.join(row)}\n" for row in rows).encode()}


def can_head(names: Sequence[str]) -> bool:
    are_free = not {name.casefold() for name in names} & RESERVED
    return are_free and all(map(HEADING.fullmatch, names)) and bool(_names(list(names)))


def lines_of(content: bytes) -> list[tuple[int, str]]:
    """Return the lines of a text with their numbers, without blank ones and comments.
    Breaks between quotation marks, as names may have, do not separate lines if all
    marks match."""
    lines = decode(content).replace("\r\n", "\n").replace("\r", "\n").split("\n")
    logical_lines, is_open = list[tuple[int, list[str]]](), False
    for number, line in enumerate(lines, 1):
        if is_open:
            logical_lines[-1][1].append(line)
        elif line.strip() and not COMMENT.match(line):
            logical_lines.append((number, [line]))
        else:
            continue
        is_open ^= line.count('"') % 2 == 1
    if is_open:
        return [
            (number, line)
            for number, line in enumerate(lines, 1)
            if line.strip() and not COMMENT.match(line)
        ]
    return [(number, "\n".join(parts)) for number, parts in logical_lines]


def delimiter_of(line: str) -> str:
    # "" for blanks.
    return next((mark for mark in (";", "\t", ",") if mark in line), "")


def is_header(cells: list[str]) -> bool:
    is_said = len(cells) > 1 and cells[-1].strip() in ("q", *BOUNDS)
    return is_said or not any(is_number(cell) or NUMERIC.match(cell) for cell in cells)


def grid_of(content: bytes, all_bounds: bool = False) -> Table:
    """Return the cells of the table in a text. all_bounds : whether all of them are
    bounds, which may be absent."""
    lines = lines_of(content)
    refuse(not lines, "", "contains no numbers", "give one row per line")
    lines = lines[_has_title(lines) :]
    delimiter = delimiter_of(lines[0][1])
    rows = [
        (number, cells_of(number, line, delimiter)) for number, line in in_time(lines)
    ]
    if delimiter.strip() and not all_bounds:
        rows = _without_empty_ends(rows)
    top, first = rows[0]
    if is_header(first) and {len(row) for _, row in rows[1:]} == {len(first) + 1}:
        first = ["", *first]  # of a header that leaves out the index, as R writes it
    indexed = _heads_an_index(first, [row[0] for _, row in rows[1:]])
    has_header = indexed or (
        is_header(first) and not (all_bounds and any(map(is_absent, first)))
    )
    rows = rows[has_header:]
    refuse(
        not rows,
        "",
        "contains a header and no numbers",
        "give one row per line below it",
    )
    commas = delimiter != "," and any(
        "," in line for _, line in lines[len(lines) - len(rows) :]
    )
    widths = [(number, len(row)) for number, row in rows]
    # The number of cells of the header is compared last.
    references = widths[:1]
    if indexed:
        references.append((top, len(first)))
    for line, columns in references:
        number, n_columns = next(
            (width for width in widths if width[1] != columns), (0, columns)
        )
        reason = f"has {count(n_columns, 'column')} where line {line} has {columns}"
        refuse(
            n_columns != columns,
            f"line {number}",
            reason,
            "give every line the same number of columns",
        )
    return Table(
        top,
        [cell.strip() for cell in first] if has_header else [],
        rows,
        delimiter,
        indexed,
        commas,
        [],
        {},
    )


def table_of(
    grid: Table, number_of: Callable[[str], Any] = float, all_bounds: bool = False
) -> Table:
    """Return the cells of a table with their numbers. all_bounds : whether all numbers
    are bounds; then a header may name anything."""
    top, header, below, _, indexed, commas, *_ = grid
    first = below[0][1]
    are_labelled = len(first) > 1 and all(is_name(cells[0]) for _, cells in below)
    refuse(
        are_labelled and not header,
        f"line {top}",
        f"has the label {quoted(first[0].strip())}, but there is no header",
        "name the columns of numbers in the first line, such as q",
    )
    header = header[indexed:]
    column_of = {} if all_bounds or not header else _columns_of_bounds(top, header)
    if "q" in header[:-1] and not (column_of or all_bounds):
        position = f"line {top}, column {header.index('q') + indexed + 1}"
        raise ProblemError(
            position,
            "is headed q, which must be the last column",
            "reorder the columns",
        )
    columns = len(first) - indexed
    reason = f"has {count(len(header), 'name')} above {count(columns, 'column')}"
    # If there is one more name than columns, one is a title.
    one_more = len(header) == columns + 1
    refuse(
        (column_of and len(header) != columns) or one_more,
        f"line {top}",
        reason,
        "give each column one name",
    )
    bounds = {
        i + indexed + 1
        for i in (range(columns) if all_bounds else map(column_of.get, BOUNDS))
        if i is not None
    }
    may_be_plain = number_of is float and not commas
    rows: list[list[Any]] = []
    for number, row in below:
        cells = row[indexed:]
        plain, numbered_cells = list[float](), enumerate(cells, 1 + indexed)
        with suppress(ValueError):
            plain = list(map(float, cells)) if may_be_plain else []
        # `float` reads 1_000.
        is_plain = math.isfinite(sum(map(abs, plain))) and "_" not in "".join(cells)
        rows.append(
            plain
            if plain and is_plain
            else [
                value_of(cell, number, i, commas, number_of, i in bounds)
                for i, cell in numbered_cells
            ]
        )
    return grid._replace(header=header, rows=rows, column_of=column_of)


def _has_title(lines: list[tuple[int, str]]) -> bool:
    """Return whether the first line is a title above a table: text in one cell, and
    several cells below."""
    if len(lines) < 2 or DECIMALS.fullmatch(lines[1][1]):
        return False
    delimiter = delimiter_of(lines[1][1])
    first, *others = map(str.strip, lines[0][1].split(delimiter) if delimiter else [""])
    is_text = (
        bool(first)
        and first[0] != '"'
        and not NUMERIC.match(first)
        and not delimiter_of(first)
    )
    return is_text and len(others) != 1 and not any(others)


def _without_empty_ends(
    rows: list[tuple[int, list[str]]],
) -> list[tuple[int, list[str]]]:
    """Return the rows without empty ones at the end, and without columns at the end
    that are empty in all rows; one row and two columns remain."""
    while len(rows) > 1 and not any(map(str.strip, rows[-1][1])):
        rows.pop()
    n_empty = min(
        min(sum(1 for _ in takewhile(_is_blank, reversed(cells))), len(cells) - 2)
        for _, cells in rows
    )
    if n_empty <= 0:
        return rows
    return [(number, cells[:-n_empty]) for number, cells in rows]


def _is_blank(cell: str) -> bool:
    return not cell.strip()


def _columns_of_bounds(line: int, names: list[str]) -> dict[str, int]:
    """Return the columns of q, lower and upper if the header names a bound; else an
    empty dictionary."""
    for column, name in list(enumerate(names, 1))[-3:]:
        meant = OTHER_NAMES.get(name.casefold(), name)
        hint = f"call it {meant}, if it holds bounds of z"
        is_other = name not in BOUNDS and meant in BOUNDS
        refuse(
            is_other and "q" in names,
            f"line {line}, column {column}",
            f"is headed {quoted(name)}",
            hint,
        )
    columns = [name for name in ("q", *BOUNDS) if name in names]
    if not set(columns) & set(BOUNDS):
        return {}
    for name in columns:
        refuse(
            names.count(name) > 1,
            f"line {line}",
            f"heads {names.count(name)} columns {name}",
            KEEP_ONE,
        )
    refuse(
        "q" not in columns,
        f"line {line}",
        "has headings of bounds, but none for q",
        "head the column of q with q",
    )
    return {name: names.index(name) for name in columns}


def _heads_an_index(header: list[str], below: list[str]) -> bool:
    """Return whether the first line is a header whose first column is an index: this
    column has no name, as pandas writes it, or a name with only names below it, and the
    other columns have names or are numbered from 0. If it has a name and the others
    are numbers, those below it may count the rows, or be the same."""
    first, *others = (name.strip() for name in header)
    is_named = bool(first)
    if is_named and not (others and below and is_name(first)):
        return False
    labels = [label.strip() for label in below]
    are_numbers = is_named and all(name.isdecimal() for name in others)
    if are_numbers and labels == others:
        return True
    if are_numbers and others[0] == "0" and _counts(others) and _counts(labels):
        return True
    if not others or (is_named and not all(map(is_name, labels))):
        return False
    # A row such as A,0 may be a label and a number.
    may_be_numbered = not is_named or len(others) > 1
    return all(
        (may_be_numbered and name == str(i)) or re.match(NAME, name)
        for i, name in enumerate(others)
    )


def remark(problem: Problem) -> str:
    n = problem.n
    first = [] if any(problem.names) or n < MANY else problem.M[:, 0].tolist()
    numbers = ", ".join(f"{x:g}" for x in first[:3])
    line = (
        f"the first column of M is {numbers}, ...; if it numbers the rows, add a "
        "header with an empty first cell"
    )
    return line if first and _counts(first) else ""


def refuse_other_order(labels: Sequence[str], names: Sequence[str]) -> None:
    stripped_labels = [label.strip() for label in labels]
    if (
        stripped_labels != list(names)
        and set(stripped_labels) & set(names) - {""}
        and len(set(names)) == len(names)
    ):
        reason = numbers_for(len(stripped_labels), "label", len(names), "unknown")
        if len(stripped_labels) == len(names):
            label, name = next(
                pair
                for pair in zip(stripped_labels, names, strict=True)
                if pair[0] != pair[1]
            )
            reason = f"has the label {quoted(label)} instead of {quoted(name)}"
        raise ProblemError(
            "", reason, "put the labels in the order of the unknowns, or leave them out"
        )


def cells_of(number: int, line: str, delimiter: str) -> list[str]:
    if not delimiter:
        line, delimiter = " ".join(line.split()), " "
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(
            csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True)
        )
    except csv.Error:
        reason = (
            "is not CSV (its quotation marks do not match, or an entry is very long)"
        )
        raise ProblemError(f"line {number}", reason, CORRECT_THERE) from None


def is_name(entry: str) -> bool:
    return (
        bool(re.match(NAME, entry.strip()))
        and not is_number(entry)
        and not is_absent(entry)
    )


def is_absent(entry: str) -> bool:
    return entry.strip().casefold() in ("", "none", "null")


def is_number(entry: str) -> bool:
    with suppress(ValueError):
        float(entry)
        return "_" not in entry
    return False


def value_of(
    entry: str,
    line: int,
    column: int,
    commas: bool,
    number_of: Callable[[str], Any],
    is_bound: bool,
) -> Any:
    """Return the number in a cell, which may be written as a fraction, with a decimal
    comma if the file has `commas`; a bound may be absent (None) or infinite."""
    if is_bound and is_absent(entry):
        return None
    if is_bound and entry.strip().casefold().lstrip("+-") in ("inf", "infinity"):
        return float(entry)
    is_ratio = RATIO.fullmatch(entry.strip())
    if is_ratio and entry.rpartition("/")[2].strip(" \t0"):
        return (double if number_of is float else number_of)(entry.strip())
    number = entry.replace(",", ".", 1) if commas else entry
    is_mixed = commas and "." in entry
    if is_number(number) and math.isfinite(float(number)) and not is_mixed:
        return number_of(number)
    text = quoted(entry.strip())
    if is_ratio or not entry.strip():
        reason = f"is {text}, a division by 0" if is_ratio else IS_EMPTY
        hint = GIVE_NUMBER
    elif is_mixed:
        reason = f"is {quoted(entry)} in a file with decimal commas"
        hint = "use one decimal mark, none for thousands"
    elif is_number(number):
        reason, hint = f"is {text}", "give a finite number in double precision"
    else:
        reason = f"is {quoted(entry)}, not a number"
        hint = "write the minus sign as -" if "\u2212" in entry else REAL
        hint = "write integers, as in 15/29" if "/" in entry else hint
    raise ProblemError(f"line {line}, column {column}", reason, hint)
