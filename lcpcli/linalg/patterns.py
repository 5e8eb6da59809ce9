"""Patterns of sparse matrices: bandwidth and fill-in, which bound the cost of a
factorization, symmetry up to signs, and structural rank.

Elimination without row interchanges causes no fill-in outside the band, which is narrow
in the reverse Cuthill-McKee order (E. Cuthill and J. McKee, Reducing the bandwidth of
sparse symmetric matrices, Proceedings of the 24th ACM National Conference (1969)
157-172, reversed after A. George, 1971). The pattern of a column of L is the union of
the pattern of this column of A and those of its children in the elimination tree (J. W.
H. Liu, The role of elimination trees in sparse factorization, SIAM J. Matrix Anal.
Appl. 11 (1990) 134-172).

The index arrays of sparse matrices in files are checked here too, as scipy's compiled
code trusts them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import ROUNDING, distinct
from lcpcli.linalg.matrices import (
    compressed,
    is_sparse,
    mirrored,
    principal,
    unit_columns,
    width,
)
from lcpcli.typing import Indices, Mask, Matrix, Vector

# Factorizing a dense matrix of this order takes seconds, and 200 megabytes.
MAX_DENSE_ROWS = 5000
# Entries of the factors within a band: they take about a gigabyte.
MAX_ENTRIES = 150_000_000
# Operations of an elimination within a band: they take about a minute.
MAX_OPERATIONS = 100_000_000_000
# Entries of M up to which the search for any order takes negligible time.
MAX_ORDERED_ENTRIES = 20_000
# Limit on the sum of the squared row lengths, which bounds the steps of the minimum
# degree algorithm: about half a second.
MAX_STEPS = 1e9
# Row length beyond which sorting a row by insertion takes more than a millisecond.
LONG_ROW = 1000
# Steps of a breadth-first search that reach most of a graph without small separators.
SPREADING_STEPS = 8
# Ratio of the entries of L to those of M beyond which the search for a minimum degree
# order may take minutes.
MUCH_FILL = 10


def affordable(M: Matrix) -> bool:
    """Return whether a factorization of M is cheap enough for a side computation: the
    cost of a sparse one is bounded by that of a factorization within the band.
    """
    if not is_sparse(M):
        return bool(M.shape[0] <= MAX_DENSE_ROWS)
    band = Band(M)
    return band.entries <= MAX_ENTRIES and band.operations <= MAX_OPERATIONS


def _symmetric(M: Matrix) -> Matrix:
    """Return |M| + |M'|, whose pattern is that of the graph of M."""
    return (abs(M) + abs(M.T)).tocsr()


def is_forest(M: Matrix) -> bool:
    """Return whether the graph of the entries of a sparse M is a forest: its factors in
    a suitable order then have no fill-in.
    """
    n = M.shape[0]
    if M.nnz > 3 * n:
        return False
    with imports:
        from scipy.sparse.csgraph import connected_components
    graph = _symmetric(M)
    edges = (graph.nnz - np.count_nonzero(graph.diagonal())) // 2
    return bool(edges == n - connected_components(graph, directed=False)[0])


def cuthill_mckee(M: Matrix) -> Indices:
    """Return the unknowns of a sparse M in the reverse Cuthill-McKee order of the graph
    of M + M'."""
    with imports:
        from scipy.sparse.csgraph import reverse_cuthill_mckee
    symmetric = _symmetric(M)
    degrees = np.diff(symmetric.indptr)
    if not degrees.size:
        return np.asarray(degrees)
    if degrees.max() <= LONG_ROW:
        return np.asarray(reverse_cuthill_mckee(symmetric, symmetric_mode=True))
    # scipy sorts the neighbours of a node by degree with insertion sort, which takes
    # linear time if they are sorted already.
    order = np.argsort(degrees, kind="stable")
    symmetric = symmetric[order][:, order]
    symmetric.sort_indices()
    return np.asarray(order[reverse_cuthill_mckee(symmetric, symmetric_mode=True)])


def _width_of(M: Matrix, order: Indices) -> int:
    """Return the largest distance of an entry of M from the diagonal after its rows and
    columns are put in this order.
    """
    positions = np.empty(order.size, dtype=np.intp)
    positions[order] = np.arange(order.size)
    owners = np.repeat(positions, np.diff(M.indptr))
    return int(np.abs(owners - positions[M.indices]).max(initial=0))


