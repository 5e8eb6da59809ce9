"""Numbers as they are written, in a problem of doubles: each double stands for one number of the text alone.

So what is made of the doubles by moving them and changing their signs can be said of the numbers: the rows of a program
in its conditions, the same in another format.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Generic, TypeVar

import numpy as np

from lcpcli.model.origins import Game
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import LARGEST_INTEGER, fraction, places, rounded
from lcpcli.rational.problem import ExactParts, decimal_parts_of, parts_of, parts_of_game, shortest_decimal
from lcpcli.typing import Matrix, Vector

SHORTEST = 15  # digits that every double has
LARGEST = math.nextafter(math.inf, 0.0)

T = TypeVar("T")


@dataclass(frozen=True)
class Written(Generic[T]):
    """What was read.

    rounded : with the nearest doubles. own : with a double of its own for each number. exact : what those doubles stand
    for that stand for anything else than their shortest decimals.
    """

    rounded: T
    own: T
    exact: Mapping[float, Fraction]

    def number(self, double: float) -> Fraction:
        """The number that a double of `own` stands for."""
        return self.exact[double] if double in self.exact else shortest_decimal(double)


class Doubles:
    """The doubles of the numbers of a text that is read twice: at first the nearest ones, then one for each number."""

    def __init__(self) -> None:
        self._sizes: set[float] = set()  # of those that are the shortest decimals of their doubles
        self._others: set[Fraction] = set()
        self._places: dict[Fraction, float] | None = None  # the doubles of all sizes; None when read at first

    def __call__(self, text: str) -> float:
        """The double of a decimal text; of one that is not finite that."""
        double = float(text)
        is_short = len(text) <= SHORTEST and "e" not in text.casefold()
        return self._of_double(double) if is_short or repr(double) == text else self.of(fraction(text), double)

    def of(self, value: Fraction, double: float | None = None) -> float:
        """The double of a number, which the nearest one may be given with."""
        double = float(rounded([value])[0]) if double is None else double
        if not math.isfinite(double) or shortest_decimal(double) == value:
            return self._of_double(double)
        if self._places is None:
            self._others.add(abs(value))
            return double
        return self._places[abs(value)] * (-1 if value < 0 else 1)

    def _of_double(self, double: float) -> float:
        if not math.isfinite(double):
            return double
        if self._places is None:
            self._sizes.add(abs(double))
            return double
        return math.copysign(self._places[shortest_decimal(abs(double))], double)

    def settled(self) -> Mapping[float, Fraction] | None:
        """What the doubles stand for from now on; None if the nearest ones already stand for one number each."""
        if not self._others:
            return None
        sizes = sorted({*self._others, *map(shortest_decimal, self._sizes)})
        self._places = dict(zip(sizes, _places(sizes), strict=True))
        own = [(place, size) for size, place in self._places.items() if shortest_decimal(place) != size]
        return dict(own) | {-place: -size for place, size in own}


def _places(sizes: list[Fraction]) -> list[float]:
    """A double for each of some different numbers, in the same order; integers, which may be indices, are kept."""
    found: list[float] = []
    for size in sizes:
        nearest = float(size)
        is_kept = size.denominator == 1 and size <= LARGEST_INTEGER
        above = math.nextafter(found[-1] if found else 0.0, math.inf)
        found.append(nearest if is_kept else min(max(nearest, above), LARGEST))
        i = len(found) - 1
        while i and found[i - 1] >= found[i]:
            found[i - 1] = math.nextafter(found[i], 0.0)
            i -= 1
    return found


def written(parse: Callable[[Doubles], T]) -> Written[T]:
    """What parse makes of a text, given what makes doubles of its numbers."""
    doubles = Doubles()
    nearest = parse(doubles)
    exact = doubles.settled()
    return Written(nearest, nearest, {}) if exact is None else Written(nearest, parse(doubles), exact)


def exact_parts(parse: Callable[[Doubles], Problem | Matrix]) -> ExactParts:
    """The problem, or M alone, with the numbers as they are written; of a game, which keeps its payoffs as they are
    written, the shortest decimals."""
    found = written(parse)
    if isinstance(found.own, Problem) and isinstance(found.rounded, Problem):
        is_other = found.own.n != found.rounded.n  # the sides of a row of a program are the same double
        if is_other or isinstance(found.rounded.origin, Game):
            return decimal_parts_of(found.rounded)
    return parts_of(found.own, found.number)


def exact_vector(parse: Callable[[Doubles], Vector]) -> list[Fraction]:
    """A vector with the numbers as they are written."""
    found = written(parse)
    return [found.number(value) for value in found.own.tolist()]


def of_game(problem: Problem, game: Game) -> Written[Problem] | None:
    """The problem of a game with its costs as the payoffs are written; None if some are no decimals."""
    costs = parts_of_game(game).M
    if any(places(cost) is None for row in costs for cost in row.values()):
        return None

    def parse(doubles: Doubles) -> Problem:
        M = np.zeros(problem.M.shape)
        for i, row in enumerate(costs):
            M[i, list(row)] = [doubles.of(cost) for cost in row.values()]
        return Problem(M, problem.q, problem.name)

    found = written(parse)
    return Written(problem, found.own, found.exact)
