"""The entries of matrices in compressed sparse rows, a block of rows at a time, so that what is computed of them stays
in the cache and no second matrix is formed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.clock import imports
from lcpcli.typing import Indices, Matrix, Vector

BLOCK_ROWS = 1 << 14  # vectors of so many numbers stay in the cache


def row_parts(n: int) -> Iterator[slice]:
    """Yield slices of n rows, a block each."""
    for top in range(0, n, BLOCK_ROWS):
        yield slice(top, min(top + BLOCK_ROWS, n))


def entries(M: Matrix) -> Iterator[tuple[slice, slice, Indices]]:
    """Yield for each block of rows of M the slices of the rows and of their entries, and the row of each entry, counted
    from the first of the block."""
    for rows in row_parts(M.shape[0]):
        starts = M.indptr[rows.start : rows.stop + 1]
        owners = np.repeat(np.arange(starts.size - 1), np.diff(starts))
        yield rows, slice(int(starts[0]), int(starts[-1])), owners


def with_data(M: Matrix, data: Vector) -> Matrix:
    """Return the matrix with these numbers in the places of the entries of M, whose arrays of places it shares."""
    with imports:
        from lcpcli.linalg.compressed_rows import of_arrays
    return of_arrays(M.shape, M.indptr, M.indices, data)
