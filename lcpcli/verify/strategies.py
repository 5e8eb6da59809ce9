"""Strategies as a proposed solution of a game: the z that they stand for, and its verification.

The components of z that belong to a player are its probabilities divided by what a best response costs the other one.
A z whose two parts are nonnegative and each add up to 1 is read as strategies: it solves the LCP only if these costs
are 1, where both readings are the same. For a game tree, strategies are the probabilities of the actions at all
information sets, and z has their plans.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import ProblemError, count
from lcpcli.games.behavior import Behavior, Strategies, allowance, point_of
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import approximate, rounded
from lcpcli.typing import Vector
from lcpcli.verify.verification import Verification

SUM_TOLERANCE = 1e-6  # by how much probabilities may miss the sum 1, as those do that are printed with seven digits
HINT = "give probabilities, at least 0 and with the sum 1"


def require_strategies(problem: Problem, values: Sequence[Any], rows: int) -> None:
    """Raise ProblemError if these values, the first `rows` for the row player, are not strategies of the game."""
    game = problem.origin
    if not isinstance(game, Game):
        raise ProblemError("row", "is a strategy, but the problem is not a game", "give z")
    parts = values[:rows], values[rows:]
    for player, part, size in zip(("row", "column"), parts, game.A.shape, strict=True):
        if len(part) != size:
            raise ProblemError(player, f"has {count(len(part), 'entry')} for {size} strategies", "make them agree")
        if not _are_probabilities(rounded(part)):
            fault = f"has the sum {approximate(sum(part, Fraction(0)))}" if min(part) >= 0 else "has a negative entry"
            raise ProblemError(player, fault, HINT)


class Found(NamedTuple):
    """The strategies that z stands for, and whether they are an equilibrium to the tolerance, by best responses."""

    own: Strategies | Behavior
    are_equilibrium: bool


@np.errstate(all="ignore")
def of_solution(problem: Problem, z: Sequence[Any] | Vector, tol: float) -> Found | None:
    """Return the strategies that a z of a game stands for, in its numbers; None if it stands for none."""
    game, allowed = problem.origin, allowance(problem.n, tol)
    if isinstance(game, ExtensiveGame):
        x, y, *_ = game.parts(z.tolist() if isinstance(z, np.ndarray) else z)
        if min(*x, *y) < 0 or not (x[0] and y[0]):
            return None
        plans = Behavior.of_plans(game, x, y)
        return Found(plans, plans.are_best(game, allowed))
    if not isinstance(game, Game) or any(min(part) < 0 or not 0 < part.sum() < np.inf for part in game.parts(z)):
        return None
    own = Strategies.of(game, *(part / part.sum() for part in game.parts(z)))
    return Found(own, own.are_best(game, allowed))


@np.errstate(all="ignore")  # overflow counts as infinite
def verified(
    problem: Problem,
    values: Sequence[Any] | Vector,
    verify: Callable[[Any], Verification],
    *,
    tol: float = 0.0,
    data: ExactProblem | None = None,
) -> Verification:
    """Verify z, or the z of strategies, by `verify`, and say what these are for the game behind the problem, if any:
    a z is then accepted if they are an equilibrium too. In exact arithmetic where there are exact data."""
    game, divided = problem.origin, ""
    array: Any = np.array(values, dtype=float if data is None else object)
    if isinstance(game, ExtensiveGame) and array.size != problem.n:
        behavior = _behavior(game, values)
        own, are_equilibrium = Found(behavior, behavior.are_best(game, allowance(problem.n, tol)))
        z = point_of(game, *behavior.plans)
    else:
        if (found := of_solution(problem, array, tol)) is None:
            return verify(values)
        own, are_equilibrium = found
        given = game.parts(array) if isinstance(game, Game) else ()
        if not (isinstance(own, Strategies) and all(map(_are_probabilities, given))):
            verification = verify(values)
            accepted = verification.accepted and are_equilibrium
            joint = "; as strategies, " if accepted or not verification.accepted else ", but as strategies, "
            message = f"{verification.message}{joint}{own.statement(are_equilibrium)}"
            return replace(verification, accepted=accepted, message=message, strategies=own)
        rounding = ROW_ROUNDING if data is None else 0
        divided = ", divided by their sums," * any(abs(part.sum() - 1) > rounding for part in given)
        z = point_of_game(problem, np.concatenate((own.row, own.column)), data).tolist()
    if data is None and not np.isfinite(z).all():
        raise ProblemError("z", "of these strategies exceeds the double-precision range", "scale the payoffs")
    verification = verify(np.array(z, dtype=float) if data is None else list(map(Fraction, z)))
    accepted = verification.accepted and are_equilibrium
    message = f"the strategies{divided} are {own.statement(accepted)}; their {verification.message}"
    return replace(verification, accepted=accepted, message=message, strategies=own)


def point_of_game(problem: Problem, both: Any, data: ExactProblem | None) -> Any:
    """Return the z of both players' strategies, each divided by the other's best cost; exact for exact data."""
    costs = problem.M @ both if data is None else np.array(data.w(both.tolist()), dtype=object) + 1  # as q = -1
    game = problem.origin
    assert isinstance(game, Game)
    (x, y), (by_row, by_column) = game.parts(both), game.parts(costs)
    return np.concatenate((x / min(by_column), y / min(by_row)))


def _behavior(game: ExtensiveGame, values: Sequence[Any] | Vector) -> Behavior:
    """Return the strategies with these probabilities of all actions, divided by their sums, or raise ProblemError."""
    left, found = iter(values), list[list[list[Any]]]()
    for player in game.tree.players:
        given = [[next(left) for _ in each.actions] for each in player.sets]
        for label, probabilities in zip(player.labels(), given, strict=True):
            if not _are_probabilities(np.array(probabilities, dtype=float)):
                fault = f"has {', '.join(f'{float(p):.7g}' for p in probabilities)} as the probabilities of its actions"
                raise ProblemError(f"information set {label} of {player.name}", fault, HINT)
        found.append([[p / sum(each) for p in each] for each in given])
    return Behavior.of(game, found)


def _are_probabilities(values: Any) -> bool:
    return bool(min(values) >= 0 and abs(values.sum() - 1) <= SUM_TOLERANCE)
