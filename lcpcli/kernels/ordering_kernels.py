"""The order of elimination of the compiled interior point method: minimum degree, with dense rows last.

The degree of a variable is the number of others that it is adjacent to in the graph of what is left, and eliminating it
makes these adjacent to each other: W. F. Tinney, J. W. Walker, Direct solutions of sparse network equations by
optimally ordered triangular factorization, Proceedings of the IEEE 55 (1967) 1801-1809. For few variables, whose
neighbours are the bits of some words, the exact degrees are counted faster than approximate ones are computed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.kernels.ldl_kernels import compiled
from lcpcli.kernels.quotient_graph_kernels import approximate_minimum_degree

DENSE, FEWEST_DENSE = 2.0, 16.0  # times the root of n, and at least: entries of a row from which on it comes last
MOST_WITH_BITS = 3000  # variables up to which their neighbours are bits: a megabyte
WORD = 64  # bits
ONE = np.uint64(1)


@compiled
def _ones(word: Any) -> Any:
    """Return how many bits of a word are 1."""
    word = word - ((word >> ONE) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@compiled
def _degree(neighbours: Any) -> int:
    degree = 0
    for word in neighbours:
        if word != 0:
            degree += _ones(word)
    return degree


@compiled
def _remove(neighbours: Any, v: int) -> None:
    """Remove a variable from a set of neighbours."""
    neighbours[v // WORD] &= ~(ONE << np.uint64(v % WORD))


@compiled
def _adjacency(n: int, ptr: Any, ind: Any) -> Any:
    """Return the neighbours of each variable as bits, for a symmetric pattern in compressed rows."""
    adjacency = np.zeros((n, (n + WORD - 1) // WORD), np.uint64)
    for i in range(n):
        for p in range(ptr[i], ptr[i + 1]):
            adjacency[i, ind[p] // WORD] |= ONE << np.uint64(ind[p] % WORD)
        _remove(adjacency[i], i)
    return adjacency


@compiled
def exact_minimum_degree(n: int, ptr: Any, ind: Any, most: float) -> Any:
    """Return what `approximate_minimum_degree` does, by exact degrees."""
    adjacency = _adjacency(n, ptr, ind)
    degrees, order, last = np.empty(n, np.int64), np.empty(n, np.int64), n
    eliminated = n + 1  # as a degree
    for i in range(n):
        degrees[i] = 0
        if ptr[i + 1] - ptr[i] > most:
            last -= 1
            order[last], degrees[i] = i, eliminated
    for i in range(n):
        if degrees[i] < eliminated:
            for k in range(last, n):
                _remove(adjacency[i], order[k])
            degrees[i] = _degree(adjacency[i])
    for k in range(last):
        v = np.argmin(degrees)
        order[k], degrees[v] = v, eliminated
        own = adjacency[v]
        for t in range(own.size):
            word = own[t]
            while word != 0:
                lowest = word & (~word + ONE)
                word ^= lowest
                i = t * WORD + _ones(lowest - ONE)
                neighbours = adjacency[i]
                for s in range(own.size):
                    neighbours[s] |= own[s]
                _remove(neighbours, v)
                _remove(neighbours, i)
                degrees[i] = _degree(neighbours)
    return order


@compiled
def elimination_order(n: int, ptr: Any, ind: Any) -> Any:
    """Return an order of elimination with little fill-in, shape (n,), for a symmetric pattern in compressed rows."""
    most = max(DENSE * np.sqrt(n), FEWEST_DENSE)
    if n <= MOST_WITH_BITS:
        return exact_minimum_degree(n, ptr, ind, most)
    return approximate_minimum_degree(n, ptr, ind, most)
