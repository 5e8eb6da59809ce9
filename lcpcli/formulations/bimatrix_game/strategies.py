"""Mixed strategies of a two-player game, and the gains by best responses to them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.formulations.bimatrix_game.game import Game
from lcpcli.formulations.equilibria import PER_UNKNOWN, Profile
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.report import wording
from lcpcli.typing import Vector

PLAYERS = "row", "column"


@dataclass(frozen=True, eq=False)
class Strategies(Profile):
    """A pair of mixed strategies of a game: the probabilities, the payoffs, and how
    much each player would gain by a best response to the other, 0 if that is at the
    level of rounding errors; all floats, or all fractions.
    """

    row: Vector
    column: Vector
    payoffs: tuple[Any, ...]
    gains: tuple[Any, ...]
    players: Sequence[str]
    game: Game = field(repr=False)

    def lines(self) -> list[str]:
        return [", ".join(lines_of(self.game, self, wording.number))]

    @classmethod
    def of(cls, game: Game, x: Vector, y: Vector) -> Strategies:
        """Return the strategies x, y of a game: floats, or fractions in arrays of
        objects, with payoffs as written.
        """
        exact = x.dtype == object
        number: Any = Fraction if exact else float
        A, B = (
            (np.array(matrix, dtype=object) for matrix in game.payoffs())
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
            gain if gain > smallest else number(0)
            for gain, smallest in zip(gains, rounding, strict=True)
        )
        players = game.players or ("the row player", "the column player")
        return cls(x, y, (row, column), tuple(by_best), players, game)

    def are_best(self, tol: float) -> bool:
        """Return whether no player gains more than the tolerance times the terms of its
        gain, which are measured from its payoff: a payoff that is never reached does
        not count.
        """
        allowed = PER_UNKNOWN * sum(self.game.A.shape) * tol
        doubles = self.row.astype(float), self.column.astype(float)
        terms = _terms(self.game, *doubles, self.payoffs)
        return all(
            gain <= allowed * size for gain, size in zip(self.gains, terms, strict=True)
        )


def _terms(
    game: Game, x: Vector, y: Vector, centres: Sequence[Any]
) -> tuple[float, float]:
    """Return the sizes of the terms of each player's gain: |payoff - centre| in its
    mixed strategy and in its best response.
    """
    terms = []
    for A, strategy, other, centre in (
        (game.A, x, y, centres[0]),
        (game.B.T, y, x, centres[1]),
    ):
        sizes = np.abs(A - float(centre)) @ other
        terms.append(float(strategy @ sizes + sizes[np.argmax(A @ other)]))
    return terms[0], terms[1]


@np.errstate(all="ignore")
def strategies_at(game: Game, z: Any) -> Strategies | None:
    """Return the strategies that z represents, in its numbers; None if it represents
    none.
    """
    parts = game.parts(z)
    if any(min(part) < 0 or not 0 < part.sum() < np.inf for part in parts):
        return None
    return Strategies.of(game, *(part / part.sum() for part in parts))


def lines_of(
    game: Any, profile: Any, cell: Callable[[Any], str] = wording.plain_number
) -> list[str]:
    """Return lines with the mixed strategies row and column, as vectors or by the names
    of the strategies played, and with the payoffs."""
    one, other = game.players or PLAYERS
    row = wording.named(list(profile.row), game.rows, cell, sparing=True)
    column = wording.named(list(profile.column), game.columns, cell, sparing=True)
    return [
        f"{one} = {row}",
        f"{other} = {column}",
        f"payoffs {cell(profile.payoffs[0])} and {cell(profile.payoffs[1])}",
    ]


def names_of(game: Game, max_width: float = math.inf) -> list[str]:
    """Return the names of all strategies, by `short_names` with the letters x and y; a
    name that both players have is preceded by that of the player.
    """
    both = set(game.rows) & set(game.columns)
    players = game.players or ("row", "column" if max_width == math.inf else "col")
    max_width += (len(players[0]) + 1) * bool(both)
    names_of_both = []
    for player, letter, names_of_player, size in zip(
        players, "xy", (game.rows, game.columns), game.A.shape, strict=True
    ):
        names = [
            f"{player} {name}" if name in both else name for name in names_of_player
        ]
        names_of_both += wording.short_names(names or [""] * size, max_width, letter)
    return names_of_both


def payoff_headings(game: Game) -> list[str]:
    return [f"{player} gets" for player in game.players or PLAYERS]
