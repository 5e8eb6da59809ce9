"""The check of strategies by best responses, after a run has solved the problem of a
game: a payoff that is far larger than all that are reached, as a penalty for a
forbidden move, makes the residual of strategies small that are no equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple, TypeAlias

from lcpcli.clock import imports, seconds
from lcpcli.games.profile import Profile
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.rational.elimination import Effort
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

EFFORT = 20.0  # seconds of exact arithmetic, counted as work
UNSOLVED = "not solved, so there are no strategies"
REASON = "z solves the problem to the tolerance, but its strategies are {}"


class Found(NamedTuple):
    """The strategies that z stands for, and whether they are an equilibrium to the
    tolerance, by best responses."""

    profile: Profile
    are_equilibrium: bool


Reading: TypeAlias = Callable[[Any, float], Found | None]  # of z, to a tolerance
Exact: TypeAlias = Callable[[Effort], Sequence[Fraction] | None]


def checked(result: Result, reading: Reading, exactly: Exact | None) -> Result:
    """Return the result of a run that has solved a game, if its strategies, if it has
    any, are an equilibrium to the tolerance; else one of exact arithmetic by `auto`, or
    one that is stalled and says what the players would gain. exactly : finds a z in
    exact arithmetic; None if that takes too long."""
    found = reading(result.z, result.tol)
    if found is None or found.are_equilibrium:
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
    reason = REASON.format(found.profile.verdict(False))
    return replace(
        result, status=Status.STALLED, message=Status.STALLED.sentence(reason), end=None
    )


def _rounded(result: Result, exactly: Exact) -> Vector | None:
    """Return an equilibrium of the game with its payoffs as written, rounded; None if
    none is found in time."""
    with imports:
        from lcpcli.verify.exact_solution import finitely_rounded
    z: Sequence[Fraction] | None = None
    with suppress(TimeIsUp), within(result.limits.time_limit - result.seconds):
        z = exactly(Effort(EFFORT))
    return None if z is None else finitely_rounded(z)
