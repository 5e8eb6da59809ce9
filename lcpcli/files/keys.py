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
NONLINEAR = {"F", "f", "function", "functions", "expression", "expressions", "equations", "jacobian"}
THREE_PLAYERS = "is a game of more than two players", "its equilibria are not the solutions of an LCP"
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
    keys = set(given)
    if {"A", "B", "C"} <= keys:
        raise ProblemError("", *THREE_PLAYERS)
    if keys & NONLINEAR and not keys & {"M", "Q", "A"}:
        raise ProblemError("", "is a nonlinear problem", "lcp solves linear ones, w = Mz + q: give M and q")
    if known == KEYS and "M" not in keys:
        for what, (needed, option) in CONVERTED.items():
            if needed <= keys:
                raise ProblemError("", f"is {what}, not a problem", f"convert it with lcp make {option}")
    errors.refuse_unknown(field, given, known, whole, {k: v for k, v in OTHER_NAMES.items() if v in known})
