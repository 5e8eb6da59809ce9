"""The affine hull of a polyhedron C, and the sign of a quadratic form on it, in exact
arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from lcpcli.rational import elimination
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import primitive, zeros

Directions = list[list[int]]
Row = dict[int, Fraction]  # the entries by columns
Sides = tuple[Fraction | None, Fraction | None]


class Constraint(NamedTuple):
    """The constraint factor (a'x - side) >= 0, or = 0 for an equation."""

    a: Row
    side: Fraction
    factor: int
    is_equation: bool = False


def hull(
    data: ExactProblem, k: int, ranges: int, check: Callable[[], None]
) -> Directions | None:
    """Return an integer basis of the directions of the affine hull of C; None if C is
    empty.

    data : the conditions of k variables, with `ranges` rows between two different
        bounds.
    check : is called before each pivot and may raise an exception.
    """
    rows, equations = dict[int, list[int]](), set[int]()
    for variable, each in enumerate(_constraints(data, k, ranges), k):
        numbers = [-each.side, *(each.a.get(j, Fraction(0)) for j in range(k))]
        common = each.factor * math.lcm(*(value.denominator for value in numbers))
        rows[variable] = primitive([int(value * common) for value in numbers])
        if each.is_equation:
            equations.add(variable)
    others = [variable for variable in rows if variable not in equations]
    polyhedron = Dictionary(rows, list(range(k)), (), check)
    if not all(map(polyhedron.vanish, sorted(equations))):
        return None
    if not all(map(polyhedron.require, others)):
        return None
    for variable in others:  # those that hold with equality throughout
        if polyhedron.is_zero(variable):
            polyhedron.vanish(variable)
    columns = range(1, len(polyhedron.cobasic) + 1)
    return [polyhedron.direction(column, range(k)) for column in columns]


def _constraints(data: ExactProblem, k: int, ranges: int) -> Iterator[Constraint]:
    n, zero = data.n, Fraction(0)
    M, q = data.M[k : n - ranges], data.w(zeros(n))[k : n - ranges]
    bounds = list(zip(data.lower, data.upper, strict=True))
    units = [{j: Fraction(1)} for j in range(k)]
    yield from _between(units, zeros(k), bounds)
    sides = list[Sides]()
    for row, (low, high) in zip(M, bounds[k:], strict=False):
        slack = next((j for j in row if j >= n - ranges), None)
        if slack is not None:
            sides.append(bounds[slack])
        else:  # a multiplier without a bound below belongs to an upper side
            sides.append((None if high == 0 else zero, None if low == 0 else zero))
    yield from _between(
        [{j: a for j, a in row.items() if j < k} for row in M], q, sides
    )


def _between(
    rows: Iterable[Row], constants: Iterable[Fraction], sides: Iterable[Sides]
) -> Iterator[Constraint]:
    """Yield the constraints of rows a'x + constant between a lower and an upper
    bound.
    """
    for a, constant, (low, high) in zip(rows, constants, sides, strict=False):
        if low is not None and low == high:
            yield Constraint(a, low - constant, 1, is_equation=True)
            continue
        if low is not None:
            yield Constraint(a, low - constant, 1)
        if high is not None:
            yield Constraint(a, high - constant, -1)


def form_on(
    data: ExactProblem, k: int, directions: Directions, check: Callable[[], None]
) -> elimination.Definiteness:
    """Return whether d'Hd is positive, nonnegative or sometimes negative for the
    directions d that these span.
    """
    common = math.lcm(*data.scales[:k])
    scales = [common // scale for scale in data.scales[:k]]
    rows = [
        [scales[i] * row.get(j, 0) for j in range(k)]
        for i, row in enumerate(data.rows[:k])
    ]
    images = [[_dot(row, d) for row in rows] for d in directions]
    products = [[_dot(d, image) for image in images] for d in directions]
    return elimination.definiteness(elimination.symmetrized(products), check)


def _dot(a: Sequence[int], b: Sequence[int]) -> int:
    return sum(map(int.__mul__, a, b))
