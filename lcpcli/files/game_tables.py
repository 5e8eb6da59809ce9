"""A game in two files: a table with the payoffs of the row player, and one with those of the column player."""

from __future__ import annotations

import json
from collections.abc import Sequence
from decimal import Decimal

from lcpcli.errors import OptionError, ProblemError
from lcpcli.files import csv_format, reading
from lcpcli.files.inputs import Input

HINT = "give the payoffs of the row player and those of the column player"


def game_in(paths: Sequence[str]) -> Input:
    """The game as an input, like one in JSON; payoffs in CSV may be fractions."""
    if len(paths) != 2:
        raise OptionError("--game", f"takes two files, not {len(paths)}", HINT)
    A, B = (f"[{', '.join(map(_row, _payoffs(path)))}]" for path in paths)
    return Input((paths[0],), (f'{{"A": {A}, "B": {B}}}'.encode(),))


def _row(values: Sequence[str]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: str) -> str:
    """A payoff in JSON: with its digits, or as a text if it is a fraction."""
    return json.dumps(value) if "/" in value else str(Decimal(value))


def _payoffs(path: str) -> list[list[str]]:
    """The rows of a table."""
    content = reading.content_of(path, HINT)
    try:
        if reading.format_of(path, content) is not csv_format:
            raise ProblemError("", "is no table in CSV", "write the game as JSON, with the keys A and B")
        return csv_format.parse_payoffs(content)
    except ProblemError as error:
        raise error.inside(reading.place(path)) from None
