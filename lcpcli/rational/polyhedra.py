"""The vertices, rays and lines of a polyhedron, in exact arithmetic, by a walk over its feasible bases.

Ties are broken lexicographically, as if each form that is basic at the start were relaxed a little, those that come
first by far more: then every vertex is simple, and the graph of vertices and edges, which is connected, has been walked
completely once no edge leads to a new one. (D. Avis, A revised implementation of the reverse search vertex enumeration
algorithm, in: Polytopes - Combinatorics and Computation, Birkhäuser 2000, with the same pivots; here the bases are
remembered, so that each is visited once.)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import product

from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.numbers import primitive

Point = tuple[Fraction, ...]
Direction = tuple[int, ...]


class Vertex(Point):
    """A point whose hash is computed once, as the hash of a fraction takes long."""

    _hash: int | None = None

    def __hash__(self) -> int:
        if self._hash is None:
            self._hash = super().__hash__()
        return self._hash


def generators(start: Dictionary, forms: Sequence[int], most: float = math.inf) -> list[list[Direction]] | None:
    """Return the vertices, rays and lines of a polyhedron from a feasible dictionary; None if they take more than
    `most` bases. The polyhedron is the product of the polyhedra of independent parts.

    Each is given by the values of forms that distinguish points, in integers without a common divisor; the values of a
    vertex are divided by the number before them. If there are lines, points, one on each minimal face, take the place
    of the vertices.
    """
    start = start.copy()
    lines = _without_lines(start, forms)
    place = {form: i for i, form in enumerate(forms, 1)}
    still = set(place)
    factors: list[tuple[list[int], list[Direction]]] = []
    rays: list[Direction] = []
    for part in _parts(start):
        own = [form for form in (*part.cobasic, *part.rows) if form in place]
        still -= set(own)
        found: dict[Direction, None] = {}
        directions: dict[Direction, None] = {}
        for here, unbounded in bases(part):
            most -= 1
            if most < 0:
                return None
            found[_values(here, own)] = None
            directions.update((tuple(here.direction(k, forms)), None) for k in unbounded)
        factors.append(([place[form] for form in own], list(found)))
        rays += directions
    if math.prod(len(points) for _, points in factors) > most:
        return None
    factors.append(([place[form] for form in still], [_values(start, still)]))
    vertices = []
    values = [0] * (len(forms) + 1)
    for chosen in product(*(points for _, points in factors)):
        start.check()
        values[0] = math.lcm(*(point[0] for point in chosen))
        for (places, _), (divisor, *point) in zip(factors, chosen, strict=True):
            factor = values[0] // divisor
            for i, value in zip(places, point, strict=True):
                values[i] = factor * value
        vertices.append(tuple(values))
    return [vertices, rays, lines]


def _values(here: Dictionary, forms: Iterable[int]) -> Direction:
    """Return the values of forms at the point, after the number by which they are divided."""
    return tuple(primitive([here.divisor, *(here.value(form) for form in forms)]))


def _parts(whole: Dictionary) -> Iterator[Dictionary]:
    """Yield the independent parts of a dictionary, whose rows have no column in common."""
    rows = list(whole.rows.items())
    first = len(whole.cobasic)
    edges = ((k, first + i) for i, (_, row) in enumerate(rows) for k in range(first) if row[k + 1])
    for nodes in connected(first + len(rows), edges):
        columns = [k for k in nodes if k < first]
        if columns:
            part = whole.copy()
            part.rows = {
                form: [row[0], *(row[k + 1] for k in columns)]
                for form, row in (rows[k - first] for k in nodes[len(columns) :])
            }
            part.cobasic = [whole.cobasic[k] for k in columns]
            yield part


def bases(here: Dictionary) -> Iterator[tuple[Dictionary, list[int]]]:
    """Yield the bases at all vertices, each vertex at least once, with the columns of unbounded edges, counted from
    1. The dictionary is feasible with signed cobasic forms, and is pivoted from basis to basis and back."""
    order = [form for form in here.rows if form in here.signed]
    basis = sum(1 << form for form in here.cobasic)
    seen = {basis}
    moves: list[list[tuple[int, int]]] = []  # of each basis on the way, those that have not been tried
    back: list[tuple[int, int, int]] = []
    while True:
        edges = [(k, here.lexicographic(here.nearest(k), k, order)) for k in range(1, len(here.cobasic) + 1)]
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
    """Return the lines of the polyhedron and take their columns out; all other columns become signed."""
    lines = []
    for form in [form for form in start.cobasic if form not in start.signed]:
        k = start.cobasic.index(form) + 1
        leaving = start.leaving(k, 1)[0]
        if leaving is None:
            leaving = start.leaving(k, -1)[0]
        if leaving is None:
            lines.append(tuple(start.direction(k, forms)))
            start.vanish(form)
        else:
            start.pivot(leaving, k)
    return lines


def connected(n: int, edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Return the connected parts of the graph with the nodes 0, ..., n - 1, each in order, by their least nodes."""
    part = list(range(n))

    def root(i: int) -> int:
        while part[i] != i:
            part[i] = i = part[part[i]]
        return i

    for i, j in edges:
        part[root(j)] = root(i)
    found: dict[int, list[int]] = {}
    for i in range(n):
        found.setdefault(root(i), []).append(i)
    return list(found.values())
