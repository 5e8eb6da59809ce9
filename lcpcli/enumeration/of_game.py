"""The solutions of the LCP of a game that are its equilibria."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from lcpcli.enumeration.equilibria import Equilibria
from lcpcli.enumeration.piece import Piece
from lcpcli.model.reductions.game import Game
from lcpcli.rational.polyhedra import Generators, Point
from lcpcli.rational.problem import ExactProblem


def pieces_of(found: Equilibria, game: Game, data: ExactProblem) -> Iterator[Piece]:
    """The pieces of the LCP with these exact data, one for each maximal Nash subset.

    z = (x, y), x the row player's strategy divided by the column player's cost, and y the other way round.
    """
    by_row, by_column = game.cost_constants()
    solutions = [
        _over(each.row, by_column - each.payoffs[1]) + _over(each.column, by_row - each.payoffs[0])
        for each in found.extreme
    ]
    for subset in found.subsets:
        vertices = [solutions[k] for k in subset.extreme]
        yield Piece.of(data, Generators(vertices, [], []))


def _over(strategy: Point, cost: Fraction) -> Point:
    return tuple(value / cost for value in strategy)
