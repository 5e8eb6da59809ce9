"""z, and w if it is there, in CSV: one row or one column of numbers, or a table such as lcp solve -o z.csv writes.

In a table with a header the columns z and w are read; a column `component` gives the order, and of several results the
first is taken. Of what lcp solve --all writes each vertex is an answer, or each equilibrium with its probabilities. A
table without a header has z, or z and w, after an index: 0, 1, 2, ..., or 1, 2, 3, ..., or names.
Numbers are decimals or fractions such as 15/29.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

from lcpcli.errors import ProblemError, count
from lcpcli.files.content import decode
from lcpcli.files.csv_cells import NUMERIC, is_number
from lcpcli.files.csv_format import is_comment
from lcpcli.rational.numbers import ratio

DELIMITERS = ";\t,"
VERTEX = {"piece", "kind", "number", "component", "z"}  # the columns of all solutions
STRATEGY = {"equilibrium", "player", "strategy", "probability"}  # of all equilibria
RUN = ("problem", "method")  # the columns that tell one result from another
HINT = "give one row or one column, a table with a column headed z, or a result in JSON"

Rows = list[tuple[int, list[str]]]


class Answer(NamedTuple):
    """z, and w where the table has it; or strategies of a game, one after the other, of which `rows` values are of the
    row player's."""

    z: list[Fraction]
    w: list[Fraction] | None
    rows: int | None = None


def parse(content: bytes) -> Answer:
    """z, and w if it is there, of the only answer or the first one in a text, or a ProblemError that names the line."""
    first = answers(content)[0]
    if first.rows is not None:
        raise ProblemError("", "has no column headed z", HINT)
    return first


def answers(content: bytes) -> list[Answer]:
    """The answers in a text, several if these are all solutions of a problem, or a ProblemError."""
    lines = [(k, line) for k, line in enumerate(decode(content).splitlines(), 1)]
    lines = [(k, line) for k, line in lines if line.strip() and not is_comment(line)]
    rows = [(k, _cells(line)) for k, line in lines]
    header: list[str] = []
    if rows and not any(is_number(entry) or NUMERIC.match(entry) for entry in rows[0][1]):
        rows, header = _below_header(lines)
    if set(header) >= STRATEGY or set(header) >= VERTEX:
        return _several(header, rows)
    if len(rows) > 1 and max(len(row) for _, row in rows) > 1:
        return [_table(header or _columns(rows), _first_run(header, rows))]
    if len(header) > 1 and "z" in header:
        return [_table(header, rows)]
    return [Answer([_number(k, j, entry) for k, row in rows for j, entry in enumerate(row, 1) if entry], None)]


def _several(header: Sequence[str], rows: Rows) -> list[Answer]:
    """The answers in what lcp solve --all writes."""
    _require_alike(header, rows)
    place = {name: j for j, name in enumerate(header)}
    of_game = set(header) >= STRATEGY
    groups: dict[tuple[str, ...], Rows] = {}
    for k, row in rows:
        if of_game or row[place["kind"]] == "vertex":
            key = (row[place["equilibrium"]],) if of_game else (row[place["piece"]], row[place["number"]])
            groups.setdefault(key, []).append((k, row))
    if not groups:
        raise ProblemError("", "has no solution", "give a solution to check")
    found = _strategies if of_game else _table
    return [found(header, own) for own in groups.values()]


def _strategies(names: Sequence[str], rows: Rows) -> Answer:
    """The strategies of one equilibrium."""
    player, strategy, value = (names.index(name) for name in ("player", "strategy", "probability"))
    own = [[each for each in rows if (each[1][player] == "row") == first] for first in (True, False)]
    ordered = [_ordered(part, strategy) for part in own]
    return Answer([_number(k, value + 1, row[value]) for part in ordered for k, row in part], None, len(ordered[0]))


def _require_alike(names: Sequence[str], rows: Rows) -> None:
    for k, row in rows:
        if len(row) != len(names):
            raise ProblemError(
                f"line {k}", f"has {count(len(row), 'column')} instead of {len(names)}", "make every line alike"
            )


def _below_header(lines: list[tuple[int, str]]) -> tuple[Rows, list[str]]:
    """The rows of a table, and the names in its header; between its delimiters, cells may have spaces or be empty."""
    (_, first), *others = lines
    delimiter = _delimiter(first)
    if delimiter == " ":
        return [(k, _cells(line)) for k, line in others], [name.casefold() for name in _cells(first)]
    header = [cell.strip().casefold() for cell in next(csv.reader([first], delimiter=delimiter))]
    while not header[-1]:
        header.pop()
    return [(k, _cells_below(line, delimiter, len(header))) for k, line in others], header


def _cells_below(line: str, delimiter: str, width: int) -> list[str]:
    if delimiter not in line:
        return _cells(line)
    cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    while len(cells) > width and not cells[-1]:
        cells.pop()
    return [_with_point(cell) for cell in cells] if delimiter in ";\t" else cells


def _delimiter(line: str) -> str:
    return next((mark for mark in DELIMITERS if mark in line), " ")


def _cells(line: str) -> list[str]:
    delimiter = _delimiter(line)
    cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    parts = [part for cell in cells for part in (cell.split() or [""])]
    return [_with_point(part) for part in parts] if delimiter in ";\t" else parts


def _with_point(part: str) -> str:
    """A number with a decimal comma, which is unambiguous between semicolons or tabs, with a point."""
    pointed = part.replace(",", ".", 1)
    return pointed if is_number(pointed) else part


def _columns(rows: Rows) -> list[str]:
    """The names of the columns of a table without a header."""
    width = len(rows[0][1])
    first = [row[0] for _, row in rows]
    indexed = any(first == [str(i) for i in range(start, start + len(rows))] for start in (0, 1))
    named = not any(is_number(entry) for entry in first)
    if width in (2, 3) and (indexed or named):
        return ["index", "z", "w"][:width]
    raise ProblemError("", f"has {len(rows)} rows and {width} columns without a header", HINT)


def _first_run(header: Sequence[str], rows: Rows) -> Rows:
    """The rows of the first result."""
    places = [header.index(name) for name in RUN if name in header]
    own = [rows[0][1][j] for j in places]
    return [(k, row) for k, row in rows if [row[j] for j in places if j < len(row)] == own]


def _table(names: Sequence[str], rows: Rows) -> Answer:
    if "z" not in names:
        raise ProblemError("", "has no column headed z", HINT)
    _require_alike(names, rows)
    if "component" in names:
        rows = _ordered(rows, names.index("component"))
    places = [names.index(name) for name in ("z", "w") if name in names]
    z, *w = [[_number(k, j + 1, row[j]) for k, row in rows] for j in places]
    return Answer(z, w[0] if w else None)


def _ordered(rows: Rows, place: int) -> Rows:
    """The rows in the order of their components, each of which must occur once."""
    wanted = dict.fromkeys(str(i) for i in range(1, len(rows) + 1))
    held: dict[str, tuple[int, list[str]]] = {}
    for k, row in rows:
        if row[place] not in wanted or row[place] in held:
            here = {row[place] for _, row in rows}
            missing = next(i for i in wanted if i not in here)
            again = " again" * (row[place] in held)
            fault = f"has component {row[place]!r}{again}, while {missing} is missing"
            raise ProblemError(f"line {k}, column {place + 1}", fault, f"give each of 1 to {len(rows)} once")
        held[row[place]] = (k, row)
    return [held[i] for i in wanted]


def _number(line: int, column: int, entry: str) -> Fraction:
    try:
        return ratio(entry)
    except ProblemError as error:
        raise error.inside(f"line {line}, column {column}") from None
