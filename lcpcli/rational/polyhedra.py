"""The vertices, rays and lines of a polyhedron, in exact arithmetic, by a walk over its feasible bases.

Ties are broken lexicographically, as if each form that is basic at the start were relaxed a little, those that come
first incomparably more: then every vertex is simple, and the graph of vertices and edges, which is connected, has been
walked completely once no edge leads to a new one. (D. Avis, A revised implementation of the reverse search vertex
enumeration algorithm, in: Polytopes - Combinatorics and Computation, Birkhäuser 2000, with the same pivots; here the
bases are remembered, so that each is visited once.)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.sums import primitive

Point = tuple[Fraction, ...]
Direction = tuple[int, ...]


class Generators(NamedTuple):
    """The polyhedron of all convex combinations of vertices, plus nonnegative combinations of rays, plus lines.

    Each is given by the values of some forms; those of rays and lines are integers without a common divisor. Where
    there are lines, there is a point of each smallest face in place of the vertices.
    """

    vertices: list[Point]
    rays: list[Direction]
    lines: list[Direction]


def generators(start: Dictionary, forms: Sequence[int]) -> Generators:
    """The generators of a polyhedron from a feasible dictionary, as values of the forms, which tell points apart."""
    start = start.copy()
    lines = _without_lines(start, forms)
    vertices: dict[Point, None] = {}
    rays: dict[Direction, None] = {}
    for here, unbounded in bases(start):
        vertices[tuple(Fraction(here.value(form), int(here.divisor)) for form in forms)] = None
        rays.update((_direction(here, k, forms), None) for k in unbounded)
    return Generators(list(vertices), list(rays), lines)


def bases(here: Dictionary) -> Iterator[tuple[Dictionary, list[int]]]:
    """The bases at all vertices, each vertex at least once, with the columns of unbounded edges, counted from 1.

    here : a feasible dictionary whose cobasic forms are signed. It is pivoted from basis to basis, depth first and back
    again, so that no other one is kept.
    """
    order = [form for form in here.rows if form in here.signed]
    basis = sum(1 << form for form in here.cobasic)
    seen = {basis}
    moves: list[list[tuple[int, int]]] = []  # of each basis on the way, those that have not been tried
    back: list[tuple[int, int, int]] = []
    while True:
        edges = [(k, _leaving(here, k, order)) for k in range(1, len(here.cobasic) + 1)]
        yield here, [k for k, leaving in edges if leaving is None]
        moves.append([(k, leaving) for k, leaving in edges if leaving is not None])
        while True:
            while not moves[-1]:
                moves.pop()
                if not back:
                    return
                basis, *step = back.pop()
                here.pivot(*step)
            k, leaving = moves[-1].pop()
            entering = here.cobasic[k - 1]
            other = basis ^ 1 << entering ^ 1 << leaving
            if other not in seen:
                break
        seen.add(other)
        back.append((basis, entering, k))
        here.pivot(leaving, k)
        basis = other


def _without_lines(start: Dictionary, forms: Sequence[int]) -> list[Direction]:
    """The lines in the polyhedron, whose columns are taken out of the dictionary; all other columns become signed."""
    lines = []
    for form in [form for form in start.cobasic if form not in start.signed]:
        k = start.cobasic.index(form) + 1
        leaving = start.leaving(k, 1)[0]
        if leaving is None:
            leaving = start.leaving(k, -1)[0]
        if leaving is None:
            lines.append(_direction(start, k, forms))
            start.vanish(form)
        else:
            start.pivot(leaving, k)
    return lines


def _direction(here: Dictionary, k: int, forms: Sequence[int]) -> Direction:
    """How the forms change along the edge of column k."""
    entering = here.cobasic[k - 1]
    changes = [here.divisor if form == entering else here.rows[form][k] if form in here.rows else 0 for form in forms]
    return tuple(primitive(changes))


def _leaving(here: Dictionary, k: int, order: Sequence[int]) -> int | None:
    """The signed form that reaches 0 first as that of column k grows, lexicographically; None if none does."""
    tied: list[int] = []
    value, fall = 0, 1
    for form, row in here.rows.items():
        if row[k] < 0 and form in here.signed:
            difference = row[0] * fall + value * row[k]
            if not tied or difference < 0:
                tied, value, fall = [form], row[0], -row[k]
            elif not difference:
                tied.append(form)
    for relaxed in order:
        if len(tied) <= 1:
            break
        ratios = [Fraction(_change(here, form, relaxed), -int(here.rows[form][k])) for form in tied]
        tied = [form for form, ratio in zip(tied, ratios, strict=True) if ratio == min(ratios)]
    return tied[0] if tied else None


def _change(here: Dictionary, form: int, relaxed: int) -> int:
    """How the value of a basic form changes, times the divisor, as another one is relaxed."""
    if form == relaxed:
        return int(here.divisor)
    return -int(here.rows[form][here.cobasic.index(relaxed) + 1]) if relaxed in here.cobasic else 0
