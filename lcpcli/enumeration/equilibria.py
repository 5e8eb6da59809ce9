"""The equilibria of a game: the extreme ones, the maximal Nash subsets that they span, and the components of these.

The extreme equilibria form a bipartite graph, in which a pair of strategies is an edge. All convex combinations of the
strategies of a maximal biclique are equilibria, a maximal Nash subset; subsets that share an extreme equilibrium are of
one component (D. Avis, G. Rosenberg, R. Savani and B. von Stengel, Enumeration of Nash equilibria for two-player games,
Economic Theory 42 (2010) 9-37).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm

from lcpcli.enumeration.best_replies import Payoffs, extreme_equilibria
from lcpcli.rational import elimination
from lcpcli.rational.polyhedra import Point


@dataclass(frozen=True)
class Equilibrium:
    """An extreme equilibrium.

    row, column : the strategies, exact probabilities. payoffs : what the row and the column player get.
    index : 1 or -1 in a nondegenerate game, where the indices of all equilibria sum to 1; None in a degenerate one.
    """

    row: Point
    column: Point
    payoffs: tuple[Fraction, Fraction]
    index: int | None = None

    @property
    def is_pure(self) -> bool:
        """Whether both players play one strategy only."""
        return max(self.row) == 1 == max(self.column)


@dataclass(frozen=True)
class NashSubset:
    """A maximal Nash subset: all convex combinations of these strategies of each player, in any pairing.

    rows, columns : the strategies. extreme : which extreme equilibria they pair up to, counted from 0.
    """

    rows: tuple[Point, ...]
    columns: tuple[Point, ...]
    extreme: tuple[int, ...]


@dataclass(frozen=True)
class Equilibria:
    """The equilibria of a game of two players.

    extreme : the extreme equilibria. subsets : the maximal Nash subsets, whose union are all equilibria.
    components : which subsets are connected, counted from 0. is_degenerate : whether the game is, so that there may be
    equilibria that are not isolated; None if that is not known. complete : whether these are proved to be all; if not,
    subsets and components are those of the equilibria that were found.
    """

    extreme: tuple[Equilibrium, ...]
    subsets: tuple[NashSubset, ...]
    components: tuple[tuple[int, ...], ...]
    is_degenerate: bool | None
    complete: bool

    def first(self, number: int) -> Equilibria:
        """So many of the subsets, with their equilibria."""
        subsets = self.subsets[:number]
        kept = sorted({k for subset in subsets for k in subset.extreme})
        renumbered = tuple(replace(each, extreme=tuple(map(kept.index, each.extreme))) for each in subsets)
        extreme = tuple(self.extreme[k] for k in kept)
        return Equilibria(extreme, renumbered, components(renumbered), self.is_degenerate, complete=False)


def equilibria(A: Payoffs, B: Payoffs, check: Callable[[], None]) -> Equilibria:
    """All equilibria of the game with the payoffs A of the row and B of the column player, in exact arithmetic.

    `check` is called before each pivot; if it raises TimeIsUp, what was found by then is returned.
    """
    positive = _shifted(A), _shifted(B)
    found = extreme_equilibria(*positive, check)
    counted = positive if found.complete and found.is_simple else None
    pairs = sorted(((found.rows[i], found.columns[j]) for i, j in found.pairs), reverse=True)
    extreme = tuple(_verified(A, B, x, y, counted) for x, y in pairs)
    subsets = nash_subsets(extreme)
    is_degenerate = None if found.is_simple and not found.complete else not found.is_simple
    return Equilibria(extreme, subsets, components(subsets), is_degenerate, found.complete)


def nash_subsets(extreme: Sequence[Equilibrium]) -> tuple[NashSubset, ...]:
    """The maximal bicliques: intersections of what goes with each strategy, and all that goes with these."""
    columns_of: dict[Point, set[Point]] = {}
    for each in extreme:
        columns_of.setdefault(each.row, set()).add(each.column)
    closed: set[frozenset[Point]] = set()
    for chosen in columns_of.values():
        closed |= {frozenset(chosen), *(held & chosen for held in closed)}
    number = {(each.row, each.column): k for k, each in enumerate(extreme)}
    subsets = []
    for held in closed - {frozenset()}:
        rows = sorted((row for row, columns in columns_of.items() if held <= columns), reverse=True)
        columns = sorted(held, reverse=True)
        pairs = tuple(sorted(number[row, column] for row in rows for column in columns))
        subsets.append(NashSubset(tuple(rows), tuple(columns), pairs))
    return tuple(sorted(subsets, key=lambda subset: subset.extreme))


def components(subsets: Sequence[NashSubset]) -> tuple[tuple[int, ...], ...]:
    """Which subsets are connected, through extreme equilibria that they share."""
    found: list[tuple[set[int], list[int]]] = []
    for k, subset in enumerate(subsets):
        shared = [each for each in found if each[0] & set(subset.extreme)]
        found = [each for each in found if each not in shared]
        held = [k, *(member for _, members in shared for member in members)]
        found.append((set(subset.extreme).union(*(extreme for extreme, _ in shared)), sorted(held)))
    return tuple(sorted(tuple(members) for _, members in found))


def _shifted(payoffs: Payoffs) -> Payoffs:
    """Payoffs plus a constant, positive."""
    least = min(map(min, payoffs))
    return [[value - least + 1 for value in row] for row in payoffs]


def _verified(A: Payoffs, B: Payoffs, x: Point, y: Point, positive: tuple[Payoffs, Payoffs] | None) -> Equilibrium:
    """The equilibrium of these strategies, both best replies; ArithmeticError if they are not.

    positive : the payoffs, made positive, of a nondegenerate game.
    """
    by_row = [_dot(row, y) for row in A]
    by_column = [_dot(column, x) for column in zip(*B, strict=True)]
    payoffs = max(by_row), max(by_column)
    if (_dot(by_row, x), _dot(by_column, y)) != payoffs:
        raise ArithmeticError("an equilibrium that was found is none")
    return Equilibrium(x, y, payoffs, None if positive is None else _index(*positive, x, y))


def _index(A: Payoffs, B: Payoffs, x: Point, y: Point) -> int:
    """L. S. Shapley, A note on the Lemke-Howson algorithm, Mathematical Programming Study 1 (1974) 175-189: the sign of
    the determinants of the payoffs on the supports, and -1 for each but one strategy in these; 1 for a pure one."""
    rows, columns = ([i for i, value in enumerate(strategy) if value] for strategy in (x, y))
    signs = [elimination.determinant(_integers([[P[i][j] for j in columns] for i in rows])) > 0 for P in (A, B)]
    return 1 if (len(rows) % 2 == 1) == (signs[0] == signs[1]) else -1


def _integers(payoffs: Payoffs) -> list[list[int]]:
    """Payoffs times one positive number."""
    common = lcm(*(value.denominator for row in payoffs for value in row))
    return [[value.numerator * (common // value.denominator) for value in row] for row in payoffs]


def _dot(values: Sequence[Fraction], weights: Sequence[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(values, weights, strict=True)), Fraction(0))
