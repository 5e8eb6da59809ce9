"""How strategies that are proposed for a game are verified.

They stand for a z: the components of z that belong to a player are its probabilities
divided by what a best response costs the other one. A z whose two parts are nonnegative
and each add up to 1 is read as strategies: it solves the LCP only if these costs are 1,
where both readings are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.errors import MAKE_AGREE, SCALE_PAYOFFS, ProblemError, count
from lcpcli.games.behavior import Strategies
from lcpcli.games.profile import Profile
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import approximate, rounded
from lcpcli.verify.verification import Proposed, Verification

# By how much probabilities may miss the sum 1, as those do that are printed with seven
# digits.
SUM_TOLERANCE = 1e-6
HINT = "give probabilities, at least 0 and with the sum 1"


def are_probabilities(values: Any) -> bool:
    return bool(min(values) >= 0 and abs(values.sum() - 1) <= SUM_TOLERANCE)


def with_strategies(
    verification: Verification, profile: Profile, are_equilibrium: bool
) -> Verification:
    """Return the verification of a z, accepted if the strategies for which it stands
    are an equilibrium too, and what these are."""
    accepted = verification.accepted and are_equilibrium
    joint = (
        "; as strategies, "
        if accepted or not verification.accepted
        else ", but as strategies, "
    )
    message = f"{verification.message}{joint}{profile.verdict(are_equilibrium)}"
    return replace(verification, accepted=accepted, message=message, strategies=profile)


def of_strategies(
    proposed: Proposed,
    z: Any,
    profile: Profile,
    are_equilibrium: bool,
    divided: str = "",
) -> Verification:
    """Return the verification of strategies by that of the z that stands for them.
    divided : a remark on what was done to them."""
    if proposed.data is None and not np.isfinite(z).all():
        raise ProblemError(
            "z",
            "of these strategies exceeds the double-precision range",
            SCALE_PAYOFFS,
        )
    verification = proposed.of_z(
        np.array(z, dtype=float) if proposed.data is None else list(map(Fraction, z))
    )
    accepted = verification.accepted and are_equilibrium
    message = (
        f"the strategies{divided} are {profile.verdict(accepted)}; their "
        f"{verification.message}"
    )
    return replace(verification, accepted=accepted, message=message, strategies=profile)


def require_strategies(problem: Problem, values: Sequence[Any], rows: int) -> None:
    """Raise ProblemError if these values, the first `rows` for the row player, are not
    strategies of the game."""
    game = problem.origin
    if not isinstance(game, Game):
        raise ProblemError(
            "row", "is a strategy, but the problem is not a game", "give z"
        )
    parts = values[:rows], values[rows:]
    for player, part, size in zip(("row", "column"), parts, game.A.shape, strict=True):
        if len(part) != size:
            raise ProblemError(
                player,
                f"has {count(len(part), 'entry')} for {size} strategies",
                MAKE_AGREE,
            )
        if not are_probabilities(rounded(part)):
            fault = (
                f"has the sum {approximate(sum(part, Fraction(0)))}"
                if min(part) >= 0
                else "has a negative entry"
            )
            raise ProblemError(player, fault, HINT)


@np.errstate(all="ignore")
def strategies_at(game: Game, z: Any) -> Strategies | None:
    """Return the strategies that z stands for, in its numbers; None if it stands for
    none."""
    parts = game.parts(z)
    if any(min(part) < 0 or not 0 < part.sum() < np.inf for part in parts):
        return None
    return Strategies.of(game, *(part / part.sum() for part in parts))


@np.errstate(all="ignore")  # overflow counts as infinite
def of_game(game: Game, proposed: Proposed) -> Verification:
    """Verify z, or the z of strategies, which a z is whose two parts are nonnegative
    and each add up to 1."""
    profile = strategies_at(game, proposed.array)
    if profile is None:
        return proposed.of_z(proposed.values)
    are_equilibrium = profile.are_best(game, proposed.tol)
    given = game.parts(proposed.array)
    if not all(map(are_probabilities, given)):
        verification = proposed.of_z(proposed.values)
        return with_strategies(verification, profile, are_equilibrium)
    rounding = ROW_ROUNDING if proposed.data is None else 0
    is_divided = any(abs(part.sum() - 1) > rounding for part in given)
    divided = ", divided by their sums," * is_divided
    both = np.concatenate((profile.row, profile.column))
    z = point_of_game(proposed.problem, both, proposed.data).tolist()
    return of_strategies(proposed, z, profile, are_equilibrium, divided)


def point_of_game(problem: Problem, both: Any, data: ExactProblem | None) -> Any:
    """Return the z of both players' strategies, each divided by the other's best cost;
    exact for exact data."""
    costs = (
        problem.M @ both
        if data is None
        else np.array(data.w(both.tolist()), dtype=object) + 1
    )  # as q = -1
    game = problem.origin
    assert isinstance(game, Game)
    (x, y), (by_row, by_column) = game.parts(both), game.parts(costs)
    return np.concatenate((x / min(by_column), y / min(by_row)))
