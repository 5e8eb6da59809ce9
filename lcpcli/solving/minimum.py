"""What results mean for the game from which their problem was made."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.model.formulation import Answer
from lcpcli.model.origins import Game
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving import equilibria
from lcpcli.solving.result import Result
from lcpcli.typing import Vector
from lcpcli.verify.equilibria import point_of_game, strategies_at

WORDS = {"min": "minimizer", "max": "maximizer"}
DEFINITE = {"min": "positive", "max": "negative"}
PLAYERS = "row", "column"


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What a solution of the LCP says about the game.

    row, column : the mixed strategies, probabilities in the order of the game's rows
        and columns; None, as are payoffs and gains, if the LCP is not solved.
    payoffs : the expected payoffs of the row and the column player, in the game's
        units.
    gains : how much each player would gain by a best response to the other, computed
        from A and B; 0 if the gain is only rounding error.
    statement : whether the strategies are an equilibrium.
    exact : row and column as fractions if z is proved, else None.
    """

    row: Vector | None
    column: Vector | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


def answer(result: Result) -> Answer | Equilibrium | None:
    """Return what a result means for the origin of its problem; None for a problem
    without origin."""
    origin = result.problem.origin
    if isinstance(origin, Game):
        return equilibrium(result, origin)
    return result.problem.formulation.answer(result)


def equilibrium(result: Result, game: Game) -> Equilibrium:
    """Return strategies, payoffs and gains if the result is solved, and whether the
    strategies are an equilibrium."""
    found = strategies_of(game, result.z, result.tol) if result.solved else None
    if found is None:
        return Equilibrium(None, None, None, None, equilibria.UNSOLVED)
    own: Any = found.profile
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = game.parts(result.exact.z)
        exact = {
            name: [value / sum(part) for value in part]
            for name, part in zip(PLAYERS, parts, strict=True)
        }
    return Equilibrium(
        own.row,
        own.column,
        own.payoffs,
        own.gains,
        own.verdict(found.are_equilibrium),
        exact,
    )


@np.errstate(all="ignore")
def strategies_of(game: Game, z: Any, tol: float) -> equilibria.Found | None:
    """Return the strategies that z stands for, in its numbers; None if it stands for
    none."""
    found = strategies_at(game, z)
    return None if found is None else equilibria.Found(found, found.are_best(game, tol))


def accepted(result: Result, game: Game) -> Result:
    return equilibria.checked(
        result, partial(strategies_of, game), partial(_exact, result, game)
    )


def _exact(result: Result, game: Game, effort: Effort) -> Any:
    with imports:
        from lcpcli.rational import pivoting
    problem = result.problem
    data = ExactProblem(problem, *game.exact_conditions())
    found = pivoting.equilibrium(data, game.A.shape[0], effort)
    if found is None:
        return None
    return point_of_game(problem, np.array(found), data).tolist()
