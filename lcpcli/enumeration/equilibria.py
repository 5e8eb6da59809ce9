"""The equilibria of a game: the extreme ones, the maximal Nash subsets that they span, and the components of these.

The pieces of the LCP of a game are its maximal Nash subsets, all convex combinations of some strategies of each player,
and their vertices its extreme equilibria; subsets that share one of these form one component (D. Avis, G. Rosenberg, R.
Savani and B. von Stengel, Enumeration of Nash equilibria for two-player games, Economic Theory 42 (2010) 9-37).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm

from lcpcli.enumeration.pieces import Piece
from lcpcli.model.origins import Game, Payoffs
from lcpcli.rational import elimination
from lcpcli.rational.numbers import over_one_denominator
from lcpcli.rational.polyhedra import Point, Vertex, connected


@dataclass(frozen=True)
class Equilibrium:
    """An extreme equilibrium.

    row, column : the strategies, exact probabilities. payoffs : the payoffs of the row and the column player.
    index : 1 or -1; None where the game is degenerate: a strategy has more pure best replies than its support has
        elements. If no equilibrium is degenerate, the indices of all add up to 1.
    """

    row: Point
    column: Point
    payoffs: tuple[Fraction, Fraction]
    index: int | None = None

    @property
    def is_pure(self) -> bool:
        """Return whether both players play one strategy only."""
        return max(self.row) == 1 == max(self.column)


@dataclass(frozen=True)
class NashSubset:
    """A maximal Nash subset: all convex combinations of these strategies of each player, in any pairing; and the
    extreme equilibria that its strategies form, counted from 0."""

    rows: tuple[Point, ...]
    columns: tuple[Point, ...]
    extreme: tuple[int, ...]


@dataclass(frozen=True)
class Equilibria:
    """The equilibria of a game of two players, as far as they were found.

    extreme : the extreme equilibria. subsets : the maximal Nash subsets, each of them complete; if all are here, their
    union is the set of equilibria. complete : whether they are proved to be all. components : which subsets are
    connected, counted from 0; None if there may be others, which might connect them. is_degenerate : whether the game
    is degenerate at an equilibrium (see `Equilibrium`), so that it need not be isolated; None if that is not known.
    """

    extreme: tuple[Equilibrium, ...]
    subsets: tuple[NashSubset, ...]
    components: tuple[tuple[int, ...], ...] | None
    is_degenerate: bool | None
    complete: bool


class Players:
    """The players of a game, with the equilibria that some solutions of its LCP stand for."""

    def __init__(self, game: Game) -> None:
        A, B = game.payoffs()
        self._row = _Player(A)
        self._column = _Player([list(column) for column in zip(*B, strict=True)])
        self._found: dict[Point, Equilibrium] = {}
        self._strategies: dict[Vertex, Vertex] = {}  # each once, as many equilibria may share it

    def take(self, solutions: Sequence[Point], check: Callable[[], None]) -> None:
        """Record the equilibria of extreme solutions; ArithmeticError if one is no equilibrium. `check` is called
        before each."""
        for z in solutions:
            if z not in self._found:
                check()
                self._found[z] = self._equilibrium(z)

    def arranged(self, pieces: Sequence[Piece], complete: bool) -> tuple[Sequence[Piece], list[Point], Equilibria]:
        """Return pieces and their vertices, which `take` has received, both in the order of their equilibria, and
        these. complete : whether the pieces are proved to be all."""
        found = {z: self._found[z] for piece in pieces for z in piece.vertices}
        points = sorted(found, key=lambda z: (found[z].row, found[z].column), reverse=True)
        place = {z: k for k, z in enumerate(points)}
        own = [replace(piece, vertices=tuple(sorted(piece.vertices, key=place.__getitem__))) for piece in pieces]
        own.sort(key=lambda piece: [place[z] for z in piece.vertices])
        subsets = tuple(_subset(found, [place[z] for z in piece.vertices], piece.vertices) for piece in own)
        extreme = tuple(found[z] for z in points)
        is_degenerate = True if any(each.index is None for each in extreme) else False if complete else None
        first: dict[int, int] = {}
        edges = [(first.setdefault(shared, k), k) for k, subset in enumerate(subsets) for shared in subset.extreme]
        components = tuple(map(tuple, connected(len(subsets), edges))) if complete else None
        return own, points, Equilibria(extreme, subsets, components, is_degenerate, complete)

    def _equilibrium(self, z: Point) -> Equilibrium:
        """Return the equilibrium of the strategies of which z consists of multiples."""
        m = len(self._row.payoffs)
        x, y = (self._strategies.setdefault(own, own) for own in map(_strategy, (z[:m], z[m:])))
        (by_row, rows), (by_column, columns) = self._row.best(x, y), self._column.best(y, x)
        played = [[i for i, value in enumerate(strategy) if value] for strategy in (x, y)]
        is_regular = [rows, columns] == played and len(rows) == len(columns)
        return Equilibrium(x, y, (by_row, by_column), self._index(rows, columns) if is_regular else None)

    def _index(self, rows: Sequence[int], columns: Sequence[int]) -> int:
        """Return the sign of the determinants of the positive payoffs on the supports, times -1 for each strategy
        but one in the supports (L. S. Shapley, Mathematical Programming Study 1 (1974) 175-189); 1 for a pure
        equilibrium."""
        signs = [self._row.determinant(rows, columns) > 0, self._column.determinant(columns, rows) > 0]
        return 1 if (len(rows) % 2 == 1) == (signs[0] == signs[1]) else -1


class _Player:
    """A player's payoffs for its strategies in integers, divided by `common`, and the least payoff."""

    def __init__(self, payoffs: Payoffs) -> None:
        self.common = lcm(*(value.denominator for row in payoffs for value in row))
        self.payoffs = [[int(value * self.common) for value in row] for row in payoffs]
        self._least = min(map(min, self.payoffs))

    def best(self, own: Point, other: Point) -> tuple[Fraction, list[int]]:
        """Return the payoff of a best reply to the other player's strategy, and which strategies are best replies;
        ArithmeticError if the strategies that the player itself plays are not."""
        weights, d = over_one_denominator(other)
        played = [(j, weight) for j, weight in enumerate(weights) if weight]
        values = [sum(row[j] * weight for j, weight in played) for row in self.payoffs]
        best = max(values)
        if any(value < best for value, probability in zip(values, own, strict=True) if probability):
            raise ArithmeticError("a point that was taken for an equilibrium is none")
        return Fraction(best, self.common * d), [i for i, value in enumerate(values) if value == best]

    def determinant(self, own: Sequence[int], others: Sequence[int]) -> int:
        """Return the determinant of the payoffs on the supports plus a constant that makes all payoffs positive."""
        return elimination.determinant([[self.payoffs[i][j] - self._least + 1 for j in others] for i in own])


def _strategy(multiple: Sequence[Fraction]) -> Vertex:
    weights, _ = over_one_denominator(multiple)
    total = sum(weights)
    return Vertex(Fraction(weight, total) for weight in weights)


def _subset(found: Mapping[Point, Equilibrium], places: Sequence[int], points: Sequence[Point]) -> NashSubset:
    rows, columns = dict.fromkeys(found[z].row for z in points), dict.fromkeys(found[z].column for z in points)
    return NashSubset(tuple(rows), tuple(columns), tuple(places))
