"""The names of the unknowns of a problem that comes from neither a program nor a game."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lcpcli.errors import ProblemError
from lcpcli.model.reductions.program import names_of

if TYPE_CHECKING:
    from lcpcli.model.reductions.program import Conditions


@dataclass(frozen=True)
class OwnNames:
    """What the unknowns are called, for tables and CSV."""

    texts: tuple[str, ...]

    def data(self) -> dict[str, Any]:
        return {"kind": "names", "names": list(self.texts)}

    def fits(self, given: Conditions) -> bool:
        """Whether there are as many names as unknowns."""
        return len(self.texts) == given.q.size

    def names(self, n: int) -> Sequence[str]:  # noqa: ARG002 (as in every origin)
        """The names of the components of z."""
        return self.texts


def own_names(given: Sequence[str], n: int, origin: Any) -> OwnNames:
    """The names of n unknowns that come from no program or game, or a ProblemError."""
    if origin is not None:
        raise ProblemError("names", "is given beside origin, which has names", "leave one out")
    return OwnNames(names_of("names", given, n, "unknown"))
