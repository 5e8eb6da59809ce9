"""What a result means for the program or game from which its problem was made.

The strategies of a solved game, checked by best responses: a payoff that is far larger than all that are reached, as
a penalty for a forbidden move, makes the residual of strategies small that are no equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from lcpcli.clock import imports, seconds
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.model.origins import Game
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from collections.abc import Callable

    from lcpcli.games.behavior import Behavior, InformationSetStrategy

UNIQUE, OPTIMUM, SEVERAL, STATIONARY = "unique_optimum", "optimum", "several_optima", "stationary"
INFEASIBLE, UNBOUNDED, NONE = "infeasible", "unbounded", "no_optimum"
PROVED = (UNIQUE, OPTIMUM, SEVERAL, STATIONARY, INFEASIBLE, UNBOUNDED, NONE)
"""What may be proved about a program: that x is its only optimum, an optimum, or one of several; that x is a stationary
point and the program is not convex, so that x need not be an optimum; that the program is infeasible, or unbounded, or
one of the two."""


def word_of(status: str, proved: str | None) -> str:
    """Return one word for how a run ended: the status or, for a program without an optimum, why it has none."""
    return proved if proved in (INFEASIBLE, UNBOUNDED, NONE) else status


class Conclusion(NamedTuple):
    """What is concluded about a program from a result on its conditions, with the attributes of a `Minimum`."""

    statement: str
    proved: str | None = None
    ray: Vector | None = None
    certificate: Vector | None = None


@dataclass(frozen=True, eq=False)
class Minimum:
    """What a result on the conditions says about a program, min or max x'Qx / 2 + c'x + constant under its rows and
    bounds.

    x : the point, shape (k,), or the best iterate if the conditions are not solved; None, like all up to the objective,
        if the conditions are proved to have no solution.
    y, bound_multipliers : the multipliers of the m rows and of the bounds of the k variables: the derivative of the
        optimal objective with respect to the active bound, 0 where none is active.
    activities, slacks : the values Ax of the rows, and their distances from the nearer of their bounds, negative where
        a row is violated.
    objective : the value at x, in the program's own sense and with its constant.
    exact : x and y as fractions if they are proved, else None.

    The following are computed when one of them is first read:
    statement : what x is, or what the absence of a solution means.
    proved : what is proved, one of the words in PROVED; None if nothing is.
    ray : a direction of shape (k,) in which the objective improves without limit within rows and bounds; else None.
    certificate : multipliers of the rows, shape (m,), positive for lower and negative for upper bounds, such that no x
        within its bounds satisfies this combination of the rows; else None. Ray and certificate are integers if
        `certificate.proof` finds such vectors, and rounded otherwise.
    seconds : how long that took; it is not part of the run's time.
    """

    x: Vector | None
    y: Vector | None
    bound_multipliers: Vector | None
    activities: Vector | None
    slacks: Vector | None
    objective: float | None
    exact: dict[str, list[Fraction]] | None
    _conclude: Callable[[], Conclusion] = field(repr=False)

    @cached_property
    def _concluded(self) -> tuple[Conclusion, float]:
        began = seconds()
        return self._conclude(), seconds() - began

    @property
    def statement(self) -> str:
        return self._concluded[0].statement

    @property
    def proved(self) -> str | None:
        return self._concluded[0].proved

    @property
    def ray(self) -> Vector | None:
        return self._concluded[0].ray

    @property
    def certificate(self) -> Vector | None:
        return self._concluded[0].certificate

    @property
    def seconds(self) -> float:
        return self._concluded[1]


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What a solution of the LCP says about the game.

    row, column : the mixed strategies, probabilities in the order of the game's rows and columns; None, as are payoffs
        and gains, if the LCP is not solved.
    payoffs : the expected payoffs of the row and the column player, in the game's units.
    gains : how much each player would gain by a best response to the other, computed from A and B; 0 if the gain is
        only rounding error.
    statement : whether the strategies are an equilibrium.
    exact : row and column as fractions if z is proved, else None.
    """

    row: Vector | None
    column: Vector | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: dict[str, list[Fraction]] | None = None


@dataclass(frozen=True, eq=False)
class BehaviorEquilibrium:
    """What a solution of the mixed problem says about a game tree.

    players : the names of both players.
    information_sets : behavior strategies, the first player's and then the second player's information sets, in the
        order of the file; None, as are the plans, payoffs and gains, if the problem is not solved. Where a player's own
        moves exclude an information set, its actions have the same probability; any others give an equilibrium too.
    plans : the realization plans, for each sequence of a player's moves the product of their probabilities.
    payoffs : the expected payoffs of both players. gains : how much each player would gain by a best response,
        computed on the tree, backward over its information sets; 0 if the gain is only rounding error.
    statement : whether the strategies are an equilibrium. That they are one in each subgame is not asked.
    exact : the same in fractions if z is proved, else None.
    """

    players: list[str]
    information_sets: list[InformationSetStrategy] | None
    plans: tuple[Vector, Vector] | None
    payoffs: tuple[float, float] | None
    gains: tuple[float, float] | None
    statement: str
    exact: Behavior | None = None


Answer: TypeAlias = Minimum | Equilibrium | BehaviorEquilibrium


MOST_UNKNOWNS = 60  # of a game tree for which exact arithmetic is tried
EFFORT = 20.0  # seconds of it, counted as work
REASON = "z solves the problem to the tolerance, but its strategies are {}"


def checked(result: Result) -> Result:
    """Return the result of a run, if it is not solved, or its strategies, if it has any, are an equilibrium to the
    tolerance; else one of exact arithmetic by `auto`, or one that is stalled and says what the players would gain."""
    problem, game = result.problem, result.problem.origin
    if not result.solved or not isinstance(game, (Game, ExtensiveGame)):
        return result
    with imports:
        from lcpcli.verify import strategies
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
        from lcpcli.rational import pivoting
        from lcpcli.rational.elimination import Effort
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.tree import first_solution
        from lcpcli.verify import strategies
        from lcpcli.verify.exact_solution import finitely_rounded, from_point
    problem, game = result.problem, result.problem.origin
    assert isinstance(game, (Game, ExtensiveGame))
    z: Sequence[Fraction] | None
    try:
        with within(result.limits.time_limit - result.seconds):
            data, effort = ExactProblem(problem, *game.exact_conditions()), Effort(EFFORT)
            if isinstance(game, Game):
                found = pivoting.equilibrium(data, game.A.shape[0], effort)
                z = None if found is None else strategies.point_of_game(problem, np.array(found), data).tolist()
            else:
                z = from_point(data, result.z, effort) or first_solution(data, effort.steps(data))
    except TimeIsUp:
        return None
    return None if z is None else finitely_rounded(z)
