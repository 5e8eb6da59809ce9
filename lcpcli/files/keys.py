"""The keys of a problem, in every format that has keys."""

from __future__ import annotations

from collections.abc import Iterable

from lcpcli.errors import SHOWN, ProblemError

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


def refuse_unknown(field: str, given: Iterable[str], known: tuple[str, ...], whole: str = "a problem") -> None:
    """Raise ProblemError about the first key that is not known, with the one that is likely meant."""
    if known == KEYS:
        for what, (keys, option) in CONVERTED.items():
            if keys <= set(given) and "M" not in given:
                raise ProblemError("", f"is {what}, not a problem yet", f"make it one with lcp make {option}")
    for key in given:
        if key not in known:
            shown = key if len(key) <= SHOWN else f"{key[:SHOWN]}..."
            where = f"{field}.{shown}" if field else shown
            raise ProblemError(where, f"is no key of {whole}", likely(key, known))


def likely(key: str, known: tuple[str, ...]) -> str:
    """The mend for an unknown key."""
    folded = {name.casefold(): name for name in known} | {k: v for k, v in OTHER_NAMES.items() if v in known}
    from difflib import get_close_matches

    close = get_close_matches(key.casefold(), folded, n=1)
    return f"did you mean {folded[close[0]]}?" if close else f"the keys are {', '.join(known)}"
