"""The solutions of the LCP of a game that are its equilibria."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cache

from lcpcli.enumeration.equilibria import Equilibria
from lcpcli.enumeration.piece import Piece, States, common_states
from lcpcli.model.reductions.game import Game
from lcpcli.rational.polyhedra import Point
from lcpcli.rational.problem import ExactProblem


def pieces_of(found: Equilibria, game: Game, data: ExactProblem, check: Callable[[], None]) -> Iterator[Piece]:
    """The pieces of the LCP with these exact data, one for each maximal Nash subset; `check` is called before
    each but the first.

    z = (x, y), x the row player's strategy divided by the column player's cost, and y the other way round.
    """
    by_row, by_column = game.cost_constants()

    @cache
    def solution(k: int) -> tuple[Point, States]:
        each = found.extreme[k]
        z = _over(each.row, by_column - each.payoffs[1]) + _over(each.column, by_row - each.payoffs[0])
        return z, common_states(data, [z])

    for number, subset in enumerate(found.subsets):
        if number:
            check()
        yield Piece.spanned([solution(k) for k in subset.extreme])


def _over(strategy: Point, cost: Fraction) -> Point:
    return tuple(value / cost for value in strategy)
