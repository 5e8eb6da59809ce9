"""The entries of triangular factors, counted without computing these.

A column of L has the entries of its column of A and those of its children in the elimination tree (J. W. H. Liu, The
role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11 (1990) 134-172).
"""

from __future__ import annotations

import numpy as np

from lcpcli.interrupts import check
from lcpcli.typing import Indices, Matrix

SMALL = 20_000  # entries up to which any order is found in no time
STEPS = 8  # in which most of a graph without small separators is reached
MUCH = 10  # entries of L for each of M, beyond which the search for an order of minimum degree may take minutes


def order_of(M: Matrix) -> str:
    """The order that SuperLU is to look for, for diagonal pivots of a sparse M: that of minimum degree, or COLAMD's.

    SuperLU holds the interpreter's lock in this search, so that neither Ctrl-C nor a time limit can end the wait for
    it. Minimum degree gives less fill, but takes minutes where the graph of M has no small separators, and L is nearly
    dense in any order; COLAMD takes a second there.
    """
    most = MUCH * M.nnz
    slow = M.nnz > SMALL and _spreads(M) and fill(M, most) > most
    return "COLAMD" if slow else "MMD_AT_PLUS_A"


def _spreads(M: Matrix) -> bool:
    """Whether a few steps along the entries of M lead from a typical unknown to most others."""
    pattern = (abs(M) + abs(M.T)).tocsr()
    pattern.data[:] = 1.0
    reached = np.zeros(M.shape[0])
    reached[np.argsort(np.diff(pattern.indptr))[reached.size // 2]] = 1.0
    for _ in range(STEPS):
        reached = np.minimum(reached + pattern @ reached, 1.0)
    return bool(reached.sum() > reached.size / 2)


def fill(M: Matrix, most: int) -> int:
    """The entries below the diagonal of L, for diagonal pivots of M + M' in order of the entries of their rows.

    For the conditions of programs this order is not much worse than those of minimum degree, and it takes no time. M is
    sparse, of shape (n, n). Counting ends above `most`, and by TimeIsUp.
    """
    columns = _lower_columns(M)
    waiting: list[list[Indices]] = [[] for _ in columns]  # from the children of each column
    total = 0
    for j, own in enumerate(columns):
        check()
        merged = np.unique(np.concatenate((own, *waiting[j]))) if waiting[j] else own
        waiting[j] = []
        total += merged.size
        if total > most:
            break
        if merged.size:
            waiting[merged[0]].append(merged[1:])
    return total


def _lower_columns(M: Matrix) -> list[Indices]:
    """The sorted indices below the diagonal of each column of the permuted M + M'."""
    from scipy.sparse import csc_array

    pattern = (abs(M) + abs(M.T)).tocsr()
    order = np.argsort(np.diff(pattern.indptr), kind="stable")
    position = np.empty_like(order)
    position[order] = np.arange(order.size)
    coo = pattern.tocoo()
    rows, columns = position[coo.row], position[coo.col]
    below = rows > columns
    lower = csc_array((coo.data[below], (rows[below], columns[below])), shape=M.shape)
    lower.sort_indices()
    return np.split(lower.indices, lower.indptr[1:-1])
