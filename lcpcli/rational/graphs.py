"""The connected parts of a graph."""

from __future__ import annotations

from collections.abc import Iterable


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
