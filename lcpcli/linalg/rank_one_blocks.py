"""Blocks of rank one, U D U', of a sparse matrix: with a further unknown y = D U'x for
each of them, systems and programs have far fewer entries.

They are met where costs depend on sums: on the flow of an arc to all destinations
together, or on the output of all firms.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import EPS, generator
from lcpcli.linalg.matrices import with_data
from lcpcli.typing import Indices, Matrix, Vector

# Entries in a row, on average, up to which no blocks are sought: little can be saved.
MIN_ENTRIES_OF_ROW = 8
# Of the entries, that must be saved.
MIN_SAVED = 0.5
# Entries that are looked at first: without such blocks, this takes a thousandth of the
# time that the search would take for a full matrix of order 1000.
SAMPLED = 500
# Relative to an entry: how far it may be from that of a block of rank one. Systems are
# refined with the matrix as it is.
CLOSE = 16 * EPS


class RankOneBlocks(NamedTuple):
    """A sparse matrix rest + U diag(D) U', D > 0, where each row of U has at most one
    entry."""

    rest: Matrix
    U: Matrix
    D: Vector


@np.errstate(all="ignore")
def rank_one_blocks(M: Matrix, S: Vector) -> RankOneBlocks | None:
    """Return the blocks of rank one of the rows and columns with S > 0 of a matrix M in
    compressed sparse rows with sorted indices, which is symmetric there; None if less
    than MIN_SAVED of the entries would be saved.

    All other entries of M in the rows and columns of a block belong to unknowns with S
    < 0. A block is identified by the first of its rows.
    """
    n = M.shape[0]
    if M.nnz <= MIN_ENTRIES_OF_ROW * n or not _may_have_blocks(M):
        return None
    owners = np.repeat(np.arange(n), np.diff(M.indptr))
    inside = (S[owners] > 0) & (S[M.indices] > 0) & (M.data != 0)
    i = owners[inside]
    j = M.indices[inside]
    data = M.data[inside]
    counts = np.bincount(i, minlength=n)
    is_start = np.append(True, i[1:] != i[:-1])[: i.size]
    name = np.full(n, n)
    name[i[is_start]] = j[is_start]
    sizes = np.bincount(name, minlength=n + 1)
    is_block = np.ones(n + 1, dtype=bool)
    is_block[n] = False
    is_block[name[counts != sizes[name]]] = False
    is_block[name[i[name[i] != name[j]]]] = False
    if not _is_worthwhile(sizes[is_block.nonzero()[0]], M.nnz):
        return None
    diagonal, u = M.diagonal(), np.zeros(n)
    in_first = name[i] == i
    u[j[in_first]] = data[in_first] / diagonal[i[in_first]]
    expected = u[i] * u[j] * diagonal[name[i]]
    is_close = np.abs(data - expected) <= CLOSE * np.abs(data)
    is_block[name[i[~is_close]]] = False
    is_block[:n] &= (diagonal > 0) & np.isfinite(1 / diagonal)
    blocks = is_block.nonzero()[0]
    if not _is_worthwhile(sizes[blocks], M.nnz):
        return None
    with imports:
        from scipy.sparse import csr_array
    is_outside = ~inside
    is_outside[inside] = ~is_block[name[i]]
    rest = with_data(M, np.where(is_outside, M.data, 0.0)).copy()
    rest.eliminate_zeros()
    members = is_block[name].nonzero()[0]
    columns = np.searchsorted(blocks, name[members])
    shape = n, blocks.size
    return RankOneBlocks(
        rest, csr_array((u[members], (members, columns)), shape=shape), diagonal[blocks]
    )


def _may_have_blocks(M: Matrix) -> bool:
    """Return whether M_ij^2 = M_ii M_jj, as in a block of rank one, for half as many of
    some entries as there have to be among all of them."""
    # At random, as every so many entries might be those of the diagonal.
    some = generator(0).integers(M.nnz, size=SAMPLED)
    rows = np.searchsorted(M.indptr, some, side="right") - 1
    diagonal = M.diagonal()
    products = diagonal[rows] * diagonal[M.indices[some]]
    is_close = np.abs(M.data[some] ** 2 - products) <= 4 * CLOSE * products
    return bool(np.count_nonzero(is_close) >= MIN_SAVED / 2 * SAMPLED)


def _is_worthwhile(sizes: Indices, entries: int) -> bool:
    """Return whether blocks of these sizes have enough entries more than U, U' and
    1 / D."""
    saved = float((sizes.astype(np.float64) ** 2 - 2 * sizes - 1).sum())
    return saved >= MIN_SAVED * entries
