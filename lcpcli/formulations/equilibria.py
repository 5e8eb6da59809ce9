"""Strategies of all players of a game: the gains by best responses, the verification of
proposed strategies, and the check of strategies after a run has solved the problem of a
game.

The check is needed because a payoff that is much larger than all payoffs reached, such
as a penalty for a forbidden move, can make the residual of strategies small that are no
equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.clock import imports, seconds
from lcpcli.errors import SCALE_PAYOFFS, ProblemError
from lcpcli.interrupts import TimeIsUp, deadline_after
from lcpcli.model.formulation import Answer, Formulation
from lcpcli.rational.elimination import Effort
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.verification import Proposed, Verification

# A gain of at most 10 n tol, relative to its terms, is tolerated, as M is rounded.
PER_UNKNOWN = 10
# The tolerance on the sum of probabilities, which may be printed with seven digits.
SUM_TOLERANCE = 1e-6
HINT = "give probabilities, at least 0 and with the sum 1"
EFFORT = 20.0  # limit on exact arithmetic, in seconds that it usually takes
MAX_UNKNOWNS = 60  # the largest game for which all bases are searched exactly
UNSOLVED = "not solved, so there are no strategies"
REASON = "z solves the problem to the tolerance, but its strategies are {}"


class Profile(Answer):
    """Strategies of all players. players : their names. gains : how much each would
    gain by a best response."""

    players: Sequence[str]
    gains: tuple[Any, ...]

    def verdict(self, are_equilibrium: bool | None) -> str:
        """Return a sentence on whether the strategies are an equilibrium, which is None
        if that is not decided, and on what a player would gain."""
        tolerance = "" if isinstance(self.gains[0], Fraction) else " to the tolerance"
        verdicts = {
            True: "an equilibrium",
            False: f"not an equilibrium{tolerance}",
            None: "whether this is an equilibrium is not decided",
        }
        first, *others = zip(self.players, map(_amount, self.gains), strict=True)
        gains = ["{} would gain {}".format(*first)]
        gains += [f"{who} {gain}" for who, gain in others]
        return f"{verdicts[are_equilibrium]}: by a best response {', '.join(gains)}"


def _amount(gain: Any) -> str:
    return "an unknown amount" if math.isnan(gain) else f"{float(gain):.1g}"


class CheckedProfile(NamedTuple):
    """The strategies that z represents, and whether they are an equilibrium to the
    tolerance, by best responses.
    """

    profile: Profile
    are_equilibrium: bool


Reading: TypeAlias = Callable[
    [Any, float], CheckedProfile | None
]  # of z, to a tolerance
Exact: TypeAlias = Callable[[Effort], Sequence[Fraction] | None]


def accepted(game: Formulation, result: Result, reading: Reading) -> Result:
    """Return the result of `checked` for a game whose exact solutions are searched for
    close to z, and then among all bases.
    """
    is_small = result.problem.n <= MAX_UNKNOWNS
    exactly = partial(_exact_solution, game, result) if is_small else None
    return checked(result, reading, exactly)


def _exact_solution(
    game: Formulation, result: Result, effort: Effort
) -> Sequence[Fraction] | None:
    with imports:
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.tree import first_solution
        from lcpcli.verify.exact_solution import from_point
    data = ExactProblem(result.problem, *game.exact_conditions())
    exact_z = from_point(data, result.z, effort)
    return exact_z or first_solution(data, effort.steps(data))


def checked(result: Result, reading: Reading, exactly: Exact | None) -> Result:
    """Return the result of a run that has solved a game, if its strategies, if it has
    any, are an equilibrium to the tolerance. Otherwise return a result of exact
    arithmetic, if the method is `auto`, or the result with the status stalled and the
    gains of the players.

    exactly : a function that returns a z in exact arithmetic, or None if that takes too
        long.
    """
    strategies = reading(result.z, result.tol)
    if strategies is None or strategies.are_equilibrium:
        return result
    began = seconds()
    z = None
    if exactly is not None and result.method == "auto":
        z = _rounded(result, exactly)
    criterion = Criterion(result.problem, result.tol)
    if z is not None and (point := Point(criterion, z)).solves():
        exact = reading(z, result.tol)
        if exact is not None and exact.are_equilibrium:
            parts = {
                **result.parts,
                "verify": result.parts["verify"] + seconds() - began,
            }
            route = (*result.route, "exact")
            return replace(
                result, point=point, route=route, parts=parts, nearest="exact", end=None
            )
    reason = REASON.format(strategies.profile.verdict(False))
    return replace(
        result, status=Status.STALLED, message=Status.STALLED.sentence(reason), end=None
    )


def _rounded(result: Result, exactly: Exact) -> Vector | None:
    """Return a rounded equilibrium of the game with its payoffs as written, or None if
    none is computed in time.
    """
    with imports:
        from lcpcli.verify.exact_solution import finitely_rounded
    z: Sequence[Fraction] | None = None
    with suppress(TimeIsUp), deadline_after(result.limits.time_limit - result.seconds):
        z = exactly(Effort(EFFORT))
    return None if z is None else finitely_rounded(z)


def cells_of(
    players: Sequence[str] = (),
    parts: Sequence[Sequence[Any]] = (),
    payoffs: Sequence[Any] = (),
) -> dict[str, Sequence[Any]]:
    """Return columns of CSV: for each probability, in a part for each player, the
    player, the probability and the player's payoff.
    """
    each = list(zip(players, parts, payoffs, strict=True))
    return {
        "player": [name for name, part, _ in each for _ in part],
        "probability": [p for _, part, _ in each for p in part],
        "payoff": [payoff for _, part, payoff in each for _ in part],
    }


def are_probabilities(values: Any) -> bool:
    return bool(min(values) >= 0 and abs(values.sum() - 1) <= SUM_TOLERANCE)


def with_strategies(
    verification: Verification, profile: Profile, are_equilibrium: bool
) -> Verification:
    """Return the verification of a z with the strategies that it represents; it is
    accepted only if these are an equilibrium too.
    """
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
    """Return the verification of strategies by that of the z that represents them.

    divided : a remark on a division of the strategies by their sums.
    """
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
