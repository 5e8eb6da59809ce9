"""Two-player games in two tables, one with the payoffs of each player."""

from __future__ import annotations

import json
from collections.abc import Sequence

from lcpcli.errors import LCPError, ParameterError, ProblemError, quoted
from lcpcli.files.contents import source_name
from lcpcli.files.fields import BOUNDS
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input
from lcpcli.formulations.tables import listed, names_in, table_in

HINT = "give the payoffs of the row player and those of the column player"


def input_of(paths: Sequence[str]) -> Input:
    """Return the game as an input in JSON. The payoffs in the tables may be fractions;
    labels name the strategies."""
    if len(paths) != 2:
        raise ParameterError("game", f"takes two files, not {len(paths)}", HINT)
    tables = (_table(InputFile.read(path, HINT)) for path in paths)
    (A, rows, columns), (B, rows_of_B, columns_of_B) = tables
    parts = [
        f'"{key}": [{", ".join(map(listed, table))}]'
        for key, table in (("A", A), ("B", B))
    ]
    for key, *names in (("rows", rows, rows_of_B), ("columns", columns, columns_of_B)):
        parts.append(f'"{key}": {json.dumps(_shared(paths[1], key, *names))}')
    return Input((InputFile(paths[0], f"{{{', '.join(parts)}}}".encode()),))


def hint(files: Sequence[InputFile]) -> str:
    """Return the line that says that two files may be the payoffs of a game, if they
    are tables of the same shape that are square, or have labels and no q, or a shape
    that no problem has; "" for other files.
    """
    try:
        (A, rows, columns), (B, _, others) = map(_table, files)
    except LCPError:
        return ""
    m, k = len(A), len(A[0])
    is_labelled = bool(rows and columns) and not {"q", *BOUNDS} & {*columns, *others}
    if (m, k) != (len(B), len(B[0])) or k == 1 or (k == m + 1 and not is_labelled):
        return ""
    names = " and ".join(file.source_name for file in files)
    return f"if {names} are the payoffs of a game, add --game"


def _shared(path: str, key: str, names: list[str], others: list[str]) -> list[str]:
    """Return the names that two tables have for a player's strategies; an empty list if
    the numbers of names differ. Raises ProblemError if the names in the second table,
    in the file `path`, differ, or are in another order.
    """
    if names and others and len(names) != len(others):
        return []
    if names and others and names != others:
        name_in_A, other = next(
            (name_in_A, name)
            for name_in_A, name in zip(others, names, strict=True)
            if name_in_A != name
        )
        reason = (
            f"has {quoted(name_in_A)} among the {key} where the other table has "
            f"{quoted(other)}"
        )
        raise ProblemError(
            source_name(path),
            reason,
            "give both the same names in the same order, or one of them none",
        )
    return names or others


def _table(file: InputFile) -> tuple[list[list[str]], list[str], list[str]]:
    table = table_in(file, HINT, "write the game as JSON, with the keys A and B")
    return table.rows, names_in(table.labels), names_in(table.header)
