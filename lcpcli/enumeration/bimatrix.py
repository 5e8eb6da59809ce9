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
from functools import lru_cache
from itertools import product

import numpy as np

from lcpcli.linalg.patterns import connected
from lcpcli.rational.dictionary import RationalPoint, Vertex
from lcpcli.rational.double_description import Rays, extreme_rays, parts
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.rational.numbers import zeros
from lcpcli.typing import Support

# Strategies of the player with fewer of them up to which this takes less time than
# branch and bound, whose nodes use both polyhedra.
MAX_STRATEGIES = 11

# Vertices that are cached, as they may belong to several pieces: this many take little
# memory.
MAX_REMEMBERED = 10_000

Check = Callable[[], None]


def nash_subsets(
    data: ExactProblem, m: int, max_vertices: int, check: Check
) -> Iterator[Iterator[RationalPoint]] | None:
    """Return an iterator over the extreme equilibria of each maximal Nash subset, as
    solutions z of the LCP; None if a polyhedron has too many vertices, or the players
    too many strategies.

    m : the number of strategies of the row player; 0 if there is no game. check :
    called before each step; it may raise.
    """
    fewer, more = map(list, sorted((range(m), range(m, data.n)), key=len))
    if not 0 < len(fewer) <= MAX_STRATEGIES:
        return None
    anything = np.zeros((1, data.n), np.float32)
    first = _vertices(data, (fewer, more), anything, max_vertices, check)
    if first is None:
        return None
    # Other strategies are no best reply to any of these vertices.
    replies = [j for j in more if not first.positive[:, j].all()]
    second = _vertices(data, (replies, fewer), first.positive, max_vertices, check)
    if second is None:
        return None
    return _listed(data, [(fewer, first), (replies, second)], check)


def _vertices(
    data: ExactProblem,
    strategies: tuple[list[int], list[int]],
    partners: Support,
    max_vertices: int,
    check: Check,
) -> Rays | None:
    """Return the vertices v of a player's polyhedron as rays (v, t), t > 0, which are
    multiples of (v, 1); None if there are too many.

    strategies : those of the player that may be positive, and the other player's.
    partners : the `positive` of vertices, only whose partners are returned.

    `positive` has a column for each unknown of the LCP: whether it is positive, or for
    the other player's strategies, whether their w is.
    """
    unknowns, others = strategies
    forms = [[*(data.rows[i][j] for j in unknowns), data.constants[i]] for i in others]
    # The columns of a ray are the unknowns of the player, t, and the forms.
    columns, t = [*unknowns, *others], len(unknowns)
    excluded = np.insert(partners[:, columns], t, 0, axis=1)
    rays = extreme_rays(forms, excluded, max_vertices, check)
    if rays is None:
        return None
    chosen = np.flatnonzero(rays.positive[:, t])
    positive = np.zeros((len(chosen), data.n), dtype=np.float32)
    positive[:, columns] = np.delete(rays.positive[chosen], t, axis=1)
    return Rays([rays.values[i] for i in chosen], positive)


def _listed(
    data: ExactProblem,
    sides: Sequence[tuple[list[int], Rays]],
    check: Check,
) -> Iterator[Iterator[RationalPoint]]:
    """Yield the extreme equilibria of each maximal Nash subset, from the strategies of
    each player with their unknowns.
    """
    (_, first), (_, second) = sides

    @lru_cache(MAX_REMEMBERED)
    def point(*pair: int) -> RationalPoint:
        z = zeros(data.n)
        for (unknowns, rays), i in zip(sides, pair, strict=True):
            *values, t = rays.values[i]
            for k, value in zip(unknowns, values, strict=True):
                z[k] = Fraction(value, t)
        return Vertex(z)

    columns = _columns(first.positive, second.positive, check)
    for one, other in _maximal(columns, len(second.values), check):
        yield (point(*pair) for pair in product(one, other))


def _columns(first: Support, second: Support, check: Check) -> list[int]:
    """Return for each row of the first matrix the rows of the second one that are zero
    wherever it is positive, as bits.
    """
    columns = []
    for some in parts(np.arange(len(first)), len(second), check):
        is_pair = first[some] @ second.T == 0
        bits = np.packbits(is_pair, axis=1, bitorder="little")
        columns += [int.from_bytes(row.tobytes(), "little") for row in bits]
    return columns


def _maximal(
    columns: list[int], k: int, check: Check
) -> Iterator[tuple[list[int], list[int]]]:
    """Yield the rows and the columns of each maximal submatrix without zeros of a
    matrix with k columns. Its columns are those that some rows have in common.

    columns : those of the entries of each row that are not zero, as bits.
    """
    m = len(columns)

    def pairs() -> Iterator[tuple[int, int]]:
        for i, row in enumerate(columns):
            check()
            yield from ((i, m + j) for j in _numbers(row))

    for nodes in connected(m + k, pairs()):
        rows = [i for i in nodes if i < m]
        listed: dict[int, None] = {}
        for i in rows:
            for others in [~0, *listed]:
                check()
                common = columns[i] & others
                if not common or common in listed:
                    continue
                listed[common] = None
                yield (
                    [row for row in rows if not common & ~columns[row]],
                    _numbers(common),
                )


def _numbers(bits: int) -> list[int]:
    """Return the numbers of the bits that are 1, in increasing order."""
    return [j for j, digit in enumerate(reversed(f"{bits:b}")) if digit == "1"]
