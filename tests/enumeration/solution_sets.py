"""The solution sets of small problems, in rational arithmetic: every choice of states,
each a polyhedron.

Nothing here is shared with the package. The vertices of a polyhedron are the feasible
intersections of as many of its hyperplanes as it takes, its rays the feasible
directions that lie in all but one of these.
"""

from fractions import Fraction
from itertools import combinations, product
from math import gcd, lcm
from typing import NamedTuple

import numpy as np

from ..exact import dot, leading, reduced, solved, unit

Row = tuple[Fraction, ...]  # of a'z + b, with b last


class Data(NamedTuple):
    """M, q, l and u in fractions, None for no bound."""

    M: list[Row]
    q: Row
    lower: list[Fraction | None]
    upper: list[Fraction | None]


class Hull(NamedTuple):
    """Vertices, rays and lines in a form of which there is one only."""

    vertices: frozenset[Row]
    rays: frozenset[Row]
    lines: frozenset[Row]


class Polyhedron(NamedTuple):
    """All z with these equations, a'z + b = 0, and inequalities, a'z + b >= 0."""

    equations: list[Row]
    inequalities: list[Row]

    def holds(self, hull):
        points = [(*vertex, Fraction(1)) for vertex in hull.vertices]
        rays = [(*ray, Fraction(0)) for ray in hull.rays]
        lines = [(*line, Fraction(0)) for line in hull.lines]
        return not any(
            dot(row, x) for row in self.equations for x in points + rays + lines
        ) and all(
            dot(row, x) >= 0
            for row in self.inequalities
            for x in points + rays + [*lines, *map(negative, lines)]
        )

    def hull(self, n):
        """Its vertices, rays and lines; None if it is empty."""
        lines = null_space([row[:-1] for row in self.equations + self.inequalities], n)
        across = [unit(leading(line), n + 1) for line in lines]
        fixed = reduced([*self.equations, *across], n)
        missing = n - len([row for row in fixed if any(row[:-1])])
        within = Polyhedron([*self.equations, *across], self.inequalities)
        vertices = set()
        for rows in combinations(self.inequalities, missing):
            z = solved([*fixed, *rows], n)
            if z is not None and within.holds(
                Hull(frozenset([z]), frozenset(), frozenset())
            ):
                vertices.add(z)
        if not vertices:
            return None
        rays = set()
        for rows in combinations(self.inequalities, missing - 1) if missing else ():
            found = null_space([row[:-1] for row in [*fixed, *rows]], n)
            for ray in (found[0], negative(found[0])) if len(found) == 1 else ():
                if within.holds(Hull(frozenset(), frozenset([ray]), frozenset())):
                    rays.add(primitive(ray))
        return Hull(frozenset(vertices), frozenset(rays), frozenset(lines))


def maximal(data):
    n = len(data.q)
    found = [
        (each, hull) for each in choices(data) if (hull := each.hull(n)) is not None
    ]
    hulls = {hull for _, hull in found}
    return {
        hull
        for hull in hulls
        if not any(each.holds(hull) and other != hull for each, other in found)
    }


def choices(data):
    """The polyhedron of each choice of states."""
    n = len(data.q)
    options = []
    for i, (a, b, low, high) in enumerate(
        zip(data.M, data.q, data.lower, data.upper, strict=True)
    ):
        w, own = (*a, b), unit(i, n)
        above = [] if low is None else [(*own, -low)]
        below = [] if high is None else [negative((*own, -high))]
        if low is not None and low == high:
            options.append([(above, [])])
            continue
        options.append([([w], above + below)])
        options[-1] += [(above, [w])] * (low is not None) + [(below, [negative(w)])] * (
            high is not None
        )
    for chosen in product(*options):
        yield Polyhedron(
            [row for part in chosen for row in part[0]],
            [row for part in chosen for row in part[1]],
        )


def canonical(vertices, rays, lines):
    """A hull from any generators of it."""
    basis = reduced([list(map(Fraction, line)) for line in lines], len(vertices[0]))
    return Hull(
        frozenset(across(vertex, basis) for vertex in vertices),
        frozenset(primitive(across(ray, basis)) for ray in rays),
        frozenset(basis),
    )


def across(point, lines):
    """The point moved along lines in reduced form to where their leading components are
    0."""
    for line in lines:
        factor = point[leading(line)]
        point = tuple(a - factor * b for a, b in zip(point, line, strict=True))
    return point


def null_space(rows, n):
    """The directions in which all a'z are 0, a basis of them in reduced row echelon
    form."""
    found = reduced(rows, n)
    basis = []
    for j in set(range(n)) - {leading(row) for row in found}:
        v = unit(j, n)
        for row in found:
            v[leading(row)] = -row[j]
        basis.append(tuple(v))
    return reduced(basis, n)


def primitive(v):
    """The multiple in integers without a common divisor."""
    d = lcm(*(value.denominator for value in v))
    whole = [int(value * d) for value in v]
    return tuple(Fraction(value, gcd(*whole) or 1) for value in whole)


def negative(row):
    return tuple(-value for value in row)


def random_problem(generator, most, least=1):
    """M, q, l and u of small integers, most of them degenerate or singular; half of
    them are LCPs."""
    n, size = int(generator.integers(least, most + 1)), int(generator.integers(1, 3))
    M = generator.integers(-size, size + 1, (n, n))
    kind = generator.integers(7)
    if kind < 4:
        M = (
            M @ M.T,
            M - M.T,
            np.outer(M[0], M[:, 0]),
            M[generator.integers(n, size=n)],
        )[kind]
    elif kind == 4:
        M = np.where(generator.random((n, n)) < 0.5, M, 0)
    q = (
        generator.integers(-2, 3, n)
        if generator.random() < 0.4
        else -M @ generator.integers(0, 2, n)
    )
    if generator.random() < 0.3:  # an unknown apart
        j = generator.integers(n)
        M[j], M[:, j], q[j] = 0, 0, 0
    lower, upper = np.zeros(n), np.full(n, np.inf)
    if generator.random() < 0.5:
        for i, state in enumerate(generator.integers(6, size=n).tolist()):
            low, high = np.sort(generator.integers(-1, 2, 2)).tolist()
            lower[i] = 0 if state == 0 else low if state in (1, 3, 4) else -np.inf
            upper[i] = low if state == 4 else high if state in (2, 3) else np.inf
    return M.astype(float), q.astype(float), lower, upper


def in_fractions(M, q, lower, upper):
    bounds = [
        [Fraction(v) if np.isfinite(v) else None for v in bound.tolist()]
        for bound in (lower, upper)
    ]
    return Data(
        [tuple(map(Fraction, row)) for row in M.tolist()],
        tuple(map(Fraction, q.tolist())),
        *bounds,
    )