def narrow_order(M: Matrix) -> tuple[Indices | None, int]:
    """Return an order in which the entries of a sparse M are close to the diagonal, or
    None for the order of M, and their largest distance from the diagonal in it.
    """
    width_of_M = width(M)
    # In any order the longest row spans at least half its length on one side of the
    # diagonal.
    if 2 * width_of_M <= int(np.diff(M.indptr).max(initial=0)):
        return None, width_of_M
    order = cuthill_mckee(M)
    width_in_order = _width_of(M, order)
    return (
        (order, width_in_order) if width_in_order < width_of_M else (None, width_of_M)
    )


class Band:
    """The band of a sparse matrix of shape (n, n) and of its transpose together, in the
    reverse Cuthill-McKee order.

    width : the largest |i - j| of a stored entry in that order. entries, operations :
    upper bounds on the entries of both triangular factors, and on the multiplications
    and additions of an elimination without fill-in outside the band.
    """

    def __init__(self, M: Matrix) -> None:
        n = int(M.shape[0])
        self.width = _width_of(M, cuthill_mckee(M))
        self.entries = n * (2 * self.width + 1)
        self.operations = 2 * n * self.width * (self.width + 1) + n


def order_of(M: Matrix) -> str:
    """Return the name of the ordering that SuperLU is to compute for diagonal pivots of
    a sparse M: minimum degree, or COLAMD.

    SuperLU holds the interpreter's lock during this search, so that neither Ctrl-C nor
    a time limit can interrupt it. Minimum degree gives less fill-in, but takes minutes
    if the graph of M has no small separators, where L is almost dense in any order;
    COLAMD takes a second there. Minimum degree also traverses a long row whenever one
    of its unknowns is eliminated, while COLAMD orders such rows last.
    """
    if M.nnz <= MAX_ORDERED_ENTRIES:
        return "MMD_AT_PLUS_A"
    max_entries, lengths = MUCH_FILL * M.nnz, np.diff(M.indptr).astype(np.float64)
    slow = lengths @ lengths > MAX_STEPS or (
        _spreads(M) and fill(M, max_entries) > max_entries
    )
    return "COLAMD" if slow else "MMD_AT_PLUS_A"


