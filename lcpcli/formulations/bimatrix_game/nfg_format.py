"""Gambit's .nfg files: two-player games in strategic form, and games of more players if
they are polymatrix games.

A file lists the payoffs of all profiles of strategies, or outcomes with payoffs and
then the outcome of each profile; the first player's strategy changes fastest, and
outcome 0 has payoffs 0. (Gambit, https://www.gambit-project.org, file formats.)
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from lcpcli.errors import CUT_OFF, ENDS_TOO_EARLY, ProblemError, count, quoted
from lcpcli.files.contents import decode
from lcpcli.files.formats import Number, refuse
from lcpcli.files.json_format import lossless_of
from lcpcli.formulations.gambit import TOKEN, Payoffs, pair_payoffs
from lcpcli.rational.numbers import ratio


# The parameters are those of every format.
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
    if (n_players := min(len(players), len(sides))) < 2:
        raise ProblemError(
            "", f"is a game of {count(n_players, 'player')}", "give one of at least two"
        )
    if len(players) != len(sides):
        reason = f"has strategies of {len(sides)} players for {len(players)} names"
        raise ProblemError("", reason, "give the strategies of each player")
    sizes = [len(side) if isinstance(side, list) else _whole(side) for side in sides]
    without = "has a player without strategies"
    refuse(not min(sizes), "", without, "give each at least one")
    number_of_profiles = math.prod(sizes)
    # Texts between the payoffs are comments.
    cells = [cell for cell in cells if cell and not _is_text(cell)]
    payoffs = _payoffs(cells, len(sizes))
    refuse(len(payoffs) < number_of_profiles, "", ENDS_TOO_EARLY, CUT_OFF)
    refuse(
        len(payoffs) > number_of_profiles,
        "",
        f"has more than the payoffs of {' x '.join(map(str, sizes))} strategies",
        "remove the others",
    )
    labels = [
        list(map(_text, side)) if isinstance(side, list) else [] for side in sides
    ]
    side = list(map(_text, players))
    numbered = [f"Player {number}" for number in range(1, len(side) + 1)]
    has_names = side != numbered and len({*side, ""}) > len(side)
    if len(sizes) > 2:
        tables = pair_payoffs(sizes, payoffs, side if has_names else numbered)
        numbers = [[str(a + 1) for a in range(size)] for size in sizes]
        pairs = zip(labels, numbers, strict=True)
        return {
            "payoffs": tables,
            "players": side if has_names else numbered,
            "actions": [each or other for each, other in pairs],
            "name": _text(title),
        }
    return _of_two(sizes, payoffs, labels) | {
        "name": _text(title),
        **({"players": side} if has_names else {}),
    }


def _of_two(
    sizes: Sequence[int], payoffs: Sequence[Payoffs], labels: Sequence[list[str]]
) -> dict[str, Any]:
    """Return the fields of a two-player game."""
    m, k = sizes
    A, B = (
        [[lossless_of(payoffs[j * m + i][player]) for j in range(k)] for i in range(m)]
        for player in (0, 1)
    )
    rows, columns = (
        [] if names == [str(i) for i in range(1, len(names) + 1)] else names
        for names in labels
    )
    return {"A": A, "B": B, "rows": rows, "columns": columns}


def _nested(text: str) -> list[Any]:
    """Return the words and the quoted texts of a file, in a nested list for each pair
    of braces.
    """
    braces = {"{": "[", "}": "],\n"}
    parts = (
        braces.get(token) or f"{json.dumps(token)},\n" for token in TOKEN.findall(text)
    )
    try:
        nested: list[Any] = json.loads(f"[{''.join(parts)}]".replace(",\n]", "]"))
    except (ValueError, RecursionError):
        raise ProblemError("", "has braces that do not match", CUT_OFF) from None
    return nested


def _payoffs(cells: list[Any], players: int) -> list[Payoffs]:
    """Return the payoffs of all players for each profile of strategies, from a list of
    payoffs or of outcomes.
    """
    if not (cells and isinstance(cells[0], list)):
        return _in_groups(cells, players)
    outcomes = [(Fraction(0),) * players]
    for outcome in cells[0]:
        payoffs = (
            _in_groups([part for part in outcome if not _is_text(part)], players)
            if isinstance(outcome, list)
            else []
        )
        if len(payoffs) != 1:
            raise ProblemError(
                "",
                f"has {quoted(str(outcome))} instead of an outcome",
                f"give {_number(players)} payoffs in braces",
            )
        outcomes += payoffs
    numbers = list(map(_whole, cells[1:]))
    if numbers and max(numbers) >= len(outcomes):
        raise ProblemError(
            "",
            f"names outcome {max(numbers)} of {len(outcomes) - 1}",
            "name one of those listed",
        )
    return [outcomes[number] for number in numbers]


def _in_groups(numbers: list[Any], players: int) -> list[Payoffs]:
    """Return numbers in groups with one for each player."""
    values = [ratio(str(number)) for number in numbers]
    odd = "an odd number of payoffs"
    several = f"a number of payoffs that is no multiple of {players}"
    refuse(
        len(values) % players,
        "",
        f"has {odd if players == 2 else several}",
        f"give {_number(players)} for each "
        f"{'pair' if players == 2 else 'profile'} of strategies",
    )
    return list(zip(*(values[i::players] for i in range(players)), strict=True))


def _number(players: int) -> str:
    return "two" if players == 2 else str(players)


def _is_text(token: Any) -> bool:
    return isinstance(token, str) and token.startswith('"') and len(token) > 1


def _text(token: Any) -> str:
    refuse(
        not _is_text(token),
        "",
        f"has {quoted(str(token))} instead of a name",
        "put names in quotes",
    )
    return re.sub(r"\\(.)", r"\1", token[1:-1])


def _whole(token: Any) -> int:
    reason = f"has {quoted(str(token))} instead of an integer"
    refuse(
        not re.fullmatch(r"[0-9]{1,9}", str(token)),
        "",
        reason,
        "give the number of strategies or of an outcome",
    )
    return int(token)
