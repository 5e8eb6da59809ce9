"""Quadratic programs and bimatrix games in JSON, reduced to LCPs.

A program is an object with Q and c, and optionally A and b, and free (indices from 0); a game one with A and B, and
optionally rows and columns (names). Either may have name, source and note.
"""

from __future__ import annotations

from typing import Any

from lcpcli.errors import ProblemError, kind
from lcpcli.files.content import decode
from lcpcli.files.json_format import load
from lcpcli.files.keys import THREE_PLAYERS, is_for_bounds, refuse_unknown
from lcpcli.model.from_game import from_game
from lcpcli.model.from_program import from_qp
from lcpcli.model.problem import Problem

TEXTS = ("name", "source", "note")
BOUNDS_OF = {
    "a program": "its bounds are x >= 0; write others as rows of A and b, with the x_i that may be negative in free",
    "a game": "its unknowns are probabilities; leave it out",
}


def qp(content: bytes) -> Problem:
    """The LCP of the program in a JSON text, or a ProblemError that names the field or the line and column."""
    return from_qp(**_held(content, "a program", ("Q", "c"), ("A", "b", "free")))


def game(content: bytes) -> Problem:
    """The LCP of the game in a JSON text, or a ProblemError that names the field or the line and column."""
    held = _held(content, "a game", ("A", "B"), ("rows", "columns"))
    if any(_depth(held[key]) > 2 for key in ("A", "B")):
        raise ProblemError("", *THREE_PLAYERS)
    return from_game(**held)


def _depth(payoffs: Any) -> int:
    """How many lists are nested: one per player."""
    return 1 + _depth(payoffs[0]) if isinstance(payoffs, list) and payoffs else 0


def _held(content: bytes, whole: str, needed: tuple[str, ...], optional: tuple[str, ...]) -> dict[str, Any]:
    data = load(decode(content))
    if not isinstance(data, dict):
        raise ProblemError("", f"is {kind(data)}", f"give an object with the keys {' and '.join(needed)}")
    if bound := next(filter(is_for_bounds, data), None):
        raise ProblemError(bound, f"is not a key of {whole}", BOUNDS_OF[whole])
    refuse_unknown("", data, (*needed, *optional, *TEXTS), whole)
    for key in needed:
        if key not in data:
            raise ProblemError(key, "is missing", f"add the key {key}")
    return data


KINDS = {"qp": qp, "game": game}
