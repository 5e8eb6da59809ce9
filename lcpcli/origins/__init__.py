"""Where an LCP comes from, as far as it takes to map its solution back. One kind of origin, one module.

In files an origin is an object with the key kind, one of KINDS, and what that kind needs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from lcpcli.errors import ProblemError, quoted
from lcpcli.origins.game import Equilibrium, Game
from lcpcli.origins.qp import Minimum, QuadraticProgram
from lcpcli.problem import kind
from lcpcli.typing import Matrix, Vector

if TYPE_CHECKING:
    from lcpcli.result import Result

Answer: TypeAlias = Minimum | Equilibrium


class Origin(Protocol):
    """What a kind of origin offers."""

    def data(self) -> dict[str, Any]:
        """What a file holds of it, in lists, numbers and texts; `as_origin` reads it back."""

    def fits(self, M: Matrix, q: Vector, /) -> bool:
        """Whether M, of shape (n, n), and q are what this origin leads to."""

    def answer(self, result: Result, /) -> Answer:
        """What a result on the LCP means for the origin."""


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
        told = quoted(name) if isinstance(name, str) else kind(name)
        raise ProblemError("origin.kind", f"is {told}", f"use one of {', '.join(KINDS)}")
    try:
        return KINDS[name](given)
    except ProblemError as error:
        raise ProblemError(f"origin.{error.where}", error.fault, error.mend) from None
