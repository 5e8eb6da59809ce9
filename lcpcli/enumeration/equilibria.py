"""The equilibria of a game: the extreme ones, the maximal Nash subsets that they span, and the components of these.

The pieces of the LCP of a game are its maximal Nash subsets, all convex combinations of some strategies of each player,
and their vertices its extreme equilibria; subsets that share one of these form one component (D. Avis, G. Rosenberg, R.
Savani and B. von Stengel, Enumeration of Nash equilibria for two-player games, Economic Theory 42 (2010) 9-37).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from lcpcli.enumeration.pieces import Piece
from lcpcli.model.origins import Game
from lcpcli.rational import elimination
from lcpcli.rational.dictionary import Point, Vertex, connected
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import over_one_denominator


@dataclass(frozen=True)
class ExactEquilibrium:
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
    is degenerate at an equilibrium (see `ExactEquilibrium`), which need not be isolated then; None if not known.
    """

    extreme: tuple[ExactEquilibrium, ...]
    subsets: tuple[NashSubset, ...]
    components: tuple[tuple[int, ...], ...] | None
    is_degenerate: bool | None
    complete: bool


class Players:
    """The players of a game, with the equilibria that some solutions of its LCP stand for."""

    def __init__(self, data: ExactProblem, game: Game) -> None:
        self._data, self._rows = data, game.A.shape[0]
        self._constants = game.cost_constants()
        self._found: dict[Point, ExactEquilibrium] = {}
        self._strategies: dict[Vertex, Vertex] = {}  # each once, as many equilibria may share it

    def take(self, solutions: Sequence[Point], check: Callable[[], None]) -> None:
        """Make equilibria of extreme solutions. `check` is called before each."""
        for z in solutions:
            if z not in self._found:
                check()
                self._found[z] = self.equilibrium(z)

    def arranged(self, pieces: Sequence[Piece], complete: bool) -> tuple[Sequence[Piece], list[Point], Equilibria]:
        """Return pieces and their vertices, which `take` has received, in the order of their equilibria, and the
        latter. complete : whether the pieces are proved to be all."""
        found = {z: self._found[z] for piece in pieces for z in piece.vertices}
        points = sorted(found, key=lambda z: (found[z].row, found[z].column), reverse=True)
        place = {z: k for k, z in enumerate(points)}
        own = [replace(piece, vertices=tuple(sorted(piece.vertices, key=place.__getitem__))) for piece in pieces]
        own.sort(key=lambda piece: [place[z] for z in piece.vertices])
        parts = [[(found[z].row, found[z].column, place[z]) for z in piece.vertices] for piece in own]
        subsets = tuple(NashSubset(*(tuple(dict.fromkeys(each)) for each in zip(*part, strict=True))) for part in parts)
        extreme = tuple(found[z] for z in points)
        is_degenerate = True if any(each.index is None for each in extreme) else False if complete else None
        first: dict[int, int] = {}
        edges = [(first.setdefault(shared, k), k) for k, subset in enumerate(subsets) for shared in subset.extreme]
        components = tuple(map(tuple, connected(len(subsets), edges))) if complete else None
        return own, points, Equilibria(extreme, subsets, components, is_degenerate, complete)

    def equilibrium(self, z: Sequence[Fraction]) -> ExactEquilibrium:
        """Return the equilibrium of the strategies in z, each divided by the other's costs; best replies have w = 0."""
        m, (r, c) = self._rows, self._constants
        x, y = (self._strategies.setdefault(own, own) for own in map(_strategy, (z[:m], z[m:])))
        replies = [i for i, value in enumerate(self._data.w(z)) if not value]
        rows, columns = [i for i in replies if i < m], [j for j in replies if j >= m]
        is_regular = replies == [i for i, value in enumerate(z) if value] and len(rows) == len(columns)
        payoffs = r - 1 / sum(z[m:], Fraction(0)), c - 1 / sum(z[:m], Fraction(0))
        return ExactEquilibrium(x, y, payoffs, self._index(rows, columns) if is_regular else None)

    def _index(self, rows: Sequence[int], columns: Sequence[int]) -> int:
        """Return the sign of the determinants of the costs on the supports, times -1 for each strategy but one in the
        supports (L. S. Shapley, Mathematical Programming Study 1 (1974) 175-189, where the determinants are of positive
        payoffs, each with that factor); 1 for a pure equilibrium."""
        M = self._data.rows
        signs = [
            elimination.determinant([[M[i][j] for j in others] for i in own]) > 0
            for own, others in ((rows, columns), (columns, rows))
        ]
        return 1 if (len(rows) % 2 == 1) == (signs[0] == signs[1]) else -1


def _strategy(multiple: Sequence[Fraction]) -> Vertex:
    weights, _ = over_one_denominator(multiple)
    total = sum(weights)
    return Vertex(Fraction(weight, total) for weight in weights)
