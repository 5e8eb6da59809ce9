"""Products of one matrix with many vectors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.typing import Matrix, Vector


def multiplier(M: Matrix) -> Callable[[Vector], Vector]:
    """Return a function that returns M v for a contiguous v of shape (n,), to be called many times."""
    if not is_sparse(M):
        return partial(product, M)
    return partial(row_multiplier(M), slice(0, M.shape[0]))


def row_multiplier(M: Matrix) -> Callable[[slice, Vector], Vector]:
    """Return a function that returns some rows of M v, a slice with both ends, for M in compressed sparse rows and a
    contiguous v of its type, to be called many times.

    scipy's operator takes ten times as long as the product with a small matrix in compressed sparse rows; its routine
    without checks is not public, so the operator stands in where it is not found.
    """
    try:
        with imports:
            from scipy.sparse._sparsetools import csr_matvec
    except ImportError:
        return lambda rows, v: np.asarray(M[rows] @ v)
    columns, indptr, indices, data = M.shape[1], M.indptr, M.indices, M.data

    def times(rows: slice, v: Vector) -> Vector:
        w = np.zeros(rows.stop - rows.start, dtype=data.dtype)
        csr_matvec(w.size, columns, indptr[rows.start : rows.stop + 1], indices, data, v, w)
        return w

    return times
