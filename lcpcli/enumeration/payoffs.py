"""Objectives in the payoffs of a game, which are linear in the costs of the players.

The LCP of a game of two strategies has x / v and y / u in place of the strategies x and y, with the costs u and v of
the row and the column player. With these as unknowns, payoffs are linear, and so are sums of them:

    0 <= x,  R y - u e >= 0,  u free,  e'x = 1,        0 <= y,  C'x - v e >= 0,  v free,  e'y = 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg.matrices import dense
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.typing import Vector

PREFIX = "payoff of "
PLAYERS = ("row", "column")


class Payoffs(NamedTuple):
    """A problem in whose unknowns the payoffs of both players are linear: constants - slopes z at two places."""

    data: ExactProblem
    places: tuple[int, int]
    slopes: tuple[Fraction, Fraction]
    constants: tuple[Fraction, Fraction]


def names(problem: Problem) -> Sequence[str]:
    """Return the names of the payoffs of both players of a game, none for another problem."""
    origin = problem.origin
    players = PLAYERS if isinstance(origin, Game) else origin.tree.names() if isinstance(origin, ExtensiveGame) else ()
    return [PREFIX + player for player in players]


def in_costs(
    data: ExactProblem, objective: Mapping[str, Fraction]
) -> tuple[ExactProblem, Mapping[str, Fraction], Fraction]:
    """Return a problem, an objective in its unknowns and a constant in place of an objective that has payoffs of the
    players of a game beside unknowns, or only payoffs; the same ones, and 0, if it has none. Raises ProblemError."""
    origin, called = data.problem.origin, names(data.problem)
    own = [objective.get(name, Fraction(0)) for name in called]
    if not any(name in objective for name in called):
        return data, objective, Fraction(0)
    others = {name: value for name, value in objective.items() if name not in called}
    if isinstance(origin, ExtensiveGame):
        payoffs = _of_tree(data, origin)
    elif others:
        fault = f"has {next(iter(others))!r} beside payoffs, which are not linear in the unknowns"
        raise ProblemError("objective", fault, f"use {' and '.join(map(repr, called))} alone")
    else:
        assert isinstance(origin, Game)
        payoffs = _of_strategies(data, origin)
    for value, place, slope in zip(own, payoffs.places, payoffs.slopes, strict=True):
        others[f"z{place + 1}"] = others.get(f"z{place + 1}", Fraction(0)) - value * slope
    constant = sum((value * each for value, each in zip(own, payoffs.constants, strict=True)), Fraction(0))
    return payoffs.data, others, constant


def multiples(z: Sequence[Fraction], rows: int) -> list[Fraction]:
    """Return the solution of the LCP of a game, of so many rows, for strategies and costs."""
    *strategies, u, v = z
    return [value / (v if i < rows else u) for i, value in enumerate(strategies)]


def _of_tree(data: ExactProblem, game: ExtensiveGame) -> Payoffs:
    one, two = game.costs
    first = game.sizes[0] + game.sizes[1]
    places = first, first + game.sizes[2]
    return Payoffs(data, places, (1 / one.factor, 1 / two.factor), (one.constant, two.constant))


def _of_strategies(data: ExactProblem, game: Game) -> Payoffs:
    """Return the payoffs in terms of x, y, u and v."""
    m, n = game.A.shape[0], data.n
    owners = [int(i >= m) for i in range(n)]
    border = np.zeros((n, 2))
    border[np.arange(n), owners] = 1.0
    M = np.block([[dense(data.problem.M), -border], [border.T, np.zeros((2, 2))]])
    one = Fraction(1)
    rows = [{**row, n + owner: -one} for row, owner in zip(data.M, owners, strict=True)]
    rows += [{i: one for i in range(n) if owners[i] == owner} for owner in (0, 1)]
    q: Vector = np.array([0.0] * n + [-1.0] * 2)
    lower = [Fraction(0)] * n + [None] * 2
    problem = Problem(M, q, lower=np.array([0.0] * n + [-np.inf] * 2), upper=np.full(n + 2, np.inf))
    exact = ExactProblem(problem, rows, [Fraction(value) for value in q.tolist()], lower, [None] * (n + 2))
    return Payoffs(exact, (n, n + 1), (one, one), game.cost_constants())
