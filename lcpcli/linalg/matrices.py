"""Operations on dense and sparse matrices alike, products with vectors, and accurate
residuals.

Matrices are dense float64 arrays or scipy.sparse.csr_array, of shape (n, n). scipy is
imported only when needed: for sparse matrices. What many products with one matrix have
in common is prepared once (`multiplier`).

Rounding errors in M z + q are bounded, underflow of products included, and residuals
are computed as if in more than twice the precision: every product is split into its
rounded value and its error (T. J. Dekker, A floating-point technique for extending the
available precision, Numerische Mathematik 18 (1971) 224-242), and math.fsum adds all of
them exactly. For many rows at once the sums are distilled: T. Ogita, S. M. Rump and S.
Oishi, Accurate sum and dot product, SIAM Journal on Scientific Computing 26 (2005)
1955-1988.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from copy import copy
from functools import partial
from itertools import chain, pairwise, starmap
from typing import Any, Literal, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import (
    LARGEST_DOUBLE,
    MAX_COPIED_ENTRIES,
    MAX_LOOPED_ENTRIES,
    ROW_ROUNDING,
    SMALLEST_NORMAL,
    number_of,
    sizes,
)
from lcpcli.typing import Indices, Mask, Matrix, Vector

# Numbers in a block of rows, which fits in the processor's cache.
BLOCK_NUMBERS = 1 << 17
# A band is narrow if its size is at most this multiple of the entries of M: factors
# within the band then have few more entries than M.
MAX_NARROW_ENTRIES = 4
# Rows of a dense M that are sampled to see whether it has many nonzero entries.
SAMPLED_ROWS = 32
# Rows of a sparse M up to which operations on its dense form take less time.
FEW_AS_DENSE = 100
MIN_SHARED_ROWS = 64  # rows from which a BLAS may use several threads
# Products R_i M_ij C_j with R_i, C_j between the inverse of this and this overflow or
# underflow in intermediate results only if the product itself does.
MODERATE_FACTOR = 2.0**100
# Limit on the row sums of |entries| off the diagonal after scaling the diagonal to 1:
# if all sums are smaller, the condition number is below 2 / (1 - 0.95) = 40, by
# Gershgorin's theorem.
DOMINATED = 0.95
# The largest ratio of positive entries off the diagonal to unknowns: so few change the
# active set little.
MAX_POSITIVE = 0.02


def is_sparse(M: Any) -> bool:
    """Return whether M is a scipy sparse matrix or array, as opposed to a linear
    operator, without importing scipy.
    """
    return (
        type(M) is not np.ndarray
        and type(M).__module__.startswith("scipy.sparse")
        and hasattr(M, "tocsr")
    )


def are_equal(A: Matrix, B: Matrix) -> bool:
    """Return whether two arrays, dense or sparse, have the same shape and numbers."""
    if A is B or A.shape != B.shape:
        return A is B
    if not (is_sparse(A) or is_sparse(B)):
        return not number_of(A != B)
    if is_sparse(A) and is_sparse(B) and A.format == B.format == "csr":
        same_arrays = (
            np.array_equal(getattr(A, name), getattr(B, name))
            for name in ("data", "indices", "indptr")
        )
        if all(same_arrays):
            return True
    return not (A != B).sum()


def norm_inf(M: Matrix) -> float:
    """Return the largest row sum of |M|."""
    if is_sparse(M):
        return float(abs(M).sum(axis=1).max(initial=0.0))
    return max(
        (float(block.sum(axis=1).max()) for _, block in row_blocks(M)), default=0.0
    )


def row_and_column_maxima(
    M: Matrix, R: Vector, C: Vector, symmetric: bool = False
) -> tuple[Vector, Vector]:
    """Return the largest entry of every row and of every column of R |M| C for
    diagonals R, C of shape (n,).

    symmetric : whether R |M| C is symmetric: the row maxima of a sparse M are then
    returned for the columns too, which saves time.
    """
    rows = np.zeros(R.size)
    columns = np.zeros(R.size)
    scale = _scaler(R, C)
    if is_sparse(M):
        entries = scale(np.abs(M.data), np.repeat(R, np.diff(M.indptr)), C[M.indices])
        sizes = _by_rows(np.maximum, M, entries)
        if symmetric:
            return sizes, sizes
        np.maximum.at(columns, M.indices, entries)
        return sizes, columns
    if M.size <= MAX_COPIED_ENTRIES:
        entries = scale(np.abs(M), R[:, np.newaxis], C)
        return entries.max(axis=1, initial=0.0), entries.max(axis=0, initial=0.0)
    for part, block in row_blocks(M):
        entries = scale(block, R[part, np.newaxis], C)
        rows[part] = entries.max(axis=1)
        np.maximum(columns, entries.max(axis=0), out=columns)
    return rows, columns


def has_no_positive_links(M: Matrix) -> bool:
    """Return whether M is a Z-matrix: whether no entry off the diagonal is positive."""
    entries = M.data if is_sparse(M) else M
    # Most dense matrices that are no Z-matrices show it in their first row.
    if entries.ndim > 1 and entries.size and np.count_nonzero(entries[0] > 0) > 1:
        return False
    return bool(np.count_nonzero(entries > 0) == np.count_nonzero(M.diagonal() > 0))


def positive_links(M: Matrix) -> int:
    """Return the number of positive entries of a sparse M off the diagonal."""
    return int(np.count_nonzero(M.data > 0) - np.count_nonzero(M.diagonal() > 0))


def may_be_eliminated(M: Matrix) -> bool:
    """Return whether a sparse M is tridiagonal with a positive diagonal and at most few
    positive entries off the diagonal, as where drift exceeds diffusion at the boundary
    of a grid.
    """
    n = M.shape[0]
    if not (is_sparse(M) and n > 1 and M.nnz <= 3 * n and width(M) <= 1):
        return False
    return bool(M.diagonal().min() > 0.0 and positive_links(M) <= MAX_POSITIVE * n)


def may_be_stiff(M: Matrix) -> bool:
    """Return whether a sparse M may be ill-conditioned: it has a positive diagonal that
    does not dominate, and positive entries off it.

    Fourth differences are of this kind, and stiffness matrices of beams, plates and
    bodies. Differences of second order have no positive entry off the diagonal, and are
    solved by methods for Z-matrices.
    """
    if not is_sparse(M) or not M.shape[0]:
        return False
    diagonal = M.diagonal()
    if not diagonal.min() > 0 or has_no_positive_links(M):
        return False
    units = 1 / np.sqrt(diagonal)
    sums = units * absolute_product(M, units)
    return bool(sums.max() > 1 + DOMINATED)


def row_maxima(M: Matrix) -> Vector:
    """Return the largest |entry| of every row of M, NaN if an entry of the row is NaN;
    for a dense M, |M| is not formed.
    """
    return _by_rows(np.maximum, M, np.abs(M.data)) if is_sparse(M) else _maxima(M, 1)


def column_maxima(M: Matrix) -> Vector:
    if not is_sparse(M):
        return _maxima(M, 0)
    columns = np.zeros(M.shape[1])
    np.maximum.at(columns, M.indices, np.abs(M.data))
    return columns


def _by_rows(reduction: np.ufunc, M: Matrix, values: Vector) -> Vector:
    """Return the reduction (sum or maximum) over each row of an array with one value
    for each stored entry of M; 0 for empty rows.
    """
    rows, filled = np.zeros(M.shape[0]), np.flatnonzero(np.diff(M.indptr))
    if filled.size:
        rows[filled] = reduction.reduceat(values, M.indptr[filled])
    return rows


def _maxima(M: Vector, axis: int) -> Vector:
    if M.size <= MAX_COPIED_ENTRIES:
        return np.asarray(np.abs(M).max(axis, initial=0.0))
    return np.asarray(np.maximum(M.max(axis), -M.min(axis)))


def dense(A: Matrix) -> Matrix:
    """Return A as a dense array; A itself if it is dense already."""
    return A.toarray() if is_sparse(A) else A


def compressed(A: Matrix | tuple[int, int]) -> Matrix:
    """Return A, or a zero matrix if A is a shape, in compressed sparse rows; A itself
    if it has that form already."""
    if type(A).__name__ == "csr_array":
        return A
    with imports:
        from scipy.sparse import csr_array
    return csr_array(A)


def comparison(M: Matrix) -> Matrix:
    """Return the comparison matrix: |M_ii| on the diagonal, -|M_ij| off it."""
    diagonal = np.abs(M.diagonal())
    return plus_diagonal(plus_diagonal(-abs(M), diagonal), diagonal)


def scaled(M: Matrix, R: Vector, C: Vector) -> Matrix:
    """Return R M C for diagonals R, C > 0 of shape (n,), as a new matrix; it is exact
    if R and C are powers of two.

    Entries underflow only if R_i M_ij C_j itself does; if that overflows, the entry is
    the largest finite number.
    """
    if not is_sparse(M):
        return _scaler(R, C)(M, R[:, np.newaxis], C)
    scale, data = _scaler(R, C), np.empty_like(M.data)
    for rows, row_entries, owners in entries(M):
        data[row_entries] = scale(
            M.data[row_entries], R[rows][owners], C[M.indices[row_entries]]
        )
    return with_data(M, data)


def principal(M: Matrix, indices: Indices) -> Matrix:
    """Return M_PP for the indices of P in ascending order: dense or in compressed
    sparse rows as M is, and M itself if P contains all indices.
    """
    if indices.size == M.shape[0]:
        return M
    if not is_sparse(M):
        return M[indices][:, indices]
    with imports:
        from lcpcli.linalg.compressed_rows import block, of_arrays
    return of_arrays((indices.size, indices.size), *block(M, indices, indices))


def plus_diagonal(
    M: Matrix, d: Vector | float, order: Literal["C", "F"] = "C"
) -> Matrix:
    """Return M + diag(d), or M + d I for a number d, as a new matrix; a dense one is
    stored by rows (`order` "C") or columns ("F").
    """
    if not is_sparse(M):
        A = M.copy(order)
        diagonal = np.einsum("ii->i", A)  # a view
        diagonal += d
        return A
    with imports:
        from scipy.sparse import diags_array
    return (M + diags_array(np.broadcast_to(d, M.shape[:1]), format="csr")).tocsr()


def thinned(M: Matrix, max_entries: float) -> Matrix:
    """Return a dense M in compressed rows if it has at most `max_entries` nonzero
    entries; otherwise M itself.

    scipy's conversion takes several times as long as a product with M.
    """
    if is_sparse(M):
        return M
    rows, columns = M.shape
    sample = M[:: max(1, rows // SAMPLED_ROWS)]
    if np.count_nonzero(sample) * rows > 2 * max_entries * sample.shape[0]:
        return M
    positions = np.flatnonzero(M != 0.0)
    if positions.size > max_entries:
        return M
    with imports:
        from scipy.sparse import csr_array
    indptr = np.searchsorted(positions, np.arange(0, M.size + 1, columns))
    arrays = (
        M.reshape(-1)[positions],
        (positions % columns).astype(np.int32),
        indptr.astype(np.int32),
    )
    for array in arrays:
        array.setflags(write=False)
    return csr_array(arrays, shape=M.shape)


def _scaler(R: Vector, C: Vector) -> Callable[[Vector, Vector, Vector], Vector]:
    """Return a function of arrays entries, left and right that returns left * entries *
    right without intermediate overflow or underflow, for factors from R and C.

    If the product itself overflows, the result is the largest finite number.
    """
    factors = np.concatenate((R, C))
    smallest, largest = factors.min(initial=1.0), factors.max(initial=1.0)
    if smallest >= 1 / MODERATE_FACTOR and largest <= MODERATE_FACTOR:
        return lambda entries, left, right: left * entries * right

    def multiply(entries: Vector, left: Vector, right: Vector) -> Vector:
        (left, left_power), (right, right_power) = np.frexp(left), np.frexp(right)
        with np.errstate(over="ignore"):
            result: Vector = np.ldexp(
                2 * left * entries * (2 * right), left_power + right_power - 2
            )
        return np.clip(result, -LARGEST_DOUBLE, LARGEST_DOUBLE, out=result)

    return multiply


def row_blocks(M: Matrix) -> Iterator[tuple[slice, Vector]]:
    """Yield the blocks of rows of M and of |M|, so that |M| is never formed as a
    whole.
    """
    for rows in row_parts(*M.shape):
        yield rows, np.abs(M[rows])


def row_parts(n: int, width: int = 8) -> Iterator[slice]:
    """Yield slices that divide n rows into blocks that fit in the processor's cache,
    for a matrix with `width` columns, or for as many vectors of length n.
    """
    height = max(1, BLOCK_NUMBERS // max(1, width))
    for top in range(0, n, height):
        yield slice(top, min(top + height, n))


def entries(M: Matrix) -> Iterator[tuple[slice, slice, Indices]]:
    """Yield, for each block of rows of a sparse M, the slice of its rows, the slice of
    its entries, and the row of each entry relative to the first row of the block;
    intermediate arrays then fit in the processor's cache.
    """
    for rows in row_parts(M.shape[0]):
        starts = M.indptr[rows.start : rows.stop + 1]
        owners = np.repeat(np.arange(starts.size - 1), np.diff(starts))
        yield rows, slice(int(starts[0]), int(starts[-1])), owners


def with_data(M: Matrix, data: Vector) -> Matrix:
    """Return the matrix with the pattern of M, whose index arrays it shares, and these
    values.
    """
    other = copy(M)  # it shares its arrays, but is faster than a new one
    other.data = data
    return other


def column_reader(M: Matrix) -> Callable[[int], Vector]:
    """Return a function that returns column j of M, dense."""
    if not is_sparse(M):
        return lambda j: M[:, j]
    by_columns = M.tocsc()

    def column(j: int) -> Vector:
        column_entries = slice(*by_columns.indptr[j : j + 2])
        return np.bincount(
            by_columns.indices[column_entries],
            by_columns.data[column_entries],
            M.shape[0],
        ).astype(np.float64, copy=False)

    return column


def is_symmetric(M: Matrix) -> bool:
    """Return whether M equals its transpose exactly."""
    if not is_sparse(M):
        if (
            M.size <= 2 * MAX_LOOPED_ENTRIES
        ):  # comparing lists takes a third of the time
            return bool(M.tolist() == M.T.tolist())
        row_slices = row_parts(*M.shape)
        return np.array_equal(M[:1], M[:, :1].T) and all(
            np.array_equal(M[rows], M[:, rows].T) for rows in row_slices
        )
    if M.shape[0] <= FEW_AS_DENSE:
        return is_symmetric(M.toarray())
    pair = mirrored(M)
    return pair is not None and np.array_equal(pair[0].data, pair[1])


@np.errstate(over="ignore", invalid="ignore")
def largest_asymmetry(M: Matrix) -> tuple[float, int, int]:
    """Return the largest |M_ij - M_ji| and its indices i, j, with i < j."""
    difference = abs(M - M.T)
    if is_sparse(M):
        coo = difference.tocoo()
        at = int(coo.data.argmax())
        i, j = sorted((int(coo.row[at]), int(coo.col[at])))
        return float(coo.data[at]), i, j
    i, j = divmod(int(difference.argmax()), len(M))  # the first, which has i < j
    return float(difference[i, j]), i, j


def symmetric_part(M: Matrix) -> Matrix:
    """Return (M + M') / 2: its upper triangle is computed and mirrored, so that it is
    exactly symmetric.
    """
    if is_sparse(M):
        with imports:
            from scipy.sparse import triu
    else:
        triu = np.triu
    upper = triu(M + (M.T - M) / 2)  # this form leaves symmetric entries unchanged
    return upper + triu(upper, 1).T


def mirrored(M: Matrix) -> tuple[Matrix, Vector] | None:
    """Return a sparse M without stored zeros, and M_ji for each entry M_ij; None if the
    pattern of M is not symmetric.
    """
    if not (M.has_canonical_format and M.data.all()):
        M = M.copy()
        M.sum_duplicates()
        M.eliminate_zeros()
    with imports:
        from lcpcli.linalg.compressed_rows import transposed
    indptr, indices, data = transposed(M.shape, M.indptr, M.indices, M.data)
    return (
        (M, data)
        if np.array_equal(M.indptr, indptr) and np.array_equal(M.indices, indices)
        else None
    )


def is_skew(M: Matrix) -> bool:
    """Return whether a sparse M is equal to -M'."""
    if not is_sparse(M) or not M.nnz or M.diagonal().any():
        return False
    pair = mirrored(M)
    return pair is not None and np.array_equal(pair[0].data, -pair[1])


def is_narrow(M: Matrix, max_entries: float = MAX_NARROW_ENTRIES) -> bool:
    """Return whether the entries of a sparse M are so close to its diagonal, as for
    problems in one space dimension, that the band has at most `max_entries` times as
    many numbers as M has entries.
    """
    return bool(M.shape[0] * (2 * width(M) + 1) <= max_entries * M.nnz)


def width(M: Matrix) -> int:
    """Return the largest |i - j| of a stored entry of a sparse M."""
    return int(
        np.abs(np.repeat(np.arange(M.shape[0]), np.diff(M.indptr)) - M.indices).max(
            initial=0
        )
    )


def stack(blocks: list[list[Matrix]]) -> Matrix:
    """Return the block matrix, sparse if the first block is sparse."""
    if not is_sparse(blocks[0][0]):
        return np.block(blocks)
    with imports:
        from scipy.sparse import block_array, csr_array
    return block_array(
        [[csr_array(block) for block in row] for row in blocks], format="csr"
    )


def unit_columns(n: int, selected: Indices, sparse: bool) -> Matrix:
    """Return the selected columns of the identity of order n, as a sparse or a dense
    matrix.
    """
    shape = (n, selected.size)
    rows_and_columns = (
        selected.astype(np.int32),
        np.arange(selected.size, dtype=np.int32),
    )
    if sparse:
        with imports:
            from scipy.sparse import csr_array
        return csr_array((np.ones(selected.size), rows_and_columns), shape=shape)
    E = np.zeros(shape)
    E[rows_and_columns] = 1.0
    return E


def product(M: Matrix, v: Vector) -> Vector:
    """Return M v for M of shape (m, n), dense or sparse, and v of shape (n,), or (n, k)
    for k vectors at once.

    numpy and scipy may each load a BLAS with a separate thread pool, whose threads keep
    spinning for a while after each call. When calls alternate between the two, they
    compete for the processors: a factorization by scipy between products by numpy was
    observed to take three to fifteen times as long. Therefore scipy's BLAS, once
    loaded, computes the products with large dense matrices too.
    """
    if not isinstance(M, np.ndarray):
        return _product_with(M, M.data, v) if is_sparse(M) else np.asarray(M @ v)
    # BLAS refuses vectors without entries.
    flags = M.flags if M.shape[0] >= MIN_SHARED_ROWS and M.size else None
    blas = (
        None
        if flags is None or not flags.forc
        else sys.modules.get("scipy.linalg.blas")
    )
    if blas is None or flags is None:
        return np.asarray(M @ v)
    by_columns, prefix = flags.f_contiguous, "s" if M.dtype == np.float32 else "d"
    multiply = getattr(blas, f"{prefix}gemv" if v.ndim == 1 else f"{prefix}gemm")
    transpose = {"trans" if v.ndim == 1 else "trans_a": not by_columns}
    return np.asarray(multiply(1.0, M if by_columns else M.T, v, **transpose))


def _product_with(M: Matrix, data: Vector, v: Vector) -> Vector:
    """Return the product of v and a sparse matrix with the pattern of M and the values
    `data`.
    """
    if (
        M.format == "csr"
        and v.shape == M.shape[1:]
        and v.dtype == data.dtype
        and v.flags.c_contiguous
    ):
        return compressed_multiplier(M.shape, M.indptr, M.indices, data)(v)
    return np.asarray(
        (M if data is M.data else type(M)((data, M.indices, M.indptr), shape=M.shape))
        @ v
    )


def absolute_product(M: Matrix, z: Vector) -> Vector:
    """Return |M| z by blocks of rows, so that |M| is never formed as a whole."""
    if is_sparse(M):
        return _product_with(M, np.abs(M.data), z)
    if M.size <= MAX_COPIED_ENTRIES:
        return np.asarray(np.abs(M) @ z)
    return np.concatenate([product(block, z) for _, block in row_blocks(M)])


Shape: TypeAlias = tuple[int, int]


def multiplier(M: Matrix) -> Callable[[Vector], Vector]:
    """Return a function that returns M v for a contiguous v of shape (n,), for many
    calls.
    """
    return (
        compressed_multiplier(M.shape, M.indptr, M.indices, M.data)
        if is_sparse(M)
        else partial(product, M)
    )


def compressed_multiplier(
    shape: Shape, indptr: Indices, indices: Indices, data: Vector
) -> Callable[[Vector], Vector]:
    """Return a function as `multiplier` does, for a matrix given by the arrays of
    compressed sparse rows.
    """
    return partial(row_multiplier(shape, indptr, indices, data), slice(0, shape[0]))


def row_multiplier(
    shape: Shape, indptr: Indices, indices: Indices, data: Vector
) -> Callable[[slice, Vector], Vector]:
    """Return a function of a slice with explicit start and stop and a contiguous v that
    returns these rows of M v. M is described by the arrays of compressed sparse rows,
    and v has the type of its data.

    scipy's operator takes ten times as long as this routine for a small matrix, and a
    call on a grid with 40,000 unknowns 1.3 times as long. As the routine, which makes
    no checks, is not public, the operator is used if it cannot be imported.
    """
    try:
        with imports:
            from scipy.sparse._sparsetools import csr_matvec
    except ImportError:
        with imports:
            from scipy.sparse import csr_array
        M = csr_array((data, indices, indptr), shape=shape)
        return lambda rows, v: np.asarray(M[rows] @ v)

    def times(rows: slice, v: Vector) -> Vector:
        w = np.zeros(rows.stop - rows.start, dtype=data.dtype)
        csr_matvec(
            w.size, shape[1], indptr[rows.start : rows.stop + 1], indices, data, v, w
        )
        return w

    return times


# If |q_i| + |M_i| |z| is at most this, the error by underflow of products may exceed
# ROW_ROUNDING times it; the test `may_underflow` is skipped for larger rows.
TINY_TERMS = 2.0**-900


def row_errors(M: Matrix, z: Vector, row_magnitudes: Vector) -> Vector:
    """Return bounds on the rounding errors in w = M z + q for z of shape (n,), or for
    the rows of z of shape (m, n).

    row_magnitudes : |q| + |M| |z| as computed, of the shape of w.

    A product that underflows has an error of up to SMALLEST_NORMAL, in w as in
    `row_magnitudes`.
    """
    errors: Vector = ROW_ROUNDING * row_magnitudes
    tiny = row_magnitudes <= TINY_TERMS
    if np.count_nonzero(tiny) and may_underflow(
        M if is_sparse(M) or z.ndim > 1 else M[tiny], z
    ):
        errors += np.where(tiny, SMALLEST_NORMAL * products(M, z), 0.0)
    return errors


def may_underflow(M: Matrix, z: Vector) -> bool:
    """Return whether a product of an entry of M and a component of z may underflow."""
    smallest, factor = sizes(M.data if is_sparse(M) else M)[0], sizes(z)[0]
    with np.errstate(over="ignore", under="ignore"):
        return bool(smallest * factor < SMALLEST_NORMAL)


def products(M: Matrix, z: Vector) -> Vector:
    """Return the number of products M_ij z_j of two nonzero numbers in each row of
    M z.
    """
    used: Mask = M != 0
    counts: Vector = (used.astype(np.float64) @ (z != 0).T.astype(np.float64)).T
    return counts


SPLITTER = 2.0**27 + 1  # Dekker's, for a mantissa of 53 bits
MIN_ROWS = 200  # rows of a sparse matrix from which their sums are distilled together
# The largest ratio of a table with rows padded to equal length to its actual entries.
MAX_PADDED = 4
# Relative to the sum of |terms|: a smaller sum has lost so many digits that two passes
# of distillation, about three times the precision, may not be enough.
CANCELLED = 2.0**-80


def accurate_residual(A: Matrix, x: Vector, b: Vector) -> Vector:
    """Return b - A x for a dense A or one in compressed sparse rows, with a single
    rounding of each component (except for overflow and underflow).
    """
    w = np.empty(b.size)
    if not is_sparse(A):
        used = x.nonzero()[0]
        for row_slice in row_parts(b.size, max(used.size, 1)):
            raise_if_timed_out()
            rows = split_products(A[row_slice].take(used, 1), x[used])
            sums = zip(
                b[row_slice].tolist(),
                *(products.tolist() for products in rows),
                strict=True,
            )
            w[row_slice] = [math.fsum(chain((value,), *row)) for value, *row in sums]
        return w
    for row_slice in row_parts(b.size):
        rows = A if w.size <= row_slice.stop - row_slice.start else A[row_slice]
        longest = int(np.diff(rows.indptr).max())
        together = (
            rows.shape[0] >= MIN_ROWS
            and longest * rows.shape[0] <= MAX_PADDED * rows.nnz
        )
        w[row_slice] = (_distilled if together else _summed)(rows, x, b[row_slice])
    return w


def _summed(A: Matrix, x: Vector, b: Vector) -> Vector:
    """Return b - A x for a sparse A, each row summed exactly by math.fsum."""
    terms, errors = _products(A.data, x[A.indices])
    rows = zip(b.tolist(), starmap(slice, pairwise(A.indptr.tolist())), strict=True)
    return np.array(
        [math.fsum(chain((value,), terms[row], errors[row])) for value, row in rows]
    )


def _distilled(A: Matrix, x: Vector, b: Vector) -> Vector:
    """Return b - A x for a sparse A whose rows have similar lengths, all rows at once:
    two passes of TwoSum over the terms (distillation). Rows with more cancellation than
    that can resolve are summed by `_summed`.
    """
    lengths = np.diff(A.indptr)
    entries = np.arange(lengths.max())[:, np.newaxis]
    positions = np.minimum(A.indptr[:-1] + entries, A.nnz - 1)
    used = np.where(entries < lengths, A.data[positions], 0.0)
    terms = np.concatenate(
        (b[np.newaxis], *split_products(used, x[A.indices[positions]]))
    )
    sizes = np.abs(terms).sum(axis=0)
    for _ in range(2):
        # Each pair is replaced by its rounding error and its rounded sum (TwoSum).
        for low, high in pairwise(terms):
            total = low + high
            high_part = total - low
            np.add(low - (total - high_part), high - high_part, out=low)
            high[:] = total
    rest = terms[:-1].sum(axis=0)
    w: Vector = terms[-1] + rest
    unsure = ((np.abs(w) <= CANCELLED * sizes) & terms[:-1].any(axis=0)).nonzero()[0]
    if unsure.size:
        w[unsure] = _summed(A[unsure], x, b[unsure])
    return w


def _products(a: Vector, x: Vector) -> tuple[list[float], list[float]]:
    """Return two lists whose i-th entries add up to exactly -a_i x_i."""
    raise_if_timed_out()
    terms, errors = split_products(a, x)
    return terms.tolist(), errors.tolist()


def split_products(a: Vector, x: Vector) -> tuple[Vector, Vector]:
    """Return two arrays whose sum is exactly -a x, entry by entry: the rounded products
    and their errors.
    """
    terms = a * x
    a_high, a_low = split(a)
    x_high, x_low = split(x)
    errors = a_low * x_low - (
        ((terms - a_high * x_high) - a_low * x_high) - a_high * x_low
    )
    return -terms, -errors


def split(v: Vector) -> tuple[Vector, Vector]:
    """Return v as the sum of two vectors whose entries have at most 26 significant
    bits.
    """
    large = SPLITTER * v
    high = large - (large - v)
    return high, v - high
