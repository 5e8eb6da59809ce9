"""Mixed strategies of a game of two players: what a best response to them would
gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.games.profile import PER_UNKNOWN, Profile
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.origins import Game
from lcpcli.typing import Vector


@dataclass(frozen=True, eq=False)
class Strategies(Profile):
    """A pair of mixed strategies of a game: the probabilities, the payoffs, and how
    much each player would gain by a best response to the other, 0 if that is only
    rounding; all doubles, or all fractions."""

    row: Vector
    column: Vector
    payoffs: tuple[Any, ...]
    gains: tuple[Any, ...]
    players: Sequence[str] = ("the row player", "the column player")

    @classmethod
    def of(cls, game: Game, x: Vector, y: Vector) -> Strategies:
        """Return the strategies x, y of a game: doubles, or fractions in arrays of
        objects, with payoffs as written."""
        exact = x.dtype == object
        number: Any = Fraction if exact else float
        A, B = (
            (np.array(own, dtype=object) for own in game.payoffs())
            if exact
            else (game.A, game.B)
        )
        by_row, by_column = A @ y, x @ B
        row, column = number(x @ by_row), number(by_column @ y)
        gains = number(by_row.max()) - row, number(by_column.max()) - column
        rounding = (
            (0.0, 0.0)
            if exact
            else tuple(ROW_ROUNDING * terms for terms in _terms(game, x, y, (0.0, 0.0)))
        )
        by_best = (
            gain if gain > least else number(0)
            for gain, least in zip(gains, rounding, strict=True)
        )
        return cls(x, y, (row, column), tuple(by_best), game.players or cls.players)

    def are_best(self, game: Game, tol: float) -> bool:
        """Return whether no player gains more than is allowed of the terms of its gain,
        of payoffs that are met."""
        allowed = PER_UNKNOWN * sum(game.A.shape) * tol
        terms = _terms(
            game, self.row.astype(float), self.column.astype(float), self.payoffs
        )
        return all(
            gain <= allowed * size for gain, size in zip(self.gains, terms, strict=True)
        )


def _terms(
    game: Game, x: Vector, y: Vector, centres: Sequence[Any]
) -> tuple[float, float]:
    """Return each player's terms of its gain: sizes of payoffs less a centre, in its
    mixture and its best response."""
    found = []
    for A, own, other, centre in (
        (game.A, x, y, centres[0]),
        (game.B.T, y, x, centres[1]),
    ):
        sizes = np.abs(A - float(centre)) @ other
        found.append(float(own @ sizes + sizes[np.argmax(A @ other)]))
    return found[0], found[1]
