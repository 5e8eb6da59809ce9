"""The order of elimination of the compiled interior point method: minimum degree, with dense rows last.

The degree of a variable is the number of others that it is adjacent to in the graph of what is left, and eliminating it
makes these adjacent to each other: W. F. Tinney, J. W. Walker, Direct solutions of sparse network equations by
optimally ordered triangular factorization, Proceedings of the IEEE 55 (1967) 1801-1809. For few variables, whose
neighbours are the bits of some words, the exact degrees are counted faster than approximate ones are computed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.kernels.ldl_kernels import INDEX, borrowing, compiled
from lcpcli.kernels.quotient_graph_kernels import approximate_minimum_degree

DENSE, FEWEST_DENSE = 2.0, 16.0  # times the root of n, and at least: entries of a row from which on it comes last
MOST_WITH_BITS = 3000  # variables up to which their neighbours are bits: a megabyte
WORD = BLOCK = 64  # bits of a word, and keys of the block of its variables
ONE = np.uint64(1)
PLACES = 1 << 12  # more than MOST_WITH_BITS: of variables in keys, which also have room for degrees
ELIMINATED = np.uint32(2**32 - 1)  # as a key


@borrowing
def _ones(word: Any) -> Any:
    """Return how many bits of a word are 1."""
    word = word - ((word >> ONE) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@borrowing
def _degree(neighbours: Any) -> int:
    degree = 0
    for word in neighbours:
        if word != 0:
            degree += _ones(word)
    return degree


@borrowing
def _remove(neighbours: Any, v: int) -> None:
    """Remove a variable from a set of neighbours."""
    neighbours[v // WORD] &= ~(ONE << np.uint64(v % WORD))


@borrowing
def _least(keys: Any, begin: int, end: int) -> Any:
    """Return the least of some keys."""
    least = ELIMINATED
    for k in range(begin, end):
        least = min(least, keys[k])
    return least


@compiled
def _adjacency(n: int, ptr: Any, ind: Any) -> Any:
    """Return the neighbours of each variable as bits, for a symmetric pattern in compressed rows."""
    adjacency = np.zeros((n, (n + WORD - 1) // WORD), np.uint64)
    for i in range(n):
        for p in range(ptr[i], ptr[i + 1]):
            adjacency[i, ind[p] // WORD] |= ONE << np.uint64(ind[p] % WORD)
        _remove(adjacency[i], i)
    return adjacency


@borrowing
def _eliminate(adjacency: Any, keys: Any, least: Any, order: Any, last: int) -> None:
    """Write the order of all but the last variables. least : work, for the least key of each block of keys."""
    for block in range(least.size):
        least[block] = _least(keys, block * BLOCK, (block + 1) * BLOCK)
    for k in range(last):
        v = np.int64(_least(least, 0, least.size) % PLACES)
        order[k], keys[v] = v, ELIMINATED
        least[v // BLOCK] = _least(keys, v // BLOCK * BLOCK, (v // BLOCK + 1) * BLOCK)
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
                keys[i] = _degree(neighbours) * PLACES + i
            if own[t] != 0:
                least[t] = _least(keys, t * BLOCK, (t + 1) * BLOCK)


@compiled
def exact_minimum_degree(n: int, ptr: Any, ind: Any, most: float) -> Any:
    """Return what `approximate_minimum_degree` does, by exact degrees. The key of a variable is its degree and, in the
    lower bits, its place: with numbers of 32 bits, many keys are compared at once."""
    adjacency, order, last = _adjacency(n, ptr, ind), np.empty(n, np.int64), n
    blocks = adjacency.shape[1]
    keys = np.full(blocks * BLOCK, ELIMINATED)
    for i in range(n):
        keys[i] = i
        if ptr[i + 1] - ptr[i] > most:
            last -= 1
            order[last], keys[i] = i, ELIMINATED
    for i in range(n):
        if keys[i] < ELIMINATED:
            for k in range(last, n):
                _remove(adjacency[i], order[k])
            keys[i] = _degree(adjacency[i]) * PLACES + i
    _eliminate(adjacency, keys, np.empty(blocks, INDEX), order, last)
    return order


@compiled
def elimination_order(n: int, ptr: Any, ind: Any) -> Any:
    """Return an order of elimination with little fill-in, shape (n,), for a symmetric pattern in compressed rows."""
    most = max(DENSE * np.sqrt(n), FEWEST_DENSE)
    if n <= MOST_WITH_BITS:
        return exact_minimum_degree(n, ptr, ind, most)
    return approximate_minimum_degree(n, ptr, ind, most)
