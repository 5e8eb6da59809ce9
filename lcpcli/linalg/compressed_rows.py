"""Matrices in compressed sparse rows built from arrays, and their blocks and
transposes.

scipy's unchecked routines, which are not public, would save less than a tenth of the
time of calls with 10 to 1000 unknowns; only for products is one used
(`matrices.row_multiplier`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csc_array, csr_array

from lcpcli.typing import Indices, Matrix, Vector

Shape: TypeAlias = tuple[int, int]
# indptr, indices and data: the start of each row, and the columns and values of
# entries.
Arrays: TypeAlias = tuple[Indices, Indices, Vector]


def of_arrays(
    shape: Shape,
    indptr: Indices,
    indices: Indices,
    data: Vector,
    array_class: Any = csr_array,
) -> Matrix:
    """Return the matrix with these arrays, without copying them, as a csr_array or a
    csc_matrix.
    """
    return array_class((data, indices, indptr), shape=shape)


def transposed(shape: Shape, indptr: Indices, indices: Indices, data: Vector) -> Arrays:
    """Return the arrays of the transpose of a matrix of this shape, with sorted
    indices."""
    # Read by columns, the arrays are those of the transpose.
    T = csc_array((data, indices, indptr), shape=shape[::-1]).tocsr()
    return T.indptr, T.indices, T.data


def block(M: Matrix, rows: Indices, columns: Indices) -> Arrays:
    """Return the arrays of the block of M with these rows and columns, both ascending.

    It takes less time than scipy's indexing, as the entries outside the block are
    dropped in one pass. The entries of the rows are selected first: by a slice if the
    rows are consecutive, by their positions if they are few, else by a mask.
    """
    position = np.full(M.shape[1], -1, dtype=M.indices.dtype)
    indptr = M.indptr
    indices = M.indices
    data = M.data
    position[columns] = np.arange(columns.size, dtype=indices.dtype)
    is_row: Any = True
    if rows.size > 0 and rows[-1] - rows[0] == rows.size - 1:
        row_starts = indptr[rows[0] : rows[-1] + 2]
        entries = slice(row_starts[0], row_starts[-1])
        row_starts = row_starts - row_starts[0]
        indices = indices[entries]
        data = data[entries]
    elif 2 * rows.size < M.shape[0]:
        first = indptr[rows]
        counts = np.diff(indptr)[rows]
        row_starts = np.zeros(rows.size + 1, dtype=indptr.dtype)
        np.cumsum(counts, out=row_starts[1:])
        entry_indices = np.arange(row_starts[-1], dtype=indptr.dtype) + np.repeat(
            first - row_starts[:-1], counts
        )
        indices, data = indices[entry_indices], data[entry_indices]
    else:
        is_row = np.zeros(M.shape[0], dtype=bool)
        is_row[rows] = True
        is_row = np.repeat(is_row, np.diff(indptr))
        row_starts = np.append(0, indptr[rows + 1])
    column_positions = position[indices]
    is_in_block = (column_positions >= 0) & is_row
    counts_before = np.zeros(data.size + 1, dtype=indptr.dtype)
    np.cumsum(is_in_block, out=counts_before[1:])
    return counts_before[row_starts], column_positions[is_in_block], data[is_in_block]


def of_entries(
    shape: Shape,
    rows: Sequence[Indices],
    columns: Sequence[Indices],
    values: Sequence[Vector],
) -> Matrix:
    """Return the sparse matrix whose entries are the concatenation of these arrays;
    entries with the same row and column are summed.
    """
    rows_and_columns = np.concatenate(rows), np.concatenate(columns)
    return csr_array((np.concatenate(values), rows_and_columns), shape=shape)
