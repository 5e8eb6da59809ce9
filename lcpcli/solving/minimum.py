"""What results mean for the linear or quadratic program, or the game, from which their
problem was made.

The strategies of a solved game are checked by best responses: a payoff that is far
larger than all that are reached, as a penalty for a forbidden move, makes the residual
of strategies small that are no equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, TypeAlias

import numpy as np

from lcpcli.clock import imports, seconds
from lcpcli.games.behavior import Behavior, InformationSetStrategy
from lcpcli.inspection.classes import definiteness
from lcpcli.inspection.verdict import NO, YES
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.linalg.matrices import product
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.model.extensive import ExtensiveGame
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import SENSES, Program, ProgramData
from lcpcli.rational import elimination
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import (
    approximate,
)
from lcpcli.rational.tree import first_solution
from lcpcli.solving.no_minimum import (
    OPTIMUM,
    SEVERAL,
    STATIONARY,
    UNIQUE,
    Conclusion,
    undecided,
    without_minimum,
)
from lcpcli.solving.other_minimum import has_other_minimum
from lcpcli.solving.result import Result, Status
from lcpcli.solving.sensitivity import Sensitivities, sensitivities
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.verification import of_solution, point_of_game

WORDS = {"min": "minimizer", "max": "maximizer"}
DEFINITE = {"min": "positive", "max": "negative"}
MOST_UNKNOWNS = 60  # of a game tree for which exact arithmetic is tried
EFFORT = 20.0  # seconds of it, counted as work
PLAYERS = "row", "column"
UNSOLVED = "not solved, so there are no strategies"
REASON = "z solves the problem to the tolerance, but its strategies are {}"


@dataclass(frozen=True, eq=False)
class Minimum:
    """What a result on the conditions says about a program, min or max x'Qx / 2 + c'x +
    constant under its rows and bounds.

    x : the point, shape (k,), or the best iterate if the conditions are not solved;
        None, like all up to the objective, if the conditions are proved to have no
        solution.
    y, bound_multipliers : multipliers of the m rows and of the bounds of the k
        variables, 0 where no bound is active. Those of a convex program are derivatives
        of the optimal objective with respect to the active bound where they are unique.
    activities, slacks : the values Ax of the rows, and their distances from the nearer
        of their bounds, negative where a row is violated.
    objective : the value at x, in the program's own sense and with its constant.
    exact : x and y as fractions if they are proved, else None.

    unique_multipliers : whether there are no other multipliers; None if it takes too
        long to see, or the program is not known to be convex.
    y_down, y_up, bound_multipliers_down, bound_multipliers_up : the derivatives of the
        optimal objective as the active bound falls and as it rises, of the shapes of y
        and bound_multipliers: the same number where multipliers are unique, and
        infinite where no such change is feasible. Equal bounds move together. None if
        that takes too long, or the program is not known to be convex.

    These are computed when one of them is first read, and so are the following:
    statement : what x is, or what the absence of a solution means.
    proved : what is proved, one of the words in PROVED; None if nothing is.
    ray : a direction of shape (k,) in which the objective improves without limit within
        rows and bounds; else None.
    certificate : multipliers of the rows, shape (m,), positive for lower and negative
        for upper bounds, such that no x within its bounds satisfies this combination of
        the rows; else None. Ray and certificate are integers if `certificate.proof`
        finds such vectors, and rounded otherwise.
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
    _vary: Callable[[], Sensitivities | None] = field(repr=False)

    @cached_property
    def _concluded(self) -> tuple[Conclusion, float]:
        began = seconds()
        return self._conclude(), seconds() - began

    @cached_property
    def _varied(self) -> tuple[Sensitivities | None, float]:
        began = seconds()
        return self._vary(), seconds() - began

    statement = property(lambda minimum: minimum._concluded[0].statement)
    proved = property(lambda minimum: minimum._concluded[0].proved)
    ray = property(lambda minimum: minimum._concluded[0].ray)
    certificate = property(lambda minimum: minimum._concluded[0].certificate)
    unique_multipliers = property(lambda minimum: minimum._sensitivity("are_unique"))
    y_down = property(lambda minimum: minimum._sensitivity("down"))
    y_up = property(lambda minimum: minimum._sensitivity("up"))
    bound_multipliers_down = property(
        lambda minimum: minimum._sensitivity("bounds_down")
    )
    bound_multipliers_up = property(lambda minimum: minimum._sensitivity("bounds_up"))
    seconds = property(lambda minimum: minimum._concluded[1] + minimum._varied[1])

    def _sensitivity(self, name: str) -> Any:
        found = self._varied[0]
        return None if found is None else getattr(found, name)


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


