"""The transpose of a matrix in compressed sparse rows, from its arrays."""

from __future__ import annotations

import numpy as np

from lcpcli.clock import imports
from lcpcli.typing import Indices, Vector


def transposed(
    shape: tuple[int, int], indptr: Indices, indices: Indices, data: Vector
) -> tuple[Indices, Indices, Vector]:
    """Return the arrays of the transpose of a matrix in compressed sparse rows, with sorted indices. scipy's routine
    without checks takes a fifth of the time for a small matrix, and is not public: where it is not found, the usual one
    stands in."""
    try:
        with imports:
            from scipy.sparse._sparsetools import csr_tocsc
    except ImportError:
        with imports:
            from scipy.sparse import csr_array
        T = csr_array((data, indices, indptr), shape=shape).T.tocsr()
        return T.indptr, T.indices, T.data
    turned = np.empty(shape[1] + 1, dtype=indptr.dtype), np.empty_like(indices), np.empty_like(data)
    csr_tocsc(*shape, indptr, indices, data, *turned)
    return turned
