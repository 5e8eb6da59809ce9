"""The kinds of problems that are reduced to complementarity problems, by name: in files, the key kind of an origin.

An origin is pure data, what is needed to map a solution back; solving/ interprets results with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from lcpcli.errors import ProblemError, kind, quoted
from lcpcli.model.reductions.game import Game
from lcpcli.model.reductions.program import Conditions, Program


class Origin(Protocol):
    """Interface of a kind of origin."""

    def data(self) -> dict[str, Any]:
        """Its content for a file, in lists, numbers and texts; `as_origin` reads it back."""

    def fits(self, given: Conditions, /) -> bool:
        """Whether this origin yields the problem."""

    def names(self, n: int, /) -> Sequence[str]:
        """The names of the n components of z, "" where there is none."""


KINDS: dict[str, Callable[[Mapping[str, Any]], Origin]] = {"qp": Program.parse, "game": Game.parse}


def as_origin(given: Any, problem: Conditions) -> Origin:
    """The origin of a problem, given as such or as the object in a file, or a ProblemError."""
    origin: Origin = _parsed(given) if isinstance(given, Mapping) or not hasattr(given, "fits") else given
    if not origin.fits(problem):
        raise ProblemError("origin", "does not yield this M and q", "make the problem again, or leave origin out")
    return origin


def _parsed(given: Any) -> Origin:
    if not isinstance(given, Mapping):
        raise ProblemError("origin", f"is {kind(given)}", "give an object with the key kind")
    if "kind" not in given:
        raise ProblemError("origin.kind", "is missing", f"add one of {', '.join(KINDS)}")
    name = given["kind"]
    if not isinstance(name, str) or name not in KINDS:
        shown = quoted(name) if isinstance(name, str) else kind(name)
        raise ProblemError("origin.kind", f"is {shown}", f"use one of {', '.join(KINDS)}")
    try:
        return KINDS[name](given)
    except ProblemError as error:
        raise ProblemError(f"origin.{error.where}", error.fault, error.hint) from None
