"""Strategies as a proposed solution of a game: the z that they stand for, and its verification.

The components of z that belong to a player are its probabilities divided by what a best response costs the other one.
A z whose two parts are nonnegative and each add up to 1 is read as strategies: it solves the LCP only if these costs
are 1, where both readings are the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import ProblemError, count
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.typing import Vector
from lcpcli.verify.equilibrium import Strategies, allowance
from lcpcli.verify.verification import Verification

SUM_TOLERANCE = 1e-6  # by how much probabilities may miss the sum 1, as those do that are printed with seven digits
HINT = "give probabilities, at least 0 and with the sum 1"


def require_strategies(problem: Problem, values: Sequence[Any], rows: int) -> None:
    """Raise ProblemError if these values, the first `rows` for the row player, are not strategies of the game."""
    game = problem.origin
    if not isinstance(game, Game):
        raise ProblemError("row", "is a strategy, but the problem is not a game", "give z")
    with imports:
        from lcpcli.rational.numbers import approximate, rounded
    parts = values[:rows], values[rows:]
    for player, part, size in zip(("row", "column"), parts, game.A.shape, strict=True):
        if len(part) != size:
            raise ProblemError(player, f"has {count(len(part), 'entry')} for {size} strategies", "make them agree")
        if not _are_probabilities(rounded(part)):
            fault = f"has the sum {approximate(sum(part, Fraction(0)))}" if min(part) >= 0 else "has a negative entry"
            raise ProblemError(player, fault, HINT)


@np.errstate(all="ignore")  # overflow counts as infinite
def verified(
    problem: Problem,
    values: Sequence[Any] | Vector,
    verify: Callable[[Any], Verification],
    *,
    tol: float = 0.0,
    data: ExactProblem | None = None,
) -> Verification:
    """Verify z, or the z of strategies, by `verify`, and say what the strategies are for the game behind the
    problem; in exact arithmetic where there are exact data."""
    game = problem.origin
    if not isinstance(game, Game):
        return verify(values)
    given = game.parts(np.array(values, dtype=float if data is None else object))
    sums = [part.sum() for part in given]
    if any(min(part) < 0 or not 0 < total < np.inf for part, total in zip(given, sums, strict=True)):
        return verify(values)
    x, y = (part / total for part, total in zip(given, sums, strict=True))
    own = Strategies.of(game, x, y)
    small = own.are_best(game, allowance(problem.n, tol))
    if not all(map(_are_probabilities, given)):
        verification = verify(values)
        message = f"{verification.message}; as strategies, {own.statement(small)}"
        return replace(verification, message=message, strategies=own)
    both = np.concatenate((x, y))
    costs = problem.M @ both if data is None else np.array(data.w(both.tolist()), dtype=object) + 1  # as q = -1
    by_row, by_column = game.parts(costs)
    z = np.concatenate((x / min(by_column), y / min(by_row)))
    if data is None and not np.isfinite(z).all():
        raise ProblemError("z", "of these strategies exceeds the double-precision range", "scale the payoffs")
    verification = verify(z if data is None else z.tolist())
    accepted = verification.accepted and small
    rounding = ROW_ROUNDING if data is None else 0
    divided = ", divided by their sums," * any(abs(total - 1) > rounding for total in sums)
    message = f"the strategies{divided} are {own.statement(accepted)}; their {verification.message}"
    return replace(verification, accepted=accepted, message=message, strategies=own)


def _are_probabilities(values: Any) -> bool:
    return bool(min(values) >= 0 and abs(values.sum() - 1) <= SUM_TOLERANCE)
