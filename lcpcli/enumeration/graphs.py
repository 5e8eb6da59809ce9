"""The connected parts of a graph, and the maximal bicliques of a bipartite one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from lcpcli.interrupts import TimeIsUp

Biclique = tuple[list[int], list[int]]


def connected(n: int, edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """The connected parts of the graph with the nodes 0, ..., n - 1, each in order, by their least nodes."""
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


def bicliques(edges: Sequence[tuple[int, int]], check: Callable[[], None]) -> Iterator[Biclique]:
    """The maximal bicliques of a bipartite graph without isolated nodes: intersections of neighbourhoods, and all nodes
    that have these in common.

    `check` is called before each step and may raise TimeIsUp. If it does before all intersections are known, it is
    raised after those bicliques that consist of a node's neighbours and all that these have in common: they have every
    edge.
    """
    of_first, of_second = _neighbourhoods(edges), _neighbourhoods([(j, i) for i, j in edges])
    m, late = len(of_first), None
    for part in connected(m + len(of_second), [(i, m + j) for i, j in edges]):
        firsts = [i for i in part if i < m]
        stars = dict.fromkeys([of_first[i] for i in firsts])
        stars |= dict.fromkeys(_common(of_first, of_second[k - m]) for k in part if k >= m)
        sides = dict(stars)
        try:
            for i in firsts if late is None else ():
                for side in list(sides):
                    check()
                    sides[side & of_first[i]] = None
        except TimeIsUp as error:
            sides, late = stars, error
        for side in sides:
            check()
            if side:
                yield _members(_common(of_second, side)), _members(side)
    if late:
        raise late


def _neighbourhoods(edges: Iterable[tuple[int, int]]) -> list[int]:
    """Of each node on the first side its neighbours, as bits."""
    found: dict[int, int] = {}
    for i, j in edges:
        found[i] = found.get(i, 0) | 1 << j
    return [found[i] for i in range(len(found))]


def _common(neighbourhoods: Sequence[int], nodes: int) -> int:
    """The neighbours that all of some nodes have in common; these are not none."""
    first, *others = _members(nodes)
    common = neighbourhoods[first]
    for i in others:
        common &= neighbourhoods[i]
    return common


def _members(bits: int) -> list[int]:
    members = []
    while bits:
        least = bits & -bits
        members.append(least.bit_length() - 1)
        bits ^= least
    return members
