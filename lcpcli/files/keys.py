"""The keys of a problem, in all formats with keys."""

from __future__ import annotations

from collections.abc import Collection

from lcpcli import errors
from lcpcli.errors import ProblemError

TEXTS = ("name", "source", "note", "verdict")
KEYS = ("name", "source", "note", "M", "q", "x0", "x1", "solution", "verdict", "origin")
CONVERTED = {
    "a quadratic program": ({"Q", "c"}, "--from-qp"),
    "a game of two players": ({"A", "B"}, "--from-game"),
}
OTHER_NAMES = {
    "matrix": "M",
    "a": "M",
    "vector": "q",
    "b": "q",
    "solutions": "solution",
    "z": "solution",
    "start": "x0",
}


def refuse_unknown(field: str, given: Collection[str], known: tuple[str, ...], whole: str = "a problem") -> None:
    """Raise ProblemError for the first unknown key, suggesting the one that is likely meant."""
    if known == KEYS:
        for what, (keys, option) in CONVERTED.items():
            if keys <= set(given) and "M" not in given:
                raise ProblemError("", f"is {what}, not a problem", f"convert it with lcp make {option}")
    errors.refuse_unknown(field, given, known, whole, {k: v for k, v in OTHER_NAMES.items() if v in known})
