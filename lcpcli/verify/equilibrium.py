"""Equilibria of games: what a best response to strategies would gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.origins import Game
from lcpcli.typing import Vector


@dataclass(frozen=True, eq=False)
class Strategies:
    """A pair of mixed strategies of a game: the probabilities, the payoffs, and how much each player would gain by a
    best response to the other, 0 if that is only rounding; all doubles, or all fractions."""

    row: Vector
    column: Vector
    payoffs: tuple[Any, ...]
    gains: tuple[Any, ...]
    players: Sequence[str] = ("the row player", "the column player")

    @classmethod
    def of(cls, game: Game, x: Vector, y: Vector) -> Strategies:
        """Return the strategies x, y of a game: doubles, with payoffs as doubles, or fractions in arrays of objects,
        with payoffs as written."""
        exact = x.dtype == object
        number: Any = Fraction if exact else float
        A, B = (np.array(own, dtype=object) for own in game.payoffs()) if exact else (game.A, game.B)
        by_row, by_column = A @ y, x @ B
        row, column = number(x @ by_row), number(by_column @ y)
        gains = number(by_row.max()) - row, number(by_column.max()) - column
        rounding = (0.0, 0.0) if exact else tuple(ROW_ROUNDING * terms for terms in _terms(game, x, y, (0.0, 0.0)))
        by_best = (gain if gain > least else number(0) for gain, least in zip(gains, rounding, strict=True))
        return cls(x, y, (row, column), tuple(by_best), game.players or cls.players)

    def are_best(self, game: Game, allowed: float) -> bool:
        """Return whether neither player gains more than the fraction `allowed` of the terms of its gain, among which
        payoffs that are not met do not count."""
        terms = _terms(game, self.row.astype(float), self.column.astype(float), self.payoffs)
        return all(gain <= allowed * size for gain, size in zip(self.gains, terms, strict=True))

    def statement(self, are_equilibrium: bool) -> str:
        """Return a sentence on whether the strategies are an equilibrium, and on what a player would gain."""
        return statement(are_equilibrium, self.gains, self.players)


def statement(are_equilibrium: bool, gains: Sequence[Any], names: Sequence[str]) -> str:
    """Return a sentence on whether strategies are an equilibrium, and on what players of these names would gain."""
    tolerance = "" if isinstance(gains[0], Fraction) else " to the tolerance"
    found = "an equilibrium" if are_equilibrium else f"not an equilibrium{tolerance}"
    one, other = map(float, gains)
    return f"{found}: by a best response {names[0]} would gain {one:.1g}, {names[1]} {other:.1g}"


def _terms(game: Game, x: Vector, y: Vector, centres: Sequence[Any]) -> tuple[float, float]:
    """Return for each player the terms of its gain: the sizes of the differences of payoffs from a centre, in its own
    mixture and in its best response."""
    found = []
    for A, own, other, centre in ((game.A, x, y, centres[0]), (game.B.T, y, x, centres[1])):
        sizes = np.abs(A - float(centre)) @ other
        found.append(float(own @ sizes + sizes[np.argmax(A @ other)]))
    return found[0], found[1]


def allowance(n: int, tol: float) -> float:
    """Return the largest gain that counts as none, relative to its terms, as payoffs are rounded in M."""
    return 10 * n * tol
