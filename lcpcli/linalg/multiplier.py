"""Products of one matrix with many vectors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.typing import Matrix, Vector


def multiplier(M: Matrix) -> Callable[[Vector], Vector]:
    """Return a function that returns M v for a contiguous v of shape (n,), to be called many times.

    scipy's operator takes ten times as long as the product with a small matrix in compressed sparse rows; its routine
    without checks is not public, so the operator stands in where it is not found.
    """
    if not is_sparse(M):
        return partial(product, M)
    try:
        with imports:
            from scipy.sparse._sparsetools import csr_matvec
    except ImportError:
        return M.__matmul__  # type: ignore[no-any-return]
    shape, arrays = M.shape, (M.indptr, M.indices, M.data)

    def times(v: Vector) -> Vector:
        w = np.zeros(shape[0])
        csr_matvec(*shape, *arrays, v, w)
        return w

    return times