@dataclass(frozen=True, eq=False)
class BehaviorEquilibrium:
    """What a solution of the mixed problem says about a game tree.

    players : the names of both players.
    information_sets : behavior strategies, the first player's and then the second
        player's information sets, in the order of the file; None, as are the plans,
        payoffs and gains, if the problem is not solved. Where a player's own moves
        exclude an information set, its actions have the same probability; any others
        give an equilibrium too.
    plans : the realization plans, for each sequence of a player's moves the product of
        their probabilities.
    payoffs : the expected payoffs of both players. gains : how much each player would
        gain by a best response, computed on the tree, backward over its information
        sets; 0 if the gain is only rounding error.
    statement : whether the strategies are an equilibrium. That they are one in each
        subgame is not asked.
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


def answer(result: Result) -> Answer | None:
    """Return what a result means for the origin of its problem; None for a problem
    without origin."""
    origin = result.problem.origin
    if isinstance(origin, Program):
        return minimum(result, origin)
    return (
        equilibrium(result, origin)
        if isinstance(origin, (Game, ExtensiveGame))
        else None
    )


def equilibrium(
    result: Result, game: Game | ExtensiveGame
) -> Equilibrium | BehaviorEquilibrium:
    """Return strategies, payoffs and gains if the result is solved, and whether the
    strategies are an equilibrium."""
    found = of_solution(result.problem, result.z, result.tol) if result.solved else None
    own: Any = None if found is None else found.own
    parts = (
        ()
        if result.exact is None or result.exact.z is None
        else game.parts(result.exact.z)
    )
    exact: Any = None
    if isinstance(game, Game):
        if found is None:
            return Equilibrium(None, None, None, None, UNSOLVED)
        if parts:
            exact = {
                name: [value / sum(part) for value in part]
                for name, part in zip(PLAYERS, parts, strict=True)
            }
        return Equilibrium(
            own.row,
            own.column,
            own.payoffs,
            own.gains,
            own.statement(found.are_equilibrium),
            exact,
        )
    if found is None:
        return BehaviorEquilibrium(game.tree.names(), None, None, None, None, UNSOLVED)
    if parts:
        exact = Behavior.of_plans(game, parts[0], parts[1])
    plans, said = (
        (np.array(own.plans[0]), np.array(own.plans[1])),
        (exact or own).statement(found.are_equilibrium),
    )
    return BehaviorEquilibrium(
        own.players, own.information_sets, plans, own.payoffs, own.gains, said, exact
    )


def checked(result: Result) -> Result:
    """Return the result of a run that has solved a game, if its strategies, if it has
    any, are an equilibrium to the tolerance; else one of exact arithmetic by `auto`, or
    one that is stalled and says what the players would gain."""
    problem = result.problem
    found = of_solution(problem, result.z, result.tol)
    if found is None or found.are_equilibrium:
        return result
    began = seconds()
    is_decided = isinstance(problem.origin, Game) or problem.n <= MOST_UNKNOWNS
    z = _exact(result) if is_decided and result.method == "auto" else None
    if z is not None and (point := Point(Criterion(problem, result.tol), z)).solves():
        exact = of_solution(problem, z, result.tol)
        if exact is not None and exact.are_equilibrium:
            parts = {
                **result.parts,
                "verify": result.parts["verify"] + seconds() - began,
            }
            route = (*result.route, "exact")
            return replace(
                result, point=point, route=route, parts=parts, nearest="exact", end=None
            )
    reason = REASON.format(found.own.statement(False))
    return replace(
        result, status=Status.STALLED, message=Status.STALLED.sentence(reason), end=None
    )


def _exact(result: Result) -> Vector | None:
    """Return an equilibrium of the game with its payoffs as written, rounded; None if
    none is found in time."""
    with imports:
        from lcpcli.rational import pivoting
        from lcpcli.verify.exact_solution import finitely_rounded, from_point
    problem, game = result.problem, result.problem.origin
    assert isinstance(game, (Game, ExtensiveGame))
    z: Sequence[Fraction] | None = None
    with suppress(TimeIsUp), within(result.limits.time_limit - result.seconds):
        data, effort = (
            ExactProblem(problem, *game.exact_conditions()),
            elimination.Effort(EFFORT),
        )
        if isinstance(game, Game):
            found = pivoting.equilibrium(data, game.A.shape[0], effort)
            z = (
                None
                if found is None
                else point_of_game(problem, np.array(found), data).tolist()
            )
        else:
            z = from_point(data, result.z, effort) or first_solution(
                data, effort.steps(data)
            )
    return None if z is None else finitely_rounded(z)


def minimum(result: Result, program: Program) -> Minimum:
    """Return x, y and the objective, at the best iterate if the result is not solved,
    unless it is proved that there is no solution."""
    # A cycle would keep large arrays in memory.
    conclude = partial(conclusion, result.problem, copy(result), program)
    vary = partial(variations, result.problem, copy(result), program)
    if result.status.has_no_solution:
        return Minimum(None, None, None, None, None, None, None, conclude, vary)
    sign, data = SENSES[program.sense], data_of(result.problem, program)
    x, y = program.parts(result.z)
    w = program.parts(result.w)[0]
    # Else w is rounding of 0.
    active = np.where(w > 0, x - data.lower <= w, data.upper - x <= -w)
    bounded = sign * np.where(active, w, 0.0) + 0.0
    value = sign * data.objective(x) + program.constant
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = program.parts(result.exact.z)
        exact = {"x": list(parts[0]), "y": [int(sign) * value for value in parts[1]]}
    activities = product(data.A, x) + 0.0
    slacks = np.minimum(activities - data.row_lower, data.row_upper - activities)
    return Minimum(
        x + 0.0,
        sign * y + 0.0,
        bounded,
        activities,
        slacks,
        value + 0.0,
        exact,
        conclude,
        vary,
    )


def data_of(problem: Problem, program: Program) -> ProgramData:
    """Return the program, to be minimized, whose conditions the problem has."""
    data = program.program(conditions_of(problem))
    assert data is not None
    return data


@with_limited_threads
@np.errstate(all="ignore")
def conclusion(problem: Problem, result: Result, program: Program) -> Conclusion:
    """Return what a result on the conditions of a program says about the program;
    nothing that takes long if Ctrl-C has ended the run. What is known about every
    solution of the problem is kept with it."""
    word, data = WORDS[program.sense], data_of(problem, program)
    if result.status.has_no_solution:
        done = result.interrupted
        return (
            undecided(program)
            if done
            else without_minimum(problem, result.certificate, program, data)
        )
    if result.status is Status.ILL_POSED:
        return Conclusion(
            f"the program is ill-posed: whether it has a {word} depends on the "
            "rounding of its data"
        )
    if not result.solved:
        relative = result.relative_residual
        size = (
            f"relative residual of {relative:.1e}"
            if relative < math.inf
            else f"residual of {result.residual:.1e}"
        )
        return Conclusion(
            f"x does not solve the program: it is the best iterate, with a {size}"
        )
    if result.interrupted:
        return Conclusion(
            f"x satisfies the first-order conditions; whether it is a {word} "
            "was not examined"
        )
    kind = kind_of_solutions(problem, program, data)
    is_exact = kind.within is None
    if kind.proved == OPTIMUM and has_other_minimum(
        problem, program, data, result.z, result.tol, is_exact
    ):
        several = kind.statement.replace(f"a {word}", f"one of several {word}s")
        proved = SEVERAL if is_exact else OPTIMUM
        return Conclusion(several, proved, within=kind.within)
    return kind


@with_limited_threads
def variations(
    problem: Problem, result: Result, program: Program
) -> Sensitivities | None:
    """Return how the optimal objective of a convex program varies with its bounds; None
    if that is not known, or Ctrl-C has ended the run."""
    if not result.solved or result.interrupted:
        return None
    data = data_of(problem, program)
    kind = kind_of_solutions(problem, program, data)
    if kind.proved not in (UNIQUE, OPTIMUM):
        return None
    return sensitivities(problem, program, data, result.z, result.tol)


def kind_of_solutions(
    problem: Problem, program: Program, data: ProgramData
) -> Conclusion:
    """Return the kind of each solution of the conditions of a program, which is kept
    with them."""
    if problem.facts.kind is None:
        problem.facts.kind = kind_of_point(data, program)
    kind: Conclusion = problem.facts.kind
    return kind


def kind_of_point(data: ProgramData, program: Program) -> Conclusion:
    """Return the kind of a solution of the first-order conditions, from what is known
    about Q: whether it is definite, semidefinite, or neither.

    Up to rounding: if Q + d diag(Q) is semidefinite, x minimizes a program with this in
    place of Q, and its conditions are violated by at most d of their own terms.
    """
    word, definite = WORDS[program.sense], DEFINITE[program.sense]
    if not (data.Q != 0).sum():
        return Conclusion(f"x is a {word} of the linear program", OPTIMUM)
    found = definiteness(data.Q)
    if found.definite == YES:
        return Conclusion(
            f"x is the unique {word}, as Q is {definite} definite", UNIQUE
        )
    if found.semidefinite == YES:
        return Conclusion(f"x is a {word}, as Q is {definite} semidefinite", OPTIMUM)
    if found.semidefinite == NO:
        return Conclusion(
            f"x is a stationary point and need not be a {word}: Q is not "
            f"{definite} semidefinite",
            STATIONARY,
        )
    if found.within is not None:
        change = approximate(Fraction(found.within), 1, 1)
        statement = (
            f"x is a {word} up to rounding: Q differs by at most {change}, relatively, "
            f"from a {definite} semidefinite matrix"
        )
        return Conclusion(statement, OPTIMUM, within=found.within)
    open_question = (
        f"whether Q is {definite} semidefinite and x a {word} is not decided"
    )
    return Conclusion(f"x satisfies the first-order conditions; {open_question}")
