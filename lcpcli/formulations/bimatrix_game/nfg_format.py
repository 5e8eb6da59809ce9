"""Gambit's .nfg files: games of two players in strategic form.

A file lists the payoffs of all pairs of strategies, or outcomes with payoffs and then
the outcome of each pair; the first player's strategy changes fastest; outcome 0 pays
nothing. (Gambit, https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import json
import re
from fractions import Fraction
from typing import Any

from lcpcli.errors import CUT_OFF, ENDS_TOO_EARLY, ProblemError, count, quoted
from lcpcli.files.contents import decode
from lcpcli.files.formats import Number, refuse
from lcpcli.files.json_format import lossless_of
from lcpcli.formulations.bimatrix_game.game import THREE_PLAYERS
from lcpcli.formulations.gambit import TOKEN
from lcpcli.rational.numbers import ratio

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
        [[lossless_of(pairs[j * m + i][player]) for j in range(k)] for i in range(m)]
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
