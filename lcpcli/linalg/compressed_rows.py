"""Matrices in compressed sparse rows made of arrays, and their blocks and transposes.

scipy's routines without checks, which are not public, would save less than a tenth of
calls with 10 to 1000 unknowns; `matrices.row_multiplier` has one for products.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from scipy.sparse import csr_array

from lcpcli.typing import Indices, Matrix, Vector

Shape: TypeAlias = tuple[int, int]
# Where each row begins, the columns and the values of the entries.
Arrays: TypeAlias = tuple[Indices, Indices, Vector]


def of_arrays(
    shape: Shape,
    indptr: Indices,
    indices: Indices,
    data: Vector,
    array_class: Any = csr_array,
) -> Matrix:
    """Return the matrix with these arrays, which it shares, as a csr_array or a
    csc_matrix."""
    return array_class((data, indices, indptr), shape=shape)


def transposed(shape: Shape, indptr: Indices, indices: Indices, data: Vector) -> Arrays:
    """Return the arrays of the transpose of a matrix of this shape, with sorted
    indices."""
    T = csr_array((data, indices, indptr), shape=shape).T.tocsr()
    return T.indptr, T.indices, T.data


def of_columns(M: Matrix) -> Matrix:
    """Return a matrix in compressed columns in compressed rows, in memory of its own,
    with sorted indices."""
    arrays = transposed(M.shape[::-1], M.indptr, M.indices, M.data)
    arrays[2].setflags(write=False)
    return of_arrays(M.shape, *arrays)


def block(M: Matrix, rows: Indices, columns: Indices) -> Arrays:
    """Return the arrays of the block of M with these rows and columns, both ascending,
    faster than scipy does."""
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
        is_row, row_starts = (
            np.repeat(is_row, np.diff(indptr)),
            np.append(0, indptr[rows + 1]),
        )
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
    """Return the matrix with the entries in these arrays, one after another; entries
    with the same row and column are summed."""
    rows_and_columns = np.concatenate(rows), np.concatenate(columns)
    return csr_array((np.concatenate(values), rows_and_columns), shape=shape)
