"""Proposed solutions in files: a z to be verified, or a Farkas vector, with all digits.

A proposed solution is a result in JSON or CSV as `lcp solve` writes it, a list in JSON, or a row or column of numbers;
the output of `lcp solve --all` has several solutions. Among several results in JSON lines, the result for the problem
is found by its file or name; else the first is read. For a game, strategies may be given, in JSON under row and
column. Besides decimals, fractions like 15/29 are read, in JSON as strings. If a result has exact vectors, these are
read.

In a CSV table with a header, the columns z and w are read; a column `component` gives the order, and of several results
the first is taken. A table without a header has z, or z and w, after an index: 0, 1, 2, ..., or 1, 2, 3, ..., or names.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any, Literal, NamedTuple

from lcpcli.errors import ProblemError, count, kind
from lcpcli.files.contents import decode, within
from lcpcli.files.csv_format import grid_of, is_number
from lcpcli.files.json_format import load
from lcpcli.model.arrays import FROM_0
from lcpcli.rational.numbers import fraction, ratio

EXPECTED = "give a list of numbers, or what lcp solve --format json prints"
VERTEX = {"piece", "kind", "number", "component", "z"}  # the columns of a table of all solutions
STRATEGY = {"equilibrium", "player", "strategy", "probability"}  # the columns of a table of all equilibria
RUN = ("problem", "method")  # the columns that tell one result from another
HINT = "give one row or one column, a table with a column headed z, or a result in JSON"

Lengths = Mapping[int, str]  # what may be given, by its length
Rows = list[tuple[int, list[str]]]


class Candidate(NamedTuple):
    """A proposed solution or proof of infeasibility, to be verified.

    kind : "solution" for a z, strategies of a game one after the other, or another vector, identified by its length;
        "answer" for x, or x and y, in the program's own sense; "farkas" for a y that should prove that there is no
        solution.
    values : the entries, with all digits.
    exact : whether the values come from exact arithmetic, unrounded.
    w : the w given with z; with values that are not exact, only in CSV.
    claim : a claim of the result that the vector cannot verify; "" if there is none.
    rows : the number of values of the row player's strategy, where it is given separately; else None.
    remark : which of several results this is, if another one may have been meant; else "".
    """

    kind: Literal["solution", "answer", "farkas"]
    values: list[Fraction]
    exact: bool = False
    w: list[Fraction] | None = None
    claim: str = ""
    rows: int | None = None
    remark: str = ""


class Sought(NamedTuple):
    """The file and the name of the problem whose result is sought."""

    path: str = ""
    name: str = ""


def record_of(text: str, problem: Sought) -> tuple[str, str]:
    """Return one of several results, one per line: that of the problem by its file, else the name of its file or its
    own name; if none is, `first_of` them, with a remark. Raise ProblemError if several are, or if none is in a log.
    Return any other text as it is, without a remark."""
    lines = [line for line in text.split("\n") if line.strip()]
    if len(lines) < 2 or not all(line.lstrip().startswith("{") for line in lines[:2]):
        return text, ""
    own = all_records = [(_object(line), line) for line in lines]
    path = Path(problem.path)
    tests: list[tuple[str, Callable[[str], bool]]] = [
        ("file", lambda file: Path(file).absolute() == path.absolute()),
        ("file", lambda file: Path(file).name == path.name),
        ("problem", lambda name: name == problem.name),
    ]
    is_found = False
    for key, is_own in tests:
        if matches := [each for each in own if is_own(str(each[0].get(key) or ""))]:
            own, is_found = matches, True
        if len(own) == 1:
            return own[0][1], ""
    if is_found or all(record.get("file") and record.get("digest") for record, _ in all_records):
        hint = "give the line of one as a file of its own"
        raise ProblemError("", f"has {len(own) if is_found else 'no'} results for {problem.name}", hint)
    first = first_of("\n".join(lines))
    which = f"for {_object(first).get('problem') or 'a problem'}: none is for {problem.name}"
    return first, f"the first of {len(lines)} results is checked, {which}"


def first_of(text: str) -> str:
    """Return the result of the first problem, the one with the least number, from results with one in each line; else
    the first line."""
    lines = text.split("\n")
    given = [_object(line).get("number") for line in lines]
    numbers = [own if isinstance(own, int) else at for at, own in enumerate(given, 1)]
    return lines[numbers.index(min(numbers))]


def _object(line: str | bytes) -> dict[str, Any]:
    """Return the object in a line; an empty one if there is none."""
    with suppress(ValueError, RecursionError):
        found = json.loads(line)
        return found if isinstance(found, dict) else {}
    return {}


def of_json(content: bytes, lengths: Lengths, problem: Sought) -> list[Candidate]:
    """Return the candidates in a JSON text: several if it is the output of lcp solve --all.

    lengths : the possible lengths of a candidate, n first. problem : the problem, whose result is taken of several.
    """
    text, remark = record_of(decode(content), problem)
    data = load(text, fraction)
    solutions = data.get("solutions") if isinstance(data, dict) and "z" not in data else None
    if not isinstance(solutions, list):
        return [_candidate(data, lengths)._replace(remark=remark)]
    if not solutions:
        raise ProblemError("solutions", "is empty", "give a solution to check")
    own = ((each.get("equilibrium") or each) if isinstance(each, dict) else each for each in solutions)
    return [within(f"solutions[{i}]", _candidate, each, lengths) for i, each in enumerate(own)]


def _candidate(data: Any, lengths: Lengths) -> Candidate:
    n = next(iter(lengths))
    if isinstance(data, list):
        return Candidate("solution", _numbers("", data, lengths))
    if not isinstance(data, dict):
        raise ProblemError("", f"is {kind(data)}", EXPECTED)
    if "z" not in data and {"row", "column"} <= set(data):
        row, column = (_entries(player, data[player]) for player in ("row", "column"))
        return Candidate("solution", [*row, *column], rows=len(row))
    if "z" not in data and isinstance(sets := data.get("information_sets"), list):
        own = (each.get("probabilities") if isinstance(each, dict) else each for each in sets)
        each_set = (_entries(f"information_sets[{i}].probabilities", values) for i, values in enumerate(own))
        return Candidate("solution", of_length("information_sets", [*chain.from_iterable(each_set)], lengths))
    answer, exact, certificate = (
        data[key] if isinstance(data.get(key), dict) else {} for key in ("answer", "exact", "certificate")
    )
    if "x" in lengths.values() and not (isinstance(data.get("z"), list) and len(data["z"]) == n):
        both, k = [*lengths, *lengths][-2:]
        for at, part in (("", data), ("answer.", answer)):
            if part.get("x") is not None:
                values = _numbers(f"{at}x", part["x"], {k: "x"})
                if part.get("y") is not None:
                    values += _numbers(f"{at}y", part["y"], {both - k: "y"})
                return Candidate("answer", values)
    if "z" not in data:
        raise ProblemError("", "is an object without z", EXPECTED)
    of_z = {n: "z"}
    y, z, w = (_numbers(f"exact.{key}", exact[key], of_z) if exact.get(key) is not None else None for key in "yzw")
    if y or z:
        return Candidate("farkas" if y else "solution", y or z or [], exact=True, w=None if y else w)
    if certificate.get("kind") == "farkas":
        return Candidate("farkas", _numbers("certificate.vector", certificate.get("vector"), of_z))
    of_search = "the result says that there is none, by exhaustion, which has no certificate to check; solve it again"
    claim = of_search * (certificate.get("kind") == "exhaustion")
    return Candidate("solution", _numbers("z", data["z"], of_z), claim=claim)


def _numbers(field: str, values: Any, lengths: Lengths) -> list[Fraction]:
    return of_length(field or "z", _entries(field, values), lengths)


def _entries(field: str, values: Any) -> list[Fraction]:
    if not isinstance(values, list):
        raise ProblemError(field, f"is {kind(values)}", "give a list of numbers")
    found = []
    for i, value in enumerate(values):
        if not isinstance(value, (Fraction, str)):
            hint = f"give a number, or a fraction as a string {FROM_0}"
            raise ProblemError(f"{field}[{i}]", f"is {kind(value)}", hint)
        found.append(within(f"{field}[{i}]", ratio, value) if isinstance(value, str) else value)
    return found


def of_length(field: str, values: list[Fraction], lengths: Lengths) -> list[Fraction]:
    """Return the values; raise ProblemError if their number is not one of the lengths."""
    if len(values) in lengths:
        return values
    n, own = next(iter(lengths.items()))
    fault = f"has {count(len(values), 'entry')} for {own if own.endswith('strategies') else count(n, 'unknown')}"
    if len(lengths) == 1:
        raise ProblemError(field, fault, "make them agree")
    allowed = [f"{size} for {what}" for size, what in sorted(lengths.items())]
    raise ProblemError(field, fault, f"give {', '.join(allowed[:-1])} or {allowed[-1]}")


def of_table(content: bytes) -> list[Candidate]:
    """Return the candidates in CSV: several if the table lists all solutions of a problem."""
    grid = grid_of(content)
    header, rows = [name.casefold() for name in grid.header], [(k, [*map(str.strip, row)]) for k, row in grid.rows]
    if header and len(header) != len(rows[0][1]):
        fault = f"has {count(len(header), 'name')} above {count(len(rows[0][1]), 'column')}"
        raise ProblemError(f"line {grid.top}", fault, "give each column one name")
    if grid.commas:
        rows = [(k, [own if is_number(own := cell.replace(",", ".", 1)) else cell for cell in row]) for k, row in rows]
    if set(header) >= STRATEGY or set(header) >= VERTEX:
        return _several(header, rows)
    if (len(rows) > 1 and len(rows[0][1]) > 1) or (len(header) > 1 and "z" in header):
        places = [header.index(name) for name in RUN if name in header]
        first_run = [(k, row) for k, row in rows if all(row[j] == rows[0][1][j] for j in places)]
        return [_table(header or _columns(rows), first_run)]
    cells = [(f"line {k}, column {j}", cell) for k, row in rows for j, cell in enumerate(row, 1) if cell]
    return [Candidate("solution", [within(at, ratio, cell) for at, cell in cells])]


def _several(header: Sequence[str], rows: Rows) -> list[Candidate]:
    """Return the candidates in the output of lcp solve --all: each vertex, or each equilibrium with its
    probabilities."""
    of_game = set(header) >= STRATEGY
    keys = [header.index(name) for name in (["equilibrium"] if of_game else ["piece", "number"])]
    groups: dict[tuple[str, ...], Rows] = {}
    for k, row in rows:
        if of_game or row[header.index("kind")] == "vertex":
            groups.setdefault(tuple(row[j] for j in keys), []).append((k, row))
    if not groups:
        raise ProblemError("", "has no solution", "give a solution to check")
    return [(_strategies if of_game else _table)(header, own) for own in groups.values()]


def _strategies(names: Sequence[str], rows: Rows) -> Candidate:
    player = names.index("player")
    own = [[each for each in rows if (each[1][player] == "row") == is_first] for is_first in (True, False)]
    values = [_column("probability", names, _in_order("strategy", names, part)) for part in own]
    return Candidate("solution", values[0] + values[1], rows=len(values[0]))


def _column(name: str, names: Sequence[str], rows: Rows) -> list[Fraction]:
    j = names.index(name)
    return [within(f"line {k}, column {j + 1}", ratio, row[j]) for k, row in rows]


def _columns(rows: Rows) -> list[str]:
    """Return the names of the columns of a table without a header."""
    width = len(rows[0][1])
    first = [row[0] for _, row in rows]
    indexed = any(first == [str(i) for i in range(start, start + len(rows))] for start in (0, 1))
    named = not any(is_number(entry) for entry in first)
    if width in (2, 3) and (indexed or named):
        return ["index", "z", "w"][:width]
    raise ProblemError("", f"has {len(rows)} rows and {width} columns without a header", HINT)


def _table(names: Sequence[str], rows: Rows) -> Candidate:
    if "z" not in names:
        raise ProblemError("", "has no column headed z", HINT)
    if "component" in names:
        rows = _in_order("component", names, rows)
    return Candidate("solution", _column("z", names, rows), w=_column("w", names, rows) if "w" in names else None)


def _in_order(name: str, names: Sequence[str], rows: Rows) -> Rows:
    """Return the rows in the order of their components, which are in the column `name`, each once."""
    place = names.index(name)
    wanted, by_component = dict.fromkeys(str(i) for i in range(1, len(rows) + 1)), dict[str, tuple[int, list[str]]]()
    for k, row in rows:
        here = row[place]
        if here not in wanted or here in by_component:
            missing = next(i for i in wanted if i not in {row[place] for _, row in rows})
            fault = f"has component {here!r}{' again' * (here in by_component)}, while {missing} is missing"
            raise ProblemError(f"line {k}, column {place + 1}", fault, f"give each of 1 to {len(rows)} once")
        by_component[here] = (k, row)
    return [by_component[i] for i in wanted]
