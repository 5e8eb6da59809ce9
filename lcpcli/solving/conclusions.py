"""Conclusions from results, so that reports only have to format them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lcpcli.model.reductions.game import Game
from lcpcli.model.reductions.program import Program
from lcpcli.solving.answer import Answer, Equilibrium
from lcpcli.solving.minimum import minima
from lcpcli.solving.result import Result
from lcpcli.verify.equilibrium import Strategies, allowance
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.refinement import is_rounding


def concluded(results: Sequence[Result]) -> list[Result]:
    """The results, all on one problem, with `suggestions`, and with `answer` if the problem has an origin; as they are
    but `interrupted` if Ctrl-C comes before that."""
    try:
        return _concluded(results)
    except KeyboardInterrupt:
        return interrupted(results)


def interrupted(results: Sequence[Result]) -> list[Result]:
    """The results after Ctrl-C, from which nothing more is to be concluded."""
    return [replace(result, interrupted=True) for result in results]


def _concluded(results: Sequence[Result]) -> list[Result]:
    if not all(result.solved for result in results):
        from lcpcli.solving.advice import suggestions

        results = [result if result.solved else replace(result, suggestions=suggestions(result)) for result in results]
    if not results or results[0].problem.origin is None:
        return list(results)

    return [replace(result, answer=answer) for result, answer in zip(results, answers(results), strict=True)]


@np.errstate(over="ignore", invalid="ignore")
def verified(result: Result) -> Result:
    """The result with `verified`: by the relative residual of z, recomputed, or else by exact arithmetic."""
    if not result.solved:
        return result
    point = Point(Criterion(result.problem, result.tol), result.z, is_admissible=False)
    return replace(result, verified=point.solves() or is_rounding(result.problem, result.z, result.tol))


def answers(results: Sequence[Result]) -> list[Answer | None]:
    """What each of the results on one problem means for its origin; None if it has none."""
    origin = results[0].problem.origin
    if isinstance(origin, Program):
        return [*minima(results, origin)]
    if isinstance(origin, Game):
        return [equilibrium(result, origin) for result in results]
    return [None] * len(results)


def equilibrium(result: Result, game: Game) -> Equilibrium:
    """Strategies, payoffs and gains if the result is solved, and whether the strategies are an equilibrium."""
    if not result.solved:
        return Equilibrium(None, None, None, None, "not solved, so there are no strategies")
    x, y = (part / part.sum() for part in game.parts(result.z))
    exact = None
    if result.exact is not None and result.exact.z is not None:
        parts = zip(("row", "column"), game.parts(result.exact.z), strict=True)
        exact = {name: [value / sum(part) for value in part] for name, part in parts}
    own = Strategies.of(game, x, y)
    small = result.point.solves() and own.are_best(game, allowance(result.problem.n, result.tol))
    (by_row, by_column), (row, column) = own.payoffs, own.gains
    return Equilibrium(x, y, (by_row, by_column), (row, column), own.statement(small), exact)
