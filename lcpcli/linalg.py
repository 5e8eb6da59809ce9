"""Where dense and sparse matrices differ. scipy is imported only where it is needed: for sparse or large matrices.

Matrices are dense float64 arrays or scipy.sparse.csr_array, of shape (n, n).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from lcpcli.problem import is_sparse
from lcpcli.typing import Matrix, Vector

SMALL = 200  # up to this n a dense matrix is inverted by numpy: importing scipy costs more than it saves
BLOCK_BYTES = 1 << 20


class SingularMatrix(Exception):
    """The matrix is singular, or so close to it that a solve has no correct digit."""


def norm_inf(M: Matrix) -> float:
    """The largest row sum of |M|."""
    if is_sparse(M):
        return float(abs(M).sum(axis=1).max())
    return max(float(block.sum(axis=1).max()) for _, block in _row_blocks(M))


def row_and_column_maxima(M: Matrix, R: Vector, C: Vector) -> tuple[Vector, Vector]:
    """The largest entry of every row and of every column of R |M| C for diagonals R, C of shape (n,)."""
    n = R.size
    rows, columns = np.zeros(n), np.zeros(n)
    if is_sparse(M):
        entries = np.abs(M.data) * C[M.indices]
        entries *= np.repeat(R, np.diff(M.indptr))
        filled = np.flatnonzero(np.diff(M.indptr))
        if filled.size:
            rows[filled] = np.maximum.reduceat(entries, M.indptr[filled])
        np.maximum.at(columns, M.indices, entries)
        return rows, columns
    for part, block in _row_blocks(M):
        block *= C
        block *= R[part, np.newaxis]
        rows[part] = block.max(axis=1)
        np.maximum(columns, block.max(axis=0), out=columns)
    return rows, columns


def absolute_product(M: Matrix, z: Vector) -> Vector:
    """|M| z, by parts, so that |M| is never formed."""
    if is_sparse(M):
        product: Vector = abs(M) @ z
        return product
    return np.concatenate([block @ z for _, block in _row_blocks(M)])


def _row_blocks(M: Matrix) -> Iterator[tuple[slice, Vector]]:
    """|M| a few rows at a time, so that no second matrix is needed."""
    height = max(1, BLOCK_BYTES // (M.shape[1] * M.itemsize))
    for top in range(0, M.shape[0], height):
        part = slice(top, top + height)
        yield part, np.abs(M[part])


Solve = Callable[[Vector], Vector]


def factorizer(M: Matrix) -> Callable[[float], Solve]:
    """What factorizes shift I + M for a given shift, with all that it needs imported: importing is not solving time.

    It returns a solver x = solve(b) of (shift I + M) x = b, and raises SingularMatrix if that matrix is singular to
    working precision. That is found out by solving a system whose solution is known: no digit comes back. Unlike a
    condition number, that is not upset by rows and columns in different units.
    """
    factorize = _sparse_factorizer(M) if is_sparse(M) else _dense_factorizer(M)

    def checked(shift: float) -> Solve:
        solve = factorize(shift)
        ones = np.ones(M.shape[0])
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            known = 1 / np.maximum(row_and_column_maxima(M, ones, ones)[1], shift)
            back = solve(M @ known + shift * known)
            if not np.max(np.abs(back / known - 1)) < 0.5:
                raise SingularMatrix
        return solve

    return checked


def _sparse_factorizer(M: Matrix) -> Callable[[float], Solve]:
    from scipy.sparse import eye_array
    from scipy.sparse.linalg import splu

    def factorize(shift: float) -> Solve:
        try:
            solve: Solve = splu((M + shift * eye_array(M.shape[0], format="csr")).tocsc()).solve
        except RuntimeError as error:
            if "singular" not in str(error):
                raise
            raise SingularMatrix from None
        return solve

    return factorize


def _dense_factorizer(M: Matrix) -> Callable[[float], Solve]:
    if M.shape[0] <= SMALL:
        return lambda shift: _invert(_shifted(M, shift))
    from scipy.linalg import get_lapack_funcs

    getrf, getrs = get_lapack_funcs(("getrf", "getrs"), (M,))

    def factorize(shift: float) -> Solve:
        lu, pivots, info = getrf(_shifted(M, shift), overwrite_a=True)
        if info > 0:
            raise SingularMatrix

        def solve(b: Vector) -> Vector:
            x: Vector = getrs(lu, pivots, b)[0]
            return x

        return solve

    return factorize


def _shifted(M: Matrix, shift: float) -> Matrix:
    A = M.copy(order="F")
    A.reshape(-1, order="F")[:: A.shape[0] + 1] += shift
    return A


def _invert(A: Matrix) -> Solve:
    """The inverse and one step of refinement: as accurate as an LU factorization, without scipy."""
    try:
        inverse = np.linalg.inv(A)
    except np.linalg.LinAlgError:
        raise SingularMatrix from None

    def solve(b: Vector) -> Vector:
        x = inverse @ b
        refined: Vector = x + inverse @ (b - A @ x)
        return refined

    return solve
