"""What results mean for the linear or quadratic program, or the game, from which their
problem was made."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from lcpcli.clock import imports, seconds
from lcpcli.inspection.classes import definiteness
from lcpcli.inspection.verdict import NO, YES
from lcpcli.linalg.matrices import product
from lcpcli.linalg.threads import with_limited_threads
from lcpcli.model.formulation import Answer
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import SENSES, Program, ProgramData
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import (
    approximate,
)
from lcpcli.solving import equilibria
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
from lcpcli.verify.equilibria import point_of_game, strategies_at

WORDS = {"min": "minimizer", "max": "maximizer"}
DEFINITE = {"min": "positive", "max": "negative"}
PLAYERS = "row", "column"


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


def answer(result: Result) -> Answer | Minimum | Equilibrium | None:
    """Return what a result means for the origin of its problem; None for a problem
    without origin."""
    origin = result.problem.origin
    if isinstance(origin, Program):
        return minimum(result, origin)
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