def _spreads(M: Matrix) -> bool:
    """Return whether a few steps of breadth-first search from an unknown of median
    degree reach most of the unknowns: the graph of M then has no small separators.
    """
    pattern = _symmetric(M)
    pattern.data[:] = 1.0
    reached = np.zeros(M.shape[0])
    reached[np.argsort(np.diff(pattern.indptr))[reached.size // 2]] = 1.0
    for _ in range(SPREADING_STEPS):
        reached = np.minimum(reached + pattern @ reached, 1.0)
    return bool(reached.sum() > reached.size / 2)


def column_lengths(M: Matrix) -> Iterator[int]:
    """Yield the number of entries below the diagonal of each column of L, for diagonal
    pivots of M + M' in the order of increasing row length.

    For the optimality conditions of programs this order is not much worse than minimum
    degree, and it takes negligible time. M is sparse, of shape (n, n). Counting stops
    when TimeIsUp is raised.
    """
    with imports:
        from scipy.sparse import tril
    pattern = _symmetric(M)
    order = np.argsort(np.diff(pattern.indptr), kind="stable")
    lower = tril(pattern[order][:, order], k=-1, format="csc")
    lower.sort_indices()
    columns = np.split(lower.indices, lower.indptr[1:-1])
    # The patterns that each column inherits from its children in the elimination tree.
    from_children: list[list[Indices]] = [[] for _ in columns]
    for j, column_entries in enumerate(columns):
        raise_if_timed_out()
        merged = (
            distinct(np.concatenate((column_entries, *from_children[j])))
            if from_children[j]
            else column_entries
        )
        from_children[j] = []
        yield merged.size
        if merged.size:
            from_children[merged[0]].append(merged[1:])


def fill(M: Matrix, max_entries: int) -> int:
    """Return the sum of `column_lengths`, or a part of it that exceeds
    `max_entries`."""
    return int(_sum_until(column_lengths(M), max_entries))


def elimination_operations(M: Matrix, max_operations: float) -> float:
    """Return the operations of factors whose columns have `column_lengths`, which are
    up to five times those in an order of minimum degree, and for grids in space up to
    twenty times; or a part of them that exceeds `max_operations`."""
    squares = (float(length) ** 2 for length in column_lengths(M))
    return _sum_until(squares, max_operations)


def _sum_until(terms: Iterable[float], most: float) -> float:
    """Return the sum of the terms, or that of the first ones that exceeds `most`."""
    total = 0.0
    for term in terms:
        total += term
        if total > most:
            break
    return total


def signs(M: Matrix) -> Vector | None:
    """Return S of shape (n,), entries 1 or -1, with S_i M_ij = S_j M_ji for all i and
    j; None if there is no such S.

    If M + M' is positive semidefinite and D positive, S (M + D) is then quasidefinite
    and has LDL' factors for every order of the pivots (R. J. Vanderbei, Symmetric
    quasidefinite matrices, SIAM J. Optim. 5 (1995) 100-113). The signs of i and j are
    equal if M_ij = M_ji, and opposite if M_ij = -M_ji. They exist if, in the graph of
    all nodes (i, +) and (i, -) with these conditions as edges, no (i, +) is connected
    with (i, -).
    """
    with imports:
        from scipy.sparse.csgraph import connected_components

        from lcpcli.linalg.compressed_rows import of_arrays
    pair = mirrored(compressed(M))
    if pair is None or not (np.abs(pair[0].data) == np.abs(pair[1])).all():
        return None
    M, n = pair[0], M.shape[0]
    turned = M.data != pair[1]
    indices = np.concatenate((M.indices + n * turned, M.indices + n * ~turned)).astype(
        M.indptr.dtype, copy=False
    )
    indptr = np.concatenate((M.indptr, M.indptr[1:] + M.nnz))
    graph = of_arrays((2 * n, 2 * n), indptr, indices, np.ones(indices.size))
    plus, minus = np.split(connected_components(graph, directed=False)[1], 2)
    return None if (plus == minus).any() else np.where(plus < minus, 1.0, -1.0)


def has_friction(M: Matrix) -> bool:
    """Return whether M = [A B; C D] in some order, with the blocks of contact with
    Coulomb friction: A symmetric, C = [mu I, -E'] and B = [0; E], mu and E >= 0, and D
    diagonal.

    D = 0 and A is semidefinite in D. E. Stewart, J. C. Trinkle, Int. J. Numer. Methods
    Eng. 39 (1996) 2673-2691; engines of rigid bodies regularize the diagonal. A is not
    examined further.
    """
    if is_sparse(M) and mirrored(M) is not None:
        # M_ij and M_ji have no common pattern in contact, as no entry mirrors mu I; in
        # the conditions of a program they have.
        return False
    n = M.shape[0]
    positive = M > 0.0
    # The positive entries of a row of C are mu, and perhaps a regularized diagonal.
    if is_sparse(M):
        number = np.diff(positive.indptr)
    else:
        number = np.count_nonzero(positive, axis=1)
    short_rows = ((number > 0) & (number <= 2)).nonzero()[0]
    if not short_rows.size:
        return False
    rows, columns = M[short_rows], M[:, short_rows].T
    diagonal_entries = (
        unit_columns(n, short_rows, is_sparse(M)).T
        * M.diagonal()[short_rows][:, np.newaxis]
    )
    rows, columns = rows - diagonal_entries, columns - diagonal_entries
    # The column of B that belongs to a row of C consists of the negative entries of
    # that row with the opposite sign, and nothing else.
    lower, upper = (rows - abs(rows)) / 2, (rows + abs(rows)) / 2
    is_friction = _has_entries(lower) & _has_entries(upper)
    is_friction &= ~_has_entries(columns + lower)
    cones = short_rows[is_friction]
    if not cones.size or _has_entries(rows[is_friction][:, cones]).any():
        return False
    others = np.ones(n, dtype=np.bool_)
    others[cones] = False
    A = principal(M, others.nonzero()[0])
    return bool(abs(A - A.T).max() <= ROUNDING * abs(A).max())


def _has_entries(M: Matrix) -> Mask:
    """Return which rows of M have entries other than 0."""
    if not is_sparse(M):
        return np.asarray(M.any(axis=1))
    return np.bincount(M.nonzero()[0], minlength=M.shape[0]) > 0


def is_structurally_singular(A: Matrix) -> bool:
    """Return whether every matrix with the nonzero pattern of A, of shape (n, n), is
    singular: whether no n of the entries lie in distinct rows and columns.

    The largest number of such entries is a maximum flow from rows to columns, which is
    computed in polynomial time; `scipy.sparse.csgraph.structural_rank` does not
    terminate for some matrices of 1000 rows.
    """
    n = A.shape[0]
    if (
        np.count_nonzero(np.diff(A.indptr)) < n
        or np.count_nonzero(np.bincount(A.indices, minlength=n)) < n
    ):
        return True
    row, column = A.nonzero()
    numbers = np.arange(n)
    source = np.full(n, 2 * n)
    sink = np.full(n, 2 * n + 1)
    sources_and_targets = (
        np.concatenate([source, row, n + numbers]),
        np.concatenate([numbers, n + column, sink]),
    )
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import maximum_flow
    graph = csr_array(
        (np.ones(sources_and_targets[0].size, dtype=np.int32), sources_and_targets),
        shape=(2 * n + 2, 2 * n + 2),
    )
    return bool(maximum_flow(graph, 2 * n, 2 * n + 1, method="dinic").flow_value < n)


def invalid_indices(indices: Any, size: int) -> Indices:
    """Return the positions of the indices that are not integers from 0 to size - 1."""
    return np.flatnonzero(~((indices >= 0) & (indices < size) & (indices % 1 == 0)))


def are_compressed(
    line_ends: Any, indices: Any, lines: int, size_of_lines: int
) -> bool:
    """Return whether these arrays are valid for this number of compressed rows or
    columns (`lines`) with indices below `size_of_lines`.
    """
    are_ends = (
        line_ends.size == lines + 1
        and line_ends[0] == 0
        and line_ends[-1] <= indices.size
        and (line_ends[1:] >= line_ends[:-1]).all()
    )
    return (
        bool(are_ends)
        and not invalid_indices(indices[: line_ends[-1]], size_of_lines).size
    )


def fit(
    sparse_format: str,
    index_arrays: Sequence[Any],
    data: Sequence[int],
    shape: Sequence[int],
) -> bool:
    """Return whether the index arrays of one of scipy's sparse formats are valid for a
    matrix of this shape.

    data, shape : the shapes of the array of values and of the matrix.
    """
    first, last = index_arrays[0], index_arrays[-1]
    are_integers = all(
        index_array.ndim == 1 and index_array.dtype.kind in "iu"
        for index_array in index_arrays
    )
    blocks: Sequence[int] = []
    if sparse_format == "bsr":
        blocks = data[1:]
    elif sparse_format == "dia":
        blocks = [2]
    if (
        not are_integers
        or len(shape) != 2
        or min(shape) < 0
        or len(data) != 1 + len(blocks)
        or data[0] != first.size
    ):
        return False
    if sparse_format == "coo":
        return (
            last.size == first.size
            and not invalid_indices(first, shape[0]).size
            and not invalid_indices(last, shape[1]).size
        )
    if sparse_format == "dia":
        return len(set(first.tolist())) == first.size and bool(
            (first > -shape[0]).all() and (first < shape[1]).all()
        )
    rows, columns = shape
    if sparse_format == "bsr":
        if (
            len(blocks) != 2
            or min(blocks) < 1
            or rows % blocks[0]
            or columns % blocks[1]
        ):
            return False
        rows, columns = rows // blocks[0], columns // blocks[1]
    return are_compressed(
        last, first, *((columns, rows) if sparse_format == "csc" else (rows, columns))
    )


def connected(n: int, edges: Iterable[tuple[int, int]]) -> list[list[int]]:
    """Return the connected components of the graph with the nodes 0, ..., n - 1: each
    as an increasing list, in the order of their smallest nodes.
    """
    parents = list(range(n))

    def root(i: int) -> int:
        while parents[i] != i:
            parents[i] = i = parents[parents[i]]
        return i

    for i, j in edges:
        parents[root(j)] = root(i)
    components: dict[int, list[int]] = {}
    for i in range(n):
        components.setdefault(root(i), []).append(i)
    return list(components.values())
