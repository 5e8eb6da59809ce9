"""Products of one matrix with many vectors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.typing import Indices, Matrix, Vector

Shape: TypeAlias = tuple[int, int]


def multiplier(M: Matrix) -> Callable[[Vector], Vector]:
    """Return a function that returns M v for a contiguous v of shape (n,), to be called many times."""
    return compressed_multiplier(M.shape, M.indptr, M.indices, M.data) if is_sparse(M) else partial(product, M)


def compressed_multiplier(shape: Shape, indptr: Indices, indices: Indices, data: Vector) -> Callable[[Vector], Vector]:
    """Return a function as `multiplier` does for the arrays of a matrix in compressed sparse rows."""
    return partial(row_multiplier(shape, indptr, indices, data), slice(0, shape[0]))


def row_multiplier(shape: Shape, indptr: Indices, indices: Indices, data: Vector) -> Callable[[slice, Vector], Vector]:
    """Return a function that returns some rows of M v, a slice with both ends, for the arrays of M in compressed sparse
    rows and a contiguous v of its type, to be called many times.

    scipy's operator takes ten times as long as the product with a small matrix in this form; its routine without checks
    is not public, so the operator stands in where it is not found.
    """
    try:
        with imports:
            from scipy.sparse._sparsetools import csr_matvec
    except ImportError:
        M = _compressed(shape, indptr, indices, data)
        return lambda rows, v: np.asarray(M[rows] @ v)

    def times(rows: slice, v: Vector) -> Vector:
        w = np.zeros(rows.stop - rows.start, dtype=data.dtype)
        csr_matvec(w.size, shape[1], indptr[rows.start : rows.stop + 1], indices, data, v, w)
        return w

    return times


def _compressed(shape: Shape, indptr: Indices, indices: Indices, data: Vector) -> Matrix:
    with imports:
        from scipy.sparse import csr_array
    return csr_array((data, indices, indptr), shape=shape)
