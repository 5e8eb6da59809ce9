"""Products with a matrix, all by the same BLAS.

numpy and scipy each have a BLAS with its own threads, which keep spinning for a while after each call. When both are
used in turn they compete for the processors: a factorization by scipy between products by numpy was observed to take
three to fifteen times as long. So once scipy.linalg is loaded, its BLAS computes the products with large dense matrices
too.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from lcpcli.linalg.matrices import FEW, is_sparse, row_blocks
from lcpcli.typing import Matrix, Vector

THREADED = 64  # rows from which a BLAS may use threads


def product(M: Matrix, v: Vector) -> Vector:
    """M v for M of shape (m, n), dense or sparse, and v of shape (n,), or (n, k) for k vectors at once."""
    blas = None if M.shape[0] < THREADED else _blas(M)
    if blas is None:
        plain: Vector = M @ v
        return plain
    by_columns = M.flags.f_contiguous
    multiply = blas.dgemv if v.ndim == 1 else blas.dgemm
    transpose = {"trans" if v.ndim == 1 else "trans_a": not by_columns}
    result: Vector = multiply(1.0, M if by_columns else M.T, v, **transpose)
    return result


def transposed_product(M: Matrix, v: Vector) -> Vector:
    """M' v for M of shape (m, n), dense or sparse, and v of shape (m,)."""
    return product(M.T, v)


def _blas(M: Matrix) -> Any:
    """scipy's BLAS if it is loaded and M is a large, contiguous dense matrix; else None."""
    flags = getattr(M, "flags", None)
    if flags is None or not flags.forc:
        return None
    return sys.modules.get("scipy.linalg.blas")


def absolute_product(M: Matrix, z: Vector) -> Vector:
    """|M| z by blocks of rows, so that |M| is never formed."""
    if is_sparse(M):
        result: Vector = abs(M) @ z
        return result
    if M.size <= FEW:
        small: Vector = np.abs(M) @ z
        return small
    return np.concatenate([product(block, z) for _, block in row_blocks(M)])
