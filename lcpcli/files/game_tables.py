"""A game in two files: a table with the payoffs of the row player, and one with those of the column player."""

from __future__ import annotations

import json
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

from lcpcli.errors import LCPError, OptionError, ProblemError, quoted
from lcpcli.files import csv_format, reading
from lcpcli.files.csv_cells import is_number
from lcpcli.files.inputs import Input
from lcpcli.files.keys import BOUNDS

LARGEST = 100_000  # bytes of a table that is read again for a hint
HINT = "give the payoffs of the row player and those of the column player"


def game_in(paths: Sequence[str]) -> Input:
    """The game as an input, like one in JSON; payoffs in CSV may be fractions, and strategies have their labels."""
    if len(paths) != 2:
        raise OptionError("--game", f"takes two files, not {len(paths)}", HINT)
    (A, rows, columns), (B, own_rows, own_columns) = map(_payoffs, paths)
    names = {
        "rows": _shared(paths[1], "rows", rows, own_rows),
        "columns": _shared(paths[1], "columns", columns, own_columns),
    }
    parts = [f'"{key}": [{", ".join(map(_row, table))}]' for key, table in (("A", A), ("B", B))]
    parts += [f'"{key}": {json.dumps(own)}' for key, own in names.items()]
    return Input((paths[0],), (f"{{{', '.join(parts)}}}".encode(),))


def hint(paths: Sequence[str]) -> str:
    """Return the line that says that two files may be the payoffs of a game: they are tables of one shape, of as many
    rows as columns, or with labels and no q, or of a shape that no problem has; "" for others."""
    if len(paths) != 2 or not all(Path(path).is_file() and Path(path).stat().st_size < LARGEST for path in paths):
        return ""
    try:
        (A, rows, columns), (B, _, others) = map(_payoffs, paths)
    except LCPError:
        return ""
    m, k = len(A), len(A[0])
    is_labelled = bool(rows and columns) and not {"q", *BOUNDS} & {*columns, *others}
    if (m, k) != (len(B), len(B[0])) or k == 1 or (k == m + 1 and not is_labelled):
        return ""
    return f"if {' and '.join(map(reading.place, paths))} are the payoffs of a game, add --game"


def _shared(path: str, key: str, names: list[str], others: list[str]) -> list[str]:
    """The names that the two tables, the second one from the path, give the strategies of a player; none for numbers of
    strategies that differ. ProblemError if they are others, or in another order."""
    if names and others and len(names) != len(others):
        return []
    if names and others and names != others:
        if sorted(names) == sorted(others):
            fault = f"has the {key} {', '.join(others)}, the other table {', '.join(names)}"
            raise ProblemError(reading.place(path), fault, "put them in the same order")
        own, other = next((own, name) for own, name in zip(others, names, strict=True) if own != name)
        fault = f"has {quoted(own)} among the {key} where the other table has {quoted(other)}"
        raise ProblemError(reading.place(path), fault, "give both tables the same names, or one of them none")
    return names or others


def _row(values: Sequence[str]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: str) -> str:
    """A payoff in JSON: with its digits, or as a text if it is a fraction."""
    return json.dumps(value) if "/" in value else str(Decimal(value))


def _payoffs(path: str) -> tuple[list[list[str]], list[str], list[str]]:
    """The rows of a table, with the names of its rows and columns."""
    content = reading.content_of(path, HINT)
    try:
        if reading.format_of(path, content) is not csv_format:
            raise ProblemError("", "is no table in CSV", "write the game as JSON, with the keys A and B")
        rows, *labels = csv_format.parse_payoffs(content)
    except ProblemError as error:
        raise error.inside(reading.place(path)) from None
    index, header = ([] if any(not name or is_number(name) for name in own) else own for own in labels)
    return rows, index, header
