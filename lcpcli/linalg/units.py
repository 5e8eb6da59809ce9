"""The units of rows and columns that a matrix itself suggests, and which of them belong together.

A. R. Curtis and J. K. Reid, On the automatic scaling of matrices for Gaussian elimination, IMA Journal of Applied
Mathematics 10 (1972) 118-124: R and C with the least sum of squares of log2 |R_i M_ij C_j| over the nonzero entries.
They are unique up to a constant for each connected component of rows and columns, with an edge where M_ij is not 0, so
that what is measured in them does not depend on the units in which M is given. Of each |M_ij| only the exponent counts,
so that powers of two in rows and columns change nothing at all.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Indices, Mask, Matrix, Vector

SETTLED = 0.01  # of a power of two: the error in the normal equations that is left
MOST_STEPS = 500  # of conjugate gradients; a matrix without zeros takes two
EXPONENT, BIAS = 0x7FF, 1022  # the bits of a double's exponent, and its value for 1/2 <= |a| < 1


class Units(NamedTuple):
    """rows, columns : log2 of R and of C, shape (n,). row_part, column_part : the numbers of the connected components
    of rows and columns, from 0 to parts - 1, shape (n,)."""

    rows: Vector
    columns: Vector
    row_part: Indices
    column_part: Indices
    parts: int

    def largest_of_rows(self, values: Vector) -> Vector:
        """The largest value in each component, for values of the rows of shape (..., n); minus infinity if none."""
        return _largest(values, self.row_part, self.parts)

    def largest_of_columns(self, values: Vector) -> Vector:
        """The largest value in each component, for values of the columns of shape (..., n)."""
        return _largest(values, self.column_part, self.parts)


def units(M: Matrix) -> Units:
    """The units of M, of shape (n, n), dense or in compressed sparse rows, with finite entries."""
    if is_sparse(M):
        return _sparse_units(M)
    exponents = _exponents(np.ascontiguousarray(M))
    if np.count_nonzero(M) == M.size:
        n = M.shape[0]
        rows, columns = _least_squares(
            exponents.sum(axis=1),
            exponents.sum(axis=0),
            np.full((2, n), float(n)),
            lambda v: np.full(n, v.sum()),
            lambda v: np.full(n, v.sum()),
        )
        nothing = np.zeros(n, dtype=np.intp)
        return Units(rows, columns, nothing, nothing, 1)
    used = M != 0
    entries = used.astype(np.float64)
    weights = exponents * used
    rows, columns = _least_squares(
        weights.sum(axis=1),
        weights.sum(axis=0),
        np.array([entries.sum(axis=1), entries.sum(axis=0)]),
        lambda v: entries @ v,
        lambda v: entries.T @ v,
    )
    return Units(rows, columns, *_parts(used))


def _sparse_units(M: Matrix) -> Units:
    from scipy.sparse import coo_array, csr_array
    from scipy.sparse.csgraph import connected_components

    if not M.data.all():
        M = M.copy()
        M.eliminate_zeros()
    n, exponents = M.shape[0], _exponents(M.data).astype(np.float64)
    entries = csr_array((np.ones(M.nnz), M.indices, M.indptr), shape=M.shape)
    weights = csr_array((exponents, M.indices, M.indptr), shape=M.shape)
    ones = np.ones(n)
    turned = entries.T.tocsr()
    rows, columns = _least_squares(
        weights @ ones,
        weights.T @ ones,
        np.array([entries @ ones, turned @ ones]),
        lambda v: entries @ v,
        lambda v: turned @ v,
    )
    coo = M.tocoo()
    graph = coo_array((np.ones(M.nnz, dtype=np.int8), (coo.row, coo.col + n)), shape=(2 * n, 2 * n))
    parts, part = connected_components(graph, directed=False)
    return Units(rows, columns, part[:n], part[n:], parts)


def _exponents(values: NDArray[np.float64]) -> NDArray[np.int64]:
    """e with 2^(e - 1) <= |a| < 2^e, read from the bits of the doubles; those of 0 and subnormal numbers are -1022."""
    return (values.view(np.int64) >> 52 & EXPONENT) - BIAS


def _least_squares(
    of_rows: Vector,
    of_columns: Vector,
    counts: Vector,
    times: Callable[[Vector], Vector],
    transposed: Callable[[Vector], Vector],
) -> tuple[Vector, Vector]:
    """rho and gamma, each of shape (n,), with the least sum of (e_ij + rho_i + gamma_j)^2: by conjugate gradients on
    the normal equations, preconditioned by their diagonal.

    of_rows, of_columns : the sums of e_ij over rows and over columns. counts : how many entries there are in these,
    shape (2, n). times, transposed : products with the matrix that has ones for the entries, and with its transpose.
    """
    counts = np.maximum(counts, 1.0)
    x = np.zeros(counts.shape)
    residual = -np.array([of_rows, of_columns], dtype=np.float64)
    step = residual / counts
    direction, size = step, float((residual * step).sum())
    for _ in range(MOST_STEPS):
        if not np.abs(step).max() > SETTLED:
            break
        image = counts * direction
        image[0] += times(direction[1])
        image[1] += transposed(direction[0])
        length = size / float((direction * image).sum())
        x += length * direction
        residual -= length * image
        step = residual / counts
        before, size = size, float((residual * step).sum())
        direction = step + size / before * direction
    return x[0], x[1]


def _parts(used: Mask) -> tuple[Indices, Indices, int]:
    """The components of rows and of columns where entries are used, and how many there are, by breadth-first search."""
    n, count = used.shape[0], 0
    rows, columns = np.full((2, n), -1, dtype=np.intp)
    for i in range(n):
        if rows[i] >= 0:
            continue
        front: Indices = np.array([i])
        while front.size:
            rows[front] = count
            reached = (used[front].any(axis=0) & (columns < 0)).nonzero()[0]
            columns[reached] = count
            front = (used[:, reached].any(axis=1) & (rows < 0)).nonzero()[0]
        count += 1
    alone = (columns < 0).nonzero()[0]
    columns[alone] = np.arange(count, count + alone.size)
    return rows, columns, count + alone.size


def _largest(values: Vector, part: Indices, parts: int) -> Vector:
    if parts == 1:
        return np.asarray(values.max(axis=-1, keepdims=True))
    order = np.argsort(part, kind="stable")
    numbers, starts = np.unique(part[order], return_index=True)
    found = np.full((*values.shape[:-1], parts), -np.inf)
    found[..., numbers] = np.maximum.reduceat(values[..., order], starts, axis=-1)
    return found
