"""All equilibria of a bimatrix game, from the vertices of the polyhedra of best
responses.

For the costs R and C these are {x >= 0, C'x >= e} and {y >= 0, R y >= e}. The extreme
equilibria are the pairs of vertices in which each unknown of one player, or the
inequality of the other player with the same number, is 0. The maximal Nash subsets are
the maximal complete bipartite graphs of these pairs (D. Avis, G. Rosenberg, R. Savani
and B. von Stengel, Enumeration of Nash equilibria for two-player games, Economic Theory
42 (2010) 9-37).

The polyhedron of the player with fewer strategies is enumerated first. Of the other one
only the rays are computed that belong to a pair with one of its vertices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import cache

import numpy as np

from lcpcli.linalg.patterns import connected
from lcpcli.rational.dictionary import RationalPoint, Vertex
from lcpcli.rational.double_description import Rays, extreme_rays
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import zeros
from lcpcli.typing import Mask, Support

# Strategies of the player with fewer of them, and vertices of a polyhedron, up to which
# this takes less time than branch and bound, whose nodes use both polyhedra.
MAX_STRATEGIES = 11
MAX_VERTICES = 15_000


def nash_subsets(
    data: ExactProblem, m: int, check: Callable[[], None]
) -> Iterator[list[RationalPoint]] | None:
    """Return an iterator over the extreme equilibria of each maximal Nash subset, as
    solutions z of the LCP; None if polyhedra have too many vertices.

    m : the number of strategies of the row player. check : called before each step; it
    may raise.
    """
    fewer, more = map(list, sorted((range(m), range(m, data.n)), key=len))
    if len(fewer) > MAX_STRATEGIES:
        return None
    first = _vertices(data, fewer, more, np.zeros((1, data.n), np.float32), check)
    if first is None:
        return None
    # Other strategies are no best reply to any of these vertices.
    replies = [j for j in more if not first.positive[:, j].all()]
    second = _vertices(data, replies, fewer, first.positive, check)
    if second is None:
        return None
    return _listed(data, [(fewer, first), (replies, second)], check)


def _vertices(
    data: ExactProblem,
    unknowns: list[int],
    others: list[int],
    partners: Support,
    check: Callable[[], None],
) -> Rays | None:
    """Return the vertices v of a player's polyhedron as rays (v, t), t > 0, which are
    multiples of (v, 1); None if there are too many.

    unknowns : those of the player that may be positive. others : the other player's
    strategies. partners : the `positive` of vertices, only whose partners are returned.

    `positive` has a column for each unknown of the LCP: whether it is positive, or for
    the other player's strategies, whether their w is.
    """
    forms = [[*(data.rows[i][j] for j in unknowns), data.constants[i]] for i in others]
    # The columns of a ray are the unknowns of the player, t, and the forms.
    columns, t = [*unknowns, *others], len(unknowns)
    excluded = np.insert(partners[:, columns], t, 0, axis=1)
    rays = extreme_rays(forms, excluded, MAX_VERTICES, check)
    if rays is None:
        return None
    chosen = np.flatnonzero(rays.positive[:, t])
    positive = np.zeros((len(chosen), data.n), dtype=np.float32)
    positive[:, columns] = np.delete(rays.positive[chosen], t, axis=1)
    return Rays([rays.values[i] for i in chosen], positive)


def _listed(
    data: ExactProblem,
    sides: Sequence[tuple[list[int], Rays]],
    check: Callable[[], None],
) -> Iterator[list[RationalPoint]]:
    """Yield the extreme equilibria of each maximal Nash subset, from the strategies of
    each player with their unknowns.
    """
    (_, first), (_, second) = sides

    @cache
    def point(*pair: int) -> RationalPoint:
        z = zeros(data.n)
        for (unknowns, rays), i in zip(sides, pair, strict=True):
            *values, t = rays.values[i]
            for k, value in zip(unknowns, values, strict=True):
                z[k] = Fraction(value, t)
        return Vertex(z)

    is_pair = first.positive @ second.positive.T == 0
    for one, other in _maximal(is_pair, check):
        yield [point(i, j) for i in one for j in other]


def _maximal(
    is_pair: Mask, check: Callable[[], None]
) -> Iterator[tuple[list[int], list[int]]]:
    """Yield the rows and the columns of each maximal submatrix without False. Its
    columns are those that some rows have in common.
    """
    m, k = is_pair.shape
    pairs = np.argwhere(is_pair).tolist()
    columns = [0] * m
    for i, j in pairs:
        columns[i] |= 1 << j
    for nodes in connected(m + k, ((i, m + j) for i, j in pairs)):
        rows = [i for i in nodes if i < m]
        listed: dict[int, None] = {}
        for i in rows:
            for common in [columns[i], *(columns[i] & each for each in listed)]:
                check()
                if not common or common in listed:
                    continue
                listed[common] = None
                yield (
                    [row for row in rows if not common & ~columns[row]],
                    [j for j in range(k) if common >> j & 1],
                )
