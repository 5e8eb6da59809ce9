"""What a result can mean for the origin of its problem: the minimum of a program, the equilibrium of a game."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

from lcpcli.typing import Vector


@dataclass(frozen=True, eq=False)
class Minimum:
    """What a solution of the LCP says of min x'Qx / 2 + c'x, Ax >= b, x >= 0 but for the free x_i.

    x, y, objective : the point, the multipliers y >= 0 of Ax >= b, and the value there; None where it is not solved.
    statement : what x is, or what it means that there is no solution.
    exact : x and y as fractions where they are proved, else None.
    """

    x: Vector | None
    y: Vector | None
    objective: float | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What a solution of the LCP says of the game.

    row, column : the mixed strategies, probabilities in the order of the game's rows and columns; None where it is not
        solved, and so are the others.
    payoffs : what the row and the column player may expect, in the game's units.
    gains : how much more either of them would get by the best response to the other, computed from A and B; 0 where
        that is no more than rounding.
    statement : whether the strategies are an equilibrium.
    exact : row and column as fractions where z is proved, else None.
    """

    row: Vector | None
    column: Vector | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


Answer: TypeAlias = Minimum | Equilibrium
