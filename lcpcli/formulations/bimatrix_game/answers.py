"""The mixed strategies that a z represents, verified by best responses.

The components of z that belong to a player are its probabilities divided by the cost of
a best response of the other player. A z whose two parts are nonnegative and have the
sum 1 each is read as strategies: it solves the LCP only if these costs are 1, where
both readings agree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import MAKE_AGREE, ProblemError, count
from lcpcli.formulations import equilibria
from lcpcli.formulations.bimatrix_game.game import Game
from lcpcli.formulations.bimatrix_game.strategies import (
    PLAYERS,
    Strategies,
    lines_of,
    strategies_at,
)
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.formulation import Answer
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import approximate, brief, rounded
from lcpcli.report import wording
from lcpcli.solving.result import Result
from lcpcli.typing import Vector
from lcpcli.verify.verification import Proposed, Verification


@dataclass(frozen=True, eq=False)
class Equilibrium(Answer):
    """The equilibrium that a solution of the LCP represents.

    row, column : the mixed strategies, probabilities in the order of the game's rows
        and columns; None, as are payoffs and gains, if the LCP is not solved.
    payoffs : the expected payoffs of the row and the column player, in the scale of A
        and B.
    gains : how much each player would gain by a best response to the other, computed
        from A and B; 0 if the gain is at the level of rounding errors.
    statement : whether the strategies are an equilibrium.
    exact : row and column as fractions if z is proved, else None.
    """

    game: Game = field(repr=False)
    row: Vector | None
    column: Vector | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None

    def lines(self) -> list[str]:
        if self.row is None:
            return [self.statement]
        exact = self.exact or {}
        return [
            ", ".join(lines_of(self.game, self)),
            self.statement,
            *(
                f"exact {player} = {wording.vector(part, brief)}"
                for player, part in exact.items()
            ),
        ]

    def cells(self) -> Mapping[str, Sequence[Any]]:
        if self.row is None:
            return equilibria.cells_of()
        exact = self.exact or {}
        row, column = (
            np.array(exact.get(player, getattr(self, player))) for player in PLAYERS
        )
        payoffs = Strategies.of(self.game, row, column).payoffs
        return equilibria.cells_of(PLAYERS, (row.tolist(), column.tolist()), payoffs)


def answer(game: Game, result: Result) -> Equilibrium:
    """Return strategies, payoffs and gains if the result is solved, and whether the
    strategies are an equilibrium."""
    reading = strategies_of(game, result.z, result.tol) if result.solved else None
    if reading is None:
        return Equilibrium(game, None, None, None, None, equilibria.UNSOLVED)
    profile: Any = reading.profile
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = game.parts(result.exact.z)
        exact = {
            name: [value / sum(part) for value in part]
            for name, part in zip(PLAYERS, parts, strict=True)
        }
    return Equilibrium(
        game,
        profile.row,
        profile.column,
        profile.payoffs,
        profile.gains,
        profile.verdict(reading.are_equilibrium),
        exact,
    )


@np.errstate(all="ignore")
def strategies_of(game: Game, z: Any, tol: float) -> equilibria.CheckedProfile | None:
    """Return the strategies that z represents, in its numbers; None if it represents
    none.
    """
    strategies = strategies_at(game, z)
    return (
        None
        if strategies is None
        else equilibria.CheckedProfile(strategies, strategies.are_best(tol))
    )


def accepted(game: Game, result: Result) -> Result:
    return equilibria.checked(
        result, partial(strategies_of, game), partial(_exact, result, game)
    )


def _exact(result: Result, game: Game, effort: Effort) -> Any:
    """Return the exact z of an equilibrium that the method of Lemke and Howson finds,
    or None."""
    with imports:
        from lcpcli.rational import pivoting
    problem = result.problem
    data = ExactProblem(problem, *game.exact_conditions())
    z = pivoting.equilibrium(data, game.A.shape[0], effort)
    if z is None:
        return None
    return _point_of(game, problem, np.array(z), data).tolist()


def joined(game: Game, parts: Mapping[str, Sequence[Fraction]]) -> list[Fraction]:
    """Return the strategies of both players one after the other; raise ProblemError if
    they are no probabilities.
    """
    values: list[Fraction] = []
    for player, size in zip(PLAYERS, game.A.shape, strict=True):
        part = parts[player]
        if len(part) != size:
            reason = f"has {count(len(part), 'entry')} for {size} strategies"
            raise ProblemError(player, reason, MAKE_AGREE)
        if not equilibria.are_probabilities(rounded(part)):
            reason = (
                f"has the sum {approximate(sum(part, Fraction(0)))}"
                if min(part) >= 0
                else "has a negative entry"
            )
            raise ProblemError(player, reason, equilibria.HINT)
        values += part
    return values


@np.errstate(all="ignore")  # overflow gives infinity
def verified(game: Game, proposed: Proposed) -> Verification:
    """Verify z, or strategies: a z whose two parts are nonnegative and have the sum 1
    each.
    """
    profile = strategies_at(game, proposed.array)
    if profile is None:
        return proposed.of_z(proposed.values)
    are_equilibrium = profile.are_best(proposed.tol)
    parts = game.parts(proposed.array)
    if not all(map(equilibria.are_probabilities, parts)):
        verification = proposed.of_z(proposed.values)
        return equilibria.with_strategies(verification, profile, are_equilibrium)
    rounding = ROW_ROUNDING if proposed.data is None else 0
    is_divided = any(abs(part.sum() - 1) > rounding for part in parts)
    divided = ", divided by their sums," if is_divided else ""
    both = np.concatenate((profile.row, profile.column))
    z = _point_of(game, proposed.problem, both, proposed.data).tolist()
    return equilibria.of_strategies(proposed, z, profile, are_equilibrium, divided)


def _point_of(
    game: Game, problem: Problem, both: Any, data: ExactProblem | None
) -> Any:
    """Return the z of both players' strategies: each divided by the other player's best
    cost; exact for exact data.
    """
    costs = (
        problem.M @ both
        if data is None
        else np.array(data.w(both.tolist()), dtype=object) + 1
    )  # as q = -1
    (x, y), (by_row, by_column) = game.parts(both), game.parts(costs)
    return np.concatenate((x / min(by_column), y / min(by_row)))
