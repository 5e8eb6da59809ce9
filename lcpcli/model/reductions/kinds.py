"""The kinds of problems that are solved as LCPs, by name. In files the origin of an LCP is an object with the key kind.

An origin holds data only: what it takes to map a solution of the LCP back. What a result means for it, solving/ tells.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from lcpcli.errors import ProblemError, kind, quoted
from lcpcli.model.reductions.game import Game
from lcpcli.model.reductions.quadratic_program import QuadraticProgram
from lcpcli.typing import Matrix, Vector


class Origin(Protocol):
    """What a kind of origin offers."""

    def data(self) -> dict[str, Any]:
        """What a file holds of it, in lists, numbers and texts; `as_origin` reads it back."""

    def fits(self, M: Matrix, q: Vector, /) -> bool:
        """Whether M, of shape (n, n), and q are what this origin leads to."""


KINDS: dict[str, Callable[[Mapping[str, Any]], Origin]] = {"qp": QuadraticProgram.parse, "game": Game.parse}


def as_origin(given: Any, M: Matrix, q: Vector) -> Origin:
    """The origin of the LCP of M and q, from the object in a file or as it is, or a ProblemError."""
    origin: Origin = _parsed(given) if isinstance(given, Mapping) or not hasattr(given, "fits") else given
    if not origin.fits(M, q):
        raise ProblemError("origin", "does not lead to this M and q", "make the problem again, or leave origin out")
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
        raise ProblemError(f"origin.{error.where}", error.fault, error.mend) from None
