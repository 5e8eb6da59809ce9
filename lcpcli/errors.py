"""What can be wrong with an input: one line that names the place, the fault and the mend."""

from __future__ import annotations

from collections.abc import Iterable

SHOWN = 40  # characters of a text from a file that a message quotes at most


def quoted(text: str) -> str:
    """A text as a message quotes it: in quotes, on one line, and not longer than is of use."""
    return repr(text if len(text) <= SHOWN else text[:SHOWN] + "...")


def likely(given: str, known: Iterable[str], otherwise: str = "") -> str:
    """The mend for an unknown word: the known one that is likely meant; where none is, `otherwise`, or all of them."""
    from difflib import get_close_matches

    known = list(known)
    folded = given.casefold()
    begun = [word for word in known if folded and word.startswith(folded)]
    close = begun or get_close_matches(folded, known, n=1)
    return f"did you mean {close[0]}?" if close else otherwise or f"choose one of {', '.join(known)}"


class LCPError(Exception):
    """Base class of every error that this package raises on purpose.

    Parameters
    ----------
    where : the field, option or file that is at fault, as the user wrote it; "" if there is none.
    fault : what is wrong, as a clause without a full stop.
    mend : what to do about it, as an imperative clause without a full stop; "" if the fault says it.
    """

    def __init__(self, where: str, fault: str, mend: str = "") -> None:
        self.where, self.fault, self.mend = where, fault, mend
        super().__init__(": ".join(part for part in (where, "; ".join(p for p in (fault, mend) if p)) if part))

    def inside(self, place: str) -> LCPError:
        """The same error, told from one level further out (the file that holds the field)."""
        where = f"{place}: {self.where}" if self.where else place
        return type(self)(where, self.fault, self.mend)


class ProblemError(LCPError):
    """The problem, or the file that holds it, cannot be used."""


class OptionError(LCPError):
    """An option's value is out of its range, or the option has no effect on what was asked."""
