"""All extreme equilibria of a bimatrix game, by the labelled vertices of its two best-response polytopes.

B. von Stengel, Computing equilibria for two-person games, in: Handbook of Game Theory 3, North-Holland 2002, 1723-1759;
D. Avis, G. Rosenberg, R. Savani and B. von Stengel, Enumeration of Nash equilibria for two-player games, Economic
Theory 42 (2010) 9-37. With positive payoffs these are {x >= 0, B'x <= 1} and {A y <= 1, y >= 0}. A vertex has the label
of each strategy that is not played or is a best reply; a pair of vertices other than 0 that has all labels is, divided
by its sums, an extreme equilibrium. The vertices are simple exactly if the game is nondegenerate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import zip_longest
from math import lcm
from typing import NamedTuple

import numpy as np

from lcpcli.interrupts import TimeIsUp
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.polyhedra import Point, bases
from lcpcli.typing import Vector

ROWS = 256  # vertices that are matched at a time, for the sake of memory

Payoffs = list[list[Fraction]]


class Vertices:
    """Vertices of one player's polytope, 0 apart, as they are found.

    payoffs : of the other player, positive, one row for each strategy of the player. own : the labels of these.
    others : the labels of the columns.
    strategies : the vertices divided by their sums.
    is_simple : whether no vertex so far has more labels than strategies.
    """

    def __init__(self, payoffs: Payoffs, own: Sequence[int], others: Sequence[int], check: Callable[[], None]) -> None:
        rows = {}
        for label, column in zip(others, zip(*payoffs, strict=True), strict=True):
            common = lcm(*(value.denominator for value in column))
            rows[label] = [common, *(-value.numerator * (common // value.denominator) for value in column)]
        self._start = Dictionary(rows, list(own), [*own, *others], check)
        self._own, self._labels = own, sorted([*own, *others])
        self.strategies: list[Point] = []
        self.is_simple = True
        self._unlabelled: list[list[bool]] = []

    def found(self) -> Iterator[None]:
        """Take up one vertex after another."""
        known = set()
        for here, _ in bases(self._start):
            nonzero = tuple(here.value(label) != 0 for label in self._labels)
            if nonzero in known:
                continue
            known.add(nonzero)
            self.is_simple &= nonzero.count(False) == len(self._own)
            values = [here.value(label) for label in self._own]
            if total := sum(values):
                self.strategies.append(tuple(Fraction(value, total) for value in values))
                self._unlabelled.append(list(nonzero))
            yield

    def unlabelled(self) -> Vector:
        """Which labels each vertex lacks, as ones in a row for each."""
        return np.array(self._unlabelled, dtype=float).reshape(-1, len(self._labels))


class Matched(NamedTuple):
    """What was found of both polytopes.

    rows, columns : the strategies of the vertices. pairs : which of them, counted from 0, are extreme equilibria, to be
    taken once.
    is_simple : whether all vertices are. complete : whether these are proved to be all.
    """

    rows: list[Point]
    columns: list[Point]
    pairs: Iterator[tuple[int, int]]
    is_simple: bool
    complete: bool


def extreme_equilibria(A: Payoffs, B: Payoffs, check: Callable[[], None]) -> Matched:
    """The extreme equilibria for positive payoffs A of the row and B of the column player.

    `check` is called before each pivot; if it raises TimeIsUp, what was found by then is returned.
    """
    m, k = len(A), len(A[0])
    rows, columns = range(m), range(m, m + k)
    one = Vertices(B, rows, columns, check)
    other = Vertices([list(column) for column in zip(*A, strict=True)], columns, rows, check)
    complete = True
    try:
        for _ in zip_longest(one.found(), other.found()):
            pass
    except TimeIsUp:
        complete = False
    pairs = _matched(one.unlabelled(), other.unlabelled())
    return Matched(one.strategies, other.strategies, pairs, one.is_simple and other.is_simple, complete)


def _matched(unlabelled: Vector, others: Vector) -> Iterator[tuple[int, int]]:
    """The pairs of rows without a common one."""
    for start in range(0, len(unlabelled), ROWS):
        for i, j in np.argwhere(unlabelled[start : start + ROWS] @ others.T == 0).tolist():
            yield start + i, j
