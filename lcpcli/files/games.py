"""Games of two players: in Gambit's strategic form, .nfg, and in two tables, one with
the payoffs of each player.

A .nfg file lists the payoffs of all pairs of strategies, or outcomes with payoffs and
then the outcome of each pair; the first player's strategy changes fastest; outcome 0
pays nothing. (Gambit, https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

from lcpcli.errors import (
    CUT_OFF,
    ENDS_TOO_EARLY,
    LCPError,
    ParameterError,
    ProblemError,
    count,
    quoted,
)
from lcpcli.files.contents import decode, place
from lcpcli.files.fields import BOUNDS, THREE_PLAYERS
from lcpcli.files.formats import Number, kind_by_name, refuse
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input
from lcpcli.files.json_format import payoff_of
from lcpcli.rational.numbers import ratio

HINT = "give the payoffs of the row player and those of the column player"

# A text, a brace, a word, or an open quote.
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[{}]|[^\s,{}"]+|"', re.DOTALL)
Pair = tuple[Fraction, Fraction]


# As in every format.
def fields(content: bytes, number: Number = float) -> dict[str, Any]:  # noqa: ARG001
    """Return the game in an .nfg file."""
    parts: list[Any] = [*_nested(decode(content)), *6 * [""]]
    begin, version, _, title, players, sides, *cells = parts
    if (begin, version) != ("NFG", "1"):
        raise ProblemError(
            "line 1",
            "is not the beginning of a game",
            "begin the file with NFG 1 R or EFG 2 R",
        )
    if not (_is_text(title) and isinstance(players, list) and isinstance(sides, list)):
        raise ProblemError(
            "",
            "has no title, players and strategies",
            'write NFG 1 R "title" { "one" "two" } { 2 2 }',
        )
    refuse(max(len(players), len(sides)) > 2, "", *THREE_PLAYERS)
    if (fewest := min(len(players), len(sides))) < 2:
        raise ProblemError(
            "", f"is a game of {count(fewest, 'player')}", "give one of two players"
        )
    m, k = (len(own) if isinstance(own, list) else _whole(own) for own in sides)
    refuse(not m * k, "", "has a player without strategies", "give each at least one")
    # A text here is a comment.
    pairs = _pairs([cell for cell in cells if cell and not _is_text(cell)])
    refuse(len(pairs) < m * k, "", ENDS_TOO_EARLY, CUT_OFF)
    refuse(
        len(pairs) > m * k,
        "",
        f"has more than the payoffs of {m} x {k} strategies",
        "remove the others",
    )
    A, B = (
        [[payoff_of(pairs[j * m + i][player]) for j in range(k)] for i in range(m)]
        for player in (0, 1)
    )
    labels = (list(map(_text, own)) if isinstance(own, list) else [] for own in sides)
    rows, columns = (
        [] if own == [str(i) for i in range(1, len(own) + 1)] else own for own in labels
    )
    own = list(map(_text, players))
    named = (
        {}
        if own == ["Player 1", "Player 2"] or len({*own, ""}) < 3
        else {"players": own}
    )
    return {
        "A": A,
        "B": B,
        "rows": rows,
        "columns": columns,
        "name": _text(title),
    } | named


def _nested(text: str) -> list[Any]:
    """Return the words and the quoted texts of a file, with a list for each pair of
    braces."""
    braces = {"{": "[", "}": "],\n"}
    parts = (
        braces.get(token) or f"{json.dumps(token)},\n" for token in TOKEN.findall(text)
    )
    try:
        found: list[Any] = json.loads(f"[{''.join(parts)}]".replace(",\n]", "]"))
    except (ValueError, RecursionError):
        raise ProblemError("", "has braces that do not match", CUT_OFF) from None
    return found


def _pairs(cells: list[Any]) -> list[Pair]:
    """Return the payoffs of both players for each pair of strategies, from a list of
    them or of outcomes."""
    if not (cells and isinstance(cells[0], list)):
        return _in_pairs(cells)
    outcomes = [(Fraction(0), Fraction(0))]
    for outcome in cells[0]:
        payoffs = (
            _in_pairs([part for part in outcome if not _is_text(part)])
            if isinstance(outcome, list)
            else []
        )
        if len(payoffs) != 1:
            raise ProblemError(
                "",
                f"has {quoted(str(outcome))} in place of an outcome",
                "give two payoffs in braces",
            )
        outcomes += payoffs
    numbers = list(map(_whole, cells[1:]))
    if numbers and max(numbers) >= len(outcomes):
        raise ProblemError(
            "",
            f"names outcome {max(numbers)} of {len(outcomes) - 1}",
            "name one that is given",
        )
    return [outcomes[number] for number in numbers]


def _in_pairs(numbers: list[Any]) -> list[Pair]:
    values = [ratio(str(number)) for number in numbers]
    refuse(
        len(values) % 2,
        "",
        "has an odd number of payoffs",
        "give two for each pair of strategies",
    )
    return list(zip(values[::2], values[1::2], strict=True))


def _is_text(token: Any) -> bool:
    return isinstance(token, str) and token.startswith('"') and len(token) > 1


def _text(token: Any) -> str:
    refuse(
        not _is_text(token),
        "",
        f"has {quoted(str(token))} in place of a name",
        "put names in quotes",
    )
    return re.sub(r"\\(.)", r"\1", token[1:-1])


def _whole(token: Any) -> int:
    fault = f"has {quoted(str(token))} in place of a whole number"
    refuse(
        not re.fullmatch(r"[0-9]{1,9}", str(token)),
        "",
        fault,
        "give the number of strategies or of an outcome",
    )
    return int(token)


def game_in(paths: Sequence[str]) -> Input:
    """Return the game as an input in JSON. The payoffs in the tables may be fractions;
    labels name the strategies."""
    if len(paths) != 2:
        raise ParameterError("game", f"takes two files, not {len(paths)}", HINT)
    tables = (_table(InputFile.read(path, HINT)) for path in paths)
    (A, rows, columns), (B, own_rows, own_columns) = tables
    parts = [
        f'"{key}": [{", ".join(map(_row, table))}]'
        for key, table in (("A", A), ("B", B))
    ]
    for key, *names in (("rows", rows, own_rows), ("columns", columns, own_columns)):
        parts.append(f'"{key}": {json.dumps(_shared(paths[1], key, *names))}')
    return Input((InputFile(paths[0], f"{{{', '.join(parts)}}}".encode()),))


def hint(files: Sequence[InputFile]) -> str:
    """Return the line that says that two files may be the payoffs of a game, as tables
    of the same shape that are square, or have labels and no q, or have a shape that no
    problem has; "" for other files."""
    try:
        (A, rows, columns), (B, _, others) = map(_table, files)
    except LCPError:
        return ""
    m, k = len(A), len(A[0])
    is_labelled = bool(rows and columns) and not {"q", *BOUNDS} & {*columns, *others}
    if (m, k) != (len(B), len(B[0])) or k == 1 or (k == m + 1 and not is_labelled):
        return ""
    names = " and ".join(file.place for file in files)
    return f"if {names} are the payoffs of a game, add --game"


def may_be_payoffs(path: str) -> bool:
    """Return whether a file may be a table, and is so small that it can be read again
    for a mere hint."""
    kind = kind_by_name(path)
    is_small = Path(path).is_file() and Path(path).stat().st_size < 100_000
    return is_small and (kind is None or kind.is_table)


def _shared(path: str, key: str, names: list[str], others: list[str]) -> list[str]:
    """Return the names that two tables give a player's strategies; an empty list if the
    numbers of names differ. Raises ProblemError if the names in the second table, in
    the file `path`, differ, or are in another order."""
    if names and others and len(names) != len(others):
        return []
    if names and others and names != others:
        own, other = next(
            (own, name) for own, name in zip(others, names, strict=True) if own != name
        )
        fault = (
            f"has {quoted(own)} among the {key} where the other table has "
            f"{quoted(other)}"
        )
        raise ProblemError(
            place(path),
            fault,
            "give both the same names in the same order, or one of them none",
        )
    return names or others


def _row(values: Sequence[str]) -> str:
    texts = (
        json.dumps(value) if "/" in value else str(Decimal(value)) for value in values
    )
    return f"[{', '.join(texts)}]"


def _table(file: InputFile) -> tuple[list[list[str]], list[str], list[str]]:
    from lcpcli.files.csv_format import is_number

    hint = "write the game as JSON, with the keys A and B"
    refuse(not file.kind.is_table, file.place, "is not a table in CSV", hint)
    table = file.within(file.data.table, str)
    fault = f"has columns headed {', '.join(table.places)}"
    refuse(table.places, file.place, fault, HINT)
    both = (table.labels, table.header)
    index, header = (
        [] if any(not name or is_number(name) for name in own) else own for own in both
    )
    return table.rows, index, header
