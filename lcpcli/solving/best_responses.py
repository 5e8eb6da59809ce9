"""The strategies of a solved game, checked by best responses: a payoff that is far larger than all that are reached, as
a penalty for a forbidden move, makes the residual of strategies small that are no equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from lcpcli.clock import imports, seconds
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.model.origins import Game
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify import strategies
from lcpcli.verify.point import Criterion, Point

MOST_UNKNOWNS = 60  # of a game tree for which exact arithmetic is tried
EFFORT = 20.0  # seconds of it, counted as work
REASON = "z solves the problem to the tolerance, but its strategies are {}"


def checked(result: Result) -> Result:
    """Return the result of a run, if it is not solved, or its strategies, if it has any, are an equilibrium to the
    tolerance; else one of exact arithmetic by `auto`, or one that is stalled and says what the players would gain."""
    problem, game = result.problem, result.problem.origin
    if not result.solved or not isinstance(game, (Game, ExtensiveGame)):
        return result
    found = strategies.of_solution(problem, result.z, result.tol)
    if found is None or found.are_equilibrium:
        return result
    began = seconds()
    if result.method == "auto" and (isinstance(game, Game) or problem.n <= MOST_UNKNOWNS):
        z = _exact(result)
        point = None if z is None else Point(Criterion(problem, result.tol), z)
        if point is not None and point.solves():
            exact = strategies.of_solution(problem, point.z, result.tol)
            if exact is not None and exact.are_equilibrium:
                route, parts = (*result.route, "exact"), {**result.parts}
                parts["verify"] = parts.get("verify", 0.0) + seconds() - began
                return replace(result, point=point, route=route, parts=parts, nearest="exact", end=None)
    reason = REASON.format(found.own.statement(False))
    return replace(result, status=Status.STALLED, message=Status.STALLED.sentence(reason), end=None)


def _exact(result: Result) -> Vector | None:
    """Return an equilibrium of the game with its payoffs as written, rounded; None if none is found in time."""
    with imports:
        from lcpcli.rational import integer_lemke
        from lcpcli.rational.effort import Effort
        from lcpcli.rational.exact_problem import ExactProblem, parts_of_game
        from lcpcli.rational.numbers import rounded
        from lcpcli.rational.tree import first_solution
        from lcpcli.verify.exact_solution import from_point
    problem, game = result.problem, result.problem.origin
    assert isinstance(game, (Game, ExtensiveGame))
    z: Sequence[Fraction] | None
    try:
        with within(result.limits.time_limit - result.seconds):
            data, effort = ExactProblem(problem, *parts_of_game(game)), Effort(EFFORT)
            if isinstance(game, Game):
                found = integer_lemke.equilibrium(data, game.A.shape[0], effort)
                z = None if found is None else strategies.point_of_game(problem, np.array(found), data).tolist()
            else:
                z = from_point(data, result.z, effort) or first_solution(data, effort.steps(data))
    except TimeIsUp:
        return None
    return None if z is None or not np.isfinite(near := rounded(z)).all() else near
