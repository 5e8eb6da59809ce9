"""The keys of a problem, in all formats with keys."""

from __future__ import annotations

from collections.abc import Collection

from lcpcli import errors
from lcpcli.errors import ProblemError
from lcpcli.options import INFINITY

TEXTS = ("name", "source", "note", "verdict")
BOUNDS = ("lower", "upper")
OF_BOUNDS = (*BOUNDS, INFINITY.name)  # the options that say what the bounds are
KEYS = ("name", "source", "note", "M", "q", *BOUNDS, "x0", "x1", "solution", "verdict", "origin", "names")
NONLINEAR = {"F", "f", "function", "functions", "expression", "expressions", "equations", "jacobian"}
THREE_PLAYERS = "is a game of more than two players", "its equilibria are not the solutions of an LCP"
OF_PAYOFFS = {"payoff", "payoffs", "payoff_matrix", "payoff_matrices", "players"}
PAIRS_OF_BOUNDS = {"bounds", "bnds", "bound", "box", "limits"}
OTHER_NAMES = {
    "matrix": "M",
    "a": "M",
    "vector": "q",
    "b": "q",
    "solutions": "solution",
    "z": "solution",
    "start": "x0",
    **dict.fromkeys(("l", "lb", "lo", "low", "xl", "zl", "lbound", "lowerbound", "lower_bound", "min"), "lower"),
    **dict.fromkeys(("u", "ub", "hi", "up", "high", "xu", "zu", "ubound", "upperbound", "upper_bound", "max"), "upper"),
}


def is_for_bounds(key: str) -> bool:
    """Whether a key, right or not, is likely meant for bounds."""
    folded = key.casefold()
    return folded in PAIRS_OF_BOUNDS or OTHER_NAMES.get(folded, folded) in BOUNDS


def refuse_unknown(field: str, given: Collection[str], known: tuple[str, ...], whole: str = "a problem") -> None:
    """Raise ProblemError for the first unknown key, suggesting the one that is likely meant."""
    keys = set(given)
    if {"A", "B", "C"} <= keys:
        raise ProblemError("", *THREE_PLAYERS)
    if keys & NONLINEAR and not keys & {"M", "Q", "A"}:
        raise ProblemError("", "is a nonlinear problem", "lcp solves linear ones, w = Mz + q: give M and q")
    if {"version", "status", "z"} <= keys:
        raise ProblemError("", "is a result, not a problem", "name the file of the problem")
    payoffs = next((key for key in given if key.casefold() in OF_PAYOFFS), None)
    if payoffs is not None:
        raise ProblemError(payoffs, f"is not a key of {whole}", "give the payoffs of a game as A and B")
    both = next((key for key in given if key not in known and key.casefold() in PAIRS_OF_BOUNDS), None)
    if both is not None and "lower" in known:
        raise ProblemError(both, f"is not a key of {whole}", "give the bounds as lower and upper, each a list")
    errors.refuse_unknown(field, given, known, whole, {k: v for k, v in OTHER_NAMES.items() if v in known})
