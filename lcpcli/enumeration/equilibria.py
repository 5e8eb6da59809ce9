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
from lcpcli.enumeration.graphs import bicliques, connected
from lcpcli.interrupts import TimeIsUp
from lcpcli.rational import elimination
from lcpcli.rational.polyhedra import Point
from lcpcli.rational.sums import over_one_denominator

Rows = list[list[int]]
Scaled = tuple[Rows, int]  # rows of integers, and what they are to be divided by


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
        place = {k: number for number, k in enumerate(kept)}
        renumbered = tuple(replace(each, extreme=tuple(place[k] for k in each.extreme)) for each in subsets)
        extreme = tuple(self.extreme[k] for k in kept)
        return Equilibria(extreme, renumbered, components(renumbered), self.is_degenerate, complete=False)


def equilibria(A: Payoffs, B: Payoffs, check: Callable[[], None]) -> Equilibria:
    """All equilibria of the game with the payoffs A of the row and B of the column player, in exact arithmetic.

    `check` is called before each step; if it raises TimeIsUp, what was found by then is put together and returned, for
    which it is called on.
    """
    positive = _shifted(A), _shifted(B)
    found = extreme_equilibria(*positive, check)
    own = _in_integers(A), _in_integers([list(column) for column in zip(*B, strict=True)])
    counted = (
        (_in_integers(positive[0])[0], _in_integers(positive[1])[0]) if found.complete and found.is_simple else None
    )
    complete = found.complete
    extreme: list[Equilibrium] = []
    try:
        for i, j in found.pairs:
            check()
            extreme.append(_verified(*own, found.rows[i], found.columns[j], counted))
    except TimeIsUp:
        complete = False
    extreme.sort(key=lambda each: (each.row, each.column), reverse=True)
    subsets, are_all = nash_subsets(extreme, check)
    is_degenerate = None if found.is_simple and not found.complete else not found.is_simple
    if are_all:
        return Equilibria(tuple(extreme), subsets, components(subsets), is_degenerate, complete)
    return Equilibria(tuple(extreme), subsets, (), is_degenerate, complete=False).first(len(subsets))


def nash_subsets(extreme: Sequence[Equilibrium], check: Callable[[], None]) -> tuple[tuple[NashSubset, ...], bool]:
    """The maximal bicliques, and whether these are all; `check` as in `bicliques`."""
    rows, columns = (sorted(set(own), reverse=True) for own in ([e.row for e in extreme], [e.column for e in extreme]))
    row, column = ({strategy: k for k, strategy in enumerate(own)} for own in (rows, columns))
    number = {(row[each.row], column[each.column]): k for k, each in enumerate(extreme)}
    subsets: list[NashSubset] = []
    try:
        for some, others in bicliques(list(number), check):
            strategies = tuple(rows[i] for i in some), tuple(columns[j] for j in others)
            subsets.append(NashSubset(*strategies, tuple(sorted(number[i, j] for i in some for j in others))))
    except TimeIsUp:
        complete = False
    else:
        complete = True
    return tuple(sorted(subsets, key=lambda subset: subset.extreme)), complete


def components(subsets: Sequence[NashSubset]) -> tuple[tuple[int, ...], ...]:
    """Which subsets are connected, through extreme equilibria that they share."""
    first: dict[int, int] = {}
    edges = [(first.setdefault(shared, k), k) for k, subset in enumerate(subsets) for shared in subset.extreme]
    return tuple(map(tuple, connected(len(subsets), edges)))


def _shifted(payoffs: Payoffs) -> Payoffs:
    """Payoffs plus a constant, positive."""
    least = min(map(min, payoffs))
    return [[value - least + 1 for value in row] for row in payoffs]


def _verified(A: Scaled, B: Scaled, x: Point, y: Point, positive: tuple[Rows, Rows] | None) -> Equilibrium:
    """The equilibrium of these strategies, both best replies; ArithmeticError if they are not.

    A, B : the payoffs of the strategies of the row and of the column player. positive : both matrices times positive
    numbers, made positive, of a nondegenerate game.
    """
    payoffs = _best(A, x, y), _best(B, y, x)
    return Equilibrium(x, y, payoffs, None if positive is None else _index(*positive, x, y))


def _best(payoffs: Scaled, own: Point, other: Point) -> Fraction:
    """What a best reply to the other player's strategy gets, which the own one is; ArithmeticError if it is none."""
    rows, common = payoffs
    weights, d = over_one_denominator(other)
    played = [(j, weight) for j, weight in enumerate(weights) if weight]
    values = [sum(row[j] * weight for j, weight in played) for row in rows]
    best = max(values)
    if any(value < best for value, probability in zip(values, own, strict=True) if probability):
        raise ArithmeticError("an equilibrium that was found is none")
    return Fraction(best, common * d)


def _index(A: Rows, B: Rows, x: Point, y: Point) -> int:
    """L. S. Shapley, A note on the Lemke-Howson algorithm, Mathematical Programming Study 1 (1974) 175-189: the sign of
    the determinants of the payoffs on the supports, and -1 for each but one strategy in these; 1 for a pure one."""
    rows, columns = ([i for i, value in enumerate(strategy) if value] for strategy in (x, y))
    signs = [elimination.determinant([[P[i][j] for j in columns] for i in rows]) > 0 for P in (A, B)]
    return 1 if (len(rows) % 2 == 1) == (signs[0] == signs[1]) else -1


def _in_integers(payoffs: Payoffs) -> Scaled:
    """Payoffs times one positive number, and that number."""
    common = lcm(*(value.denominator for row in payoffs for value in row))
    return [[value.numerator * (common // value.denominator) for value in row] for row in payoffs], common
