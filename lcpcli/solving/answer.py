"""What a result means for the origin of its problem: a minimum of a program, an equilibrium of a game."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from lcpcli.typing import Vector


@dataclass(frozen=True, eq=False)
class Minimum:
    """What a solution of the LCP says about min x'Qx / 2 + c'x, Ax >= b, x >= 0 except for the free x_i.

    x, y, objective : the point, the multipliers y >= 0 of Ax >= b, and its value; None if the LCP is not solved.
    statement : what x is, or what it means that there is no solution.
    exact : x and y as fractions if they are proved, else None.
    """

    x: Vector | None
    y: Vector | None
    objective: float | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What a solution of the LCP says about the game.

    row, column : the mixed strategies, probabilities in the order of the game's rows and columns; None, as
        are the others, if the LCP is not solved.
    payoffs : the expected payoffs of the row and the column player, in the game's units.
    gains : how much each of them would gain by a best response to the other, computed from A and B; 0 if that is
        only rounding.
    statement : whether the strategies are an equilibrium.
    exact : row and column as fractions if z is proved, else None.
    """

    row: Vector | None
    column: Vector | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


Answer: TypeAlias = Minimum | Equilibrium
