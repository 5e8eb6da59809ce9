"""Strategies of all players of a game, and what a best response to them would gain."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from lcpcli.model.formulation import Answer

# Times n tol: the largest gain, relative to its terms, that counts as none, as M is
# rounded.
PER_UNKNOWN = 10


class Profile(Answer):
    """Strategies of all players. players : their names. gains : how much each would
    gain by a best response."""

    players: Sequence[str]
    gains: tuple[Any, ...]

    def verdict(self, are_equilibrium: bool) -> str:
        """Return a sentence on whether the strategies are an equilibrium, and on what a
        player would gain."""
        tolerance = "" if isinstance(self.gains[0], Fraction) else " to the tolerance"
        found = (
            "an equilibrium" if are_equilibrium else f"not an equilibrium{tolerance}"
        )
        one, other = map(float, self.gains)
        return (
            f"{found}: by a best response {self.players[0]} would gain {one:.1g}, "
            f"{self.players[1]} {other:.1g}"
        )
