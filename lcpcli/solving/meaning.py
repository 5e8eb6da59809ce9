"""What results mean for the quadratic program or the game that their problem comes from.

A program without a minimum is infeasible or unbounded: M. Frank, P. Wolfe, An algorithm for quadratic programming,
Naval Res. Logist. Quart. 3 (1956) 95-110.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lcpcli.classes.classify import classify
from lcpcli.classes.verdict import NO, YES
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.products import product
from lcpcli.model.problem import Problem
from lcpcli.model.reductions.game import Game
from lcpcli.model.reductions.quadratic_program import QuadraticProgram
from lcpcli.solving.answer import Answer, Equilibrium, Minimum
from lcpcli.solving.result import Result, Status
from lcpcli.typing import Vector
from lcpcli.verify.farkas import alternative

SECONDS = 1.0  # for deciding whether Q is positive semidefinite
UNBOUNDED = "the program is unbounded below"


def answers(results: Sequence[Result]) -> list[Answer | None]:
    """What each of the results on one problem means for its origin; None if it has none."""
    problem = results[0].problem
    origin = problem.origin
    if isinstance(origin, QuadraticProgram):
        solved = _kind_of_minimum(problem, origin) if any(result.solved for result in results) else ""
        return [_minimum(result, origin, solved) for result in results]
    if isinstance(origin, Game):
        return [_equilibrium(result, origin) for result in results]
    return [None] * len(results)


def _minimum(result: Result, program: QuadraticProgram, solved: str) -> Minimum:
    """x, y and the objective if the result is solved, and what it means."""
    if not result.solved:
        return Minimum(None, None, None, _without_minimum(result, program))
    k, M, q = program.variables, result.problem.M, result.problem.q
    x, y = program.parts(result.z)
    with np.errstate(over="ignore", invalid="ignore"):
        objective = float(x @ product(M[:k, :k], x) / 2 + q[:k] @ x)
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = program.parts(np.array(result.exact.z))
        exact = {name: part.tolist() for name, part in zip("xy", parts, strict=True)}
    return Minimum(x, y, objective, solved, exact)


def _kind_of_minimum(problem: Problem, program: QuadraticProgram) -> str:
    """What a solution of the first-order conditions is, from what is proved about Q, the leading block of M."""
    k = program.variables
    verdicts = classify(problem.M[:k, :k], SECONDS, last="positive_semidefinite")
    if verdicts["positive_definite"].word == YES:
        return "x is the unique minimizer, as Q is positive definite"
    word = verdicts["positive_semidefinite"].word
    if word == YES:
        return "x is a minimizer, as Q is positive semidefinite"
    if word == NO:
        return "x satisfies the first-order conditions but need not be a minimizer: Q is not positive semidefinite"
    return "x satisfies the first-order conditions; whether Q is positive semidefinite and x a minimizer is not decided"


def _without_minimum(result: Result, program: QuadraticProgram) -> str:
    if result.status not in (Status.INFEASIBLE, Status.UNSOLVABLE):
        return "not solved, so there is no x"
    K, M, q = program.split, result.problem.M, result.problem.q
    if (q[K:] >= 0).all():  # x = 0 is feasible
        return UNBOUNDED
    point, proof = alternative(M[K:, :K], q[K:], SECONDS)
    if proof is not None:
        return "the program is infeasible: no x satisfies its constraints"
    if point is not None:
        return f"{UNBOUNDED}: an LP finds its constraints feasible, to its tolerance"
    return "the program has no minimum: it is infeasible or unbounded below"


def _equilibrium(result: Result, game: Game) -> Equilibrium:
    """Strategies, payoffs and gains if the result is solved, and whether the strategies are an equilibrium."""
    if not result.solved:
        return Equilibrium(None, None, None, None, "not solved, so there are no strategies")
    x, y = (part / part.sum() for part in game.parts(result.z))
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = zip(("row", "column"), game.parts(result.exact.z), strict=True)
        exact = {name: [value / sum(part) for value in part] for name, part in parts}
    by_row, by_column = game.A @ y, x @ game.B
    payoffs = float(x @ by_row), float(by_column @ y)
    gains = _gain(by_row, payoffs[0], game.A), _gain(by_column, payoffs[1], game.B)
    allowed = 10 * result.problem.n * result.tol
    small = all(
        gain <= allowed * (float(np.ptp(own)) or 1.0) for gain, own in zip(gains, (game.A, game.B), strict=True)
    )
    found = "an equilibrium" if small else "not an equilibrium to the tolerance"
    by = f"by a best response the row player would gain {gains[0]:.1g}, the column player {gains[1]:.1g}"
    return Equilibrium(x, y, payoffs, gains, f"{found}: {by}", exact)


def _gain(replies: Vector, payoff: float, payoffs: Vector) -> float:
    """What the best reply gains over the payoff; 0 if that is only rounding."""
    gain = float(replies.max()) - payoff
    return gain if gain > ROW_ROUNDING * float(np.abs(payoffs).max()) else 0.0
