"""Errors in input: one line that says where, what is wrong, and how to fix it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

SHOWN = 40  # the most characters of a text from a file that a message quotes
REAL = "give real numbers; lcp solves real problems only"  # the hint for a complex number
SHORTEST = 3  # the characters of a known word that is taken for the beginning of an unknown one
LONGEST = 200  # the characters of a text that are looked at for what it may be
COMPLEX = re.compile(r"\(?([-+\d.eE]*[-+])?\d[\d.eE]*\s*\*?[ijIJ]\)?")
EXPRESSION = re.compile(r"\w+\s*(\*|\^)|(\*|\^)\s*\w|\b(exp|log|sin|cos|sqrt|min|max)\(|\b[xz]\W?\d")


def quoted(text: str) -> str:
    """A text as a message quotes it: in quotes, on one line, truncated if long."""
    return repr(text if len(text) <= SHOWN else text[:SHOWN] + "...")


def likely(given: str, known: Iterable[str], otherwise: str = "") -> str:
    """The hint for an unknown word: the known one that is likely meant; failing that, `otherwise` or all of them."""
    known = list(known)
    close = nearest(given, known)
    return f"did you mean {close}?" if close else otherwise or f"choose one of {', '.join(known)}"


def nearest(given: str, known: Sequence[str]) -> str | None:
    """The known word that begins like an unknown one, or that it begins with, or else resembles it; None if none is."""
    from difflib import get_close_matches

    folded = given.casefold()
    begun = [word for word in known if folded and word.startswith(folded)]
    begun += [word for word in known if len(word.lstrip("-")) >= SHORTEST and folded.startswith(word)]
    return next(iter(begun or get_close_matches(folded, known, n=1)), None)


def refuse_unknown(
    field: str,
    given: Iterable[str],
    known: Sequence[str],
    whole: str = "a problem",
    meant: Mapping[str, str] | None = None,
) -> None:
    """Raise ProblemError for the first unknown key, suggesting the one that is likely meant.

    meant : other words for known keys, in lower case.
    """
    for key in given:
        if key not in known:
            folded = {name.casefold(): name for name in known} | dict(meant or {})
            shown = key if len(key) <= SHOWN else f"{key[:SHOWN]}..."
            from difflib import get_close_matches

            close = get_close_matches(key.casefold(), folded, n=1)
            hint = f"did you mean {folded[close[0]]}?" if close else f"the keys are {', '.join(known)}"
            raise ProblemError(f"{field}.{shown}" if field else shown, f"is not a key of {whole}", hint)


def misread(text: str, otherwise: str) -> tuple[str, str]:
    """What is wrong with a text in place of a number, and the hint: it may be complex, or an expression."""
    start = text[:LONGEST]
    if start.lstrip().startswith("#"):
        return f"is {quoted(text)}, an error in the spreadsheet", "correct it there and save the file again"
    if COMPLEX.fullmatch(start.replace(" ", "")):
        return f"is the complex number {quoted(text)}", REAL
    if EXPRESSION.search(start):
        return f"is the expression {quoted(text)}", "give a number; lcp solves linear problems w = Mz + q only"
    return otherwise, "give a number"


class LCPError(ValueError):
    """Base class of all errors that this package raises deliberately.

    Parameters
    ----------
    where : the field, option or file that is at fault, as the user wrote it; "" if there is none.
    fault : what is wrong, as a clause without a full stop.
    hint : how to fix it, as an imperative clause without a full stop; "" if the fault makes it obvious.
    """

    def __init__(self, where: str, fault: str, hint: str = "") -> None:
        self.where, self.fault, self.hint = where, fault, hint
        super().__init__(": ".join(part for part in (where, "; ".join(p for p in (fault, hint) if p)) if part))

    def __reduce__(self) -> tuple[type[LCPError], tuple[str, str, str]]:  # so that it passes between processes
        return type(self), (self.where, self.fault, self.hint)

    def inside(self, place: str) -> LCPError:
        """The same error, located from one level further out (the file that contains the field)."""
        where = f"{place}: {self.where}" if self.where else place
        return type(self)(where, self.fault, self.hint)


class ProblemError(LCPError):
    """The problem, or the file that holds it, cannot be used."""


class OptionError(LCPError):
    """An option's value is out of its range, or the option has no effect on the request."""


class ParameterError(OptionError):
    """An OptionError of the library: `where` is a name as in Python, which the command line writes as its flag."""


def count(n: int, noun: str) -> str:
    """A number with its noun: "1 entry", "3 entries"."""
    plural = noun[:-1] + "ies" if noun.endswith("y") else noun + "s"
    return f"{n} {noun if n == 1 else plural}"


def kind(value: Any) -> str:
    """The name of a value as the author of a file would put it."""
    if type(value).__name__ in ("bool", "bool_"):  # also numpy's
        return str(value).lower()
    if isinstance(value, str):
        return f"the text {quoted(value)}"
    if hasattr(value, "numerator"):
        return "a number"
    names = {type(None): "null", dict: "an object", list: "a list", tuple: "a list", float: "a number"}
    return names.get(type(value), f"of type {type(value).__name__}")
