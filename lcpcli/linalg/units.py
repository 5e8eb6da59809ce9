"""The units of rows and columns that a matrix itself suggests, the groups of them that are coupled, and equilibration.

A. R. Curtis and J. K. Reid, On the automatic scaling of matrices for Gaussian elimination, IMA Journal of Applied
Mathematics 10 (1972) 118-124: R and C with the least sum of squares of log2 |R_i M_ij C_j| over the nonzero entries.
They are unique up to a constant for each connected component of rows and columns, with an edge where M_ij is not 0, so
that what is measured in them does not depend on the units in which M is given. Of each |M_ij| only the exponent counts,
so that multiplying rows and columns by powers of two changes nothing at all.

Equilibration: for positive diagonals R and C the solutions of LCP(R M C, R q) are z / C with w scaled by R. With R and
C computed from the matrix itself, what is measured in scaled units hardly depends on the units of the data.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import FAR_FROM_ONE
from lcpcli.linalg.matrices import is_sparse, row_parts
from lcpcli.typing import Indices, Mask, Matrix, Vector

SETTLED_ERROR = 0.01  # of a power of two: the error in the normal equations that is left
MOST_CG_STEPS = 500  # of conjugate gradients; a matrix without zeros takes two
EXPONENT, BIAS = 0x7FF, 1022  # the bits of a double's exponent, and its value for 1/2 <= |a| < 1
MOST_SWEEPS = 30  # each of which halves the exponents that are left, so that all settle unless M ties them together
# Exponent of the ratio of units above which logarithms are balanced first, then the largest entries.
UNITS_FAR_APART = 40.0
# Exponent of the ratio of units up to which the exponents of the first sweep limit those of the others.
NEAR_UNITS = 4.0
EXPONENT_MARGIN = 4.0  # binary digits by which exponents may leave the range of those of the first sweep
LARGEST_POWER = 1000.0  # of two: exponents are limited to it, so that R, C and what they divide stay finite


class Units(NamedTuple):
    """Units R and C. rows, columns : log2 of R and of C, shape (n,). row_part, column_part : the numbers of the
    connected components of rows and columns, 0 to parts - 1, shape (n,)."""

    rows: Vector
    columns: Vector
    row_part: Indices
    column_part: Indices
    parts: int

    def diagonals(self) -> tuple[Vector, Vector]:
        """Return R and C, rounded to powers of two, so that scaling by them is exact."""
        return np.exp2(np.rint(self.rows)), np.exp2(np.rint(self.columns))

    def largest(self, values: Vector, part: Indices) -> Vector:
        """Return the largest value in each component, for values of rows or columns, shape (..., n), whose components
        are `part`; minus infinity in an empty component."""
        if self.parts == 1:
            return np.asarray(values.max(axis=-1, keepdims=True, initial=-np.inf))
        order = np.argsort(part, kind="stable")
        numbers, starts = np.unique(part[order], return_index=True)
        found = np.full((*values.shape[:-1], self.parts), -np.inf)
        found[..., numbers] = np.maximum.reduceat(values[..., order], starts, axis=-1)
        return found


def units(M: Matrix) -> Units:
    """Return the units of M, of shape (n, n), dense or in compressed sparse rows, with finite entries."""
    if is_sparse(M):
        return _sparse_units(M)
    n = M.shape[0]
    if M.all():

        def sums(v: Vector) -> Vector:
            return np.full(n, v.sum())

        counts, nothing = np.full((2, n), float(n)), np.zeros(n, dtype=np.intp)
        return Units(*_least_squares(_exponent_sums(M), counts, sums, sums), nothing, nothing, 1)
    used = M != 0
    entries, exponents = used.astype(np.float64), _exponents(np.ascontiguousarray(M)) * used
    found = _least_squares(_both_sums(exponents), _both_sums(entries), entries.__matmul__, entries.T.__matmul__)
    row_part, column_part, parts = _components(used)
    return Units(*found, row_part, column_part, parts)


def _sparse_units(M: Matrix) -> Units:
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import connected_components

        from lcpcli.linalg.entries import row_parts, with_data
        from lcpcli.linalg.multiplier import multiplier
    if not M.data.all():
        M = M.copy()
        M.eliminate_zeros()
    n, entries = M.shape[0], with_data(M, np.empty(M.nnz))
    for part in row_parts(M.nnz):
        entries.data[part] = _exponents(M.data[part])
    sums = _both_sums(entries)
    entries.data[:] = 1.0
    found = _least_squares(sums, _both_sums(entries), multiplier(entries), entries.T.__matmul__)
    if M.diagonal().all():  # it couples row i and column i: half of the graph will do
        parts, part = connected_components(entries, directed=False)
        return Units(*found, part, part, parts)
    indptr = np.concatenate((M.indptr, np.full(n, M.nnz, dtype=M.indptr.dtype)))
    graph = csr_array((entries.data, M.indices + n, indptr), shape=(2 * n, 2 * n))
    parts, part = connected_components(graph, directed=False)
    return Units(*found, part[:n], part[n:], parts)


def _exponents(values: Vector) -> Indices:
    """Return e with 2^(e - 1) <= |a| < 2^e, read from the bits of the doubles; e of 0 and of subnormal numbers is
    -1022."""
    exponents = values.view(np.int64) >> 52
    exponents &= EXPONENT
    exponents -= BIAS
    return exponents


def _exponent_sums(M: Vector) -> Vector:
    """Return the sums of the exponents in rows and in columns, shape (2, n), by blocks of rows that stay in the
    cache."""
    rows, columns = np.zeros((2, M.shape[0]))
    for part in row_parts(M):
        exponents = _exponents(np.ascontiguousarray(M[part]))
        rows[part] = exponents.sum(axis=1)
        columns += exponents.sum(axis=0)
    return np.array([rows, columns])


def mean_exponents(rows: Vector) -> Vector:
    """Return the means of the exponents of rows of a matrix: if it has no entry 0, their differences are those of
    `Units.rows` with the opposite sign, but for SETTLED_ERROR."""
    return np.asarray(_exponents(np.ascontiguousarray(rows)).mean(axis=1))


def _both_sums(values: Matrix) -> Vector:
    return np.array([values.sum(axis=1), values.sum(axis=0)], dtype=np.float64)


def _least_squares(
    sums: Vector, counts: Vector, times: Callable[[Vector], Vector], transposed: Callable[[Vector], Vector]
) -> tuple[Vector, Vector]:
    """Return rho and gamma, each of shape (n,), with the least sum of (e_ij + rho_i + gamma_j)^2: by conjugate
    gradients on the normal equations, preconditioned by their diagonal.

    sums, counts : of the exponents, and the numbers of entries, in rows and in columns, shape (2, n). times,
    transposed : products with the matrix that has ones for the entries, and with its transpose.
    """
    counts = np.maximum(counts, 1.0)
    x = np.zeros(counts.shape)
    residual = -sums
    step = residual / counts
    direction, size = step, float((residual * step).sum())
    for _ in range(MOST_CG_STEPS):
        if not np.abs(step).max(initial=0.0) > SETTLED_ERROR:
            break
        image = counts * direction
        image[0] += times(direction[1])
        image[1] += transposed(direction[0])
        length = size / float((direction * image).sum())
        x += length * direction
        residual -= length * image
        step = residual / counts
        before, size = size, float((residual * step).sum())
        direction = step + size / before * direction
    return x[0], x[1]


def _components(used: Mask) -> tuple[Indices, Indices, int]:
    """Return the components of the rows and of the columns that have entries, and their number, by breadth-first
    search."""
    n, count = used.shape[0], 0
    rows, columns = np.full((2, n), -1, dtype=np.intp)
    for i in range(n):
        if rows[i] >= 0:
            continue
        front: Indices = np.array([i])
        while front.size:
            rows[front] = count
            reached = (used[front].any(axis=0) & (columns < 0)).nonzero()[0]
            columns[reached] = count
            front = (used[:, reached].any(axis=1) & (rows < 0)).nonzero()[0]
        count += 1
    alone = (columns < 0).nonzero()[0]
    columns[alone] = np.arange(count, count + alone.size)
    return rows, columns, count + alone.size


def equilibrate(M: Matrix, q: Vector, rows: Vector | None = None) -> tuple[Vector, Vector]:
    """Return diagonals R, C of shape (n,) for which the rows and columns of R |M| C have largest entries near 1.

    Rows and columns are divided simultaneously by the square roots of their largest entries (D. Ruiz, A scaling
    algorithm to equilibrate both rows and columns norms in matrices, RAL-TR-2001-034), repeatedly until every largest
    entry lies between 1/2 and 2, at most MOST_SWEEPS times. The divisors are powers of two, so that scaling is exact,
    and stay finite. A symmetric M stays symmetric: R = C. A zero row is scaled until its entry of q is as large as the
    largest other one; a zero column, which has no scale, is left unscaled. Uncoupled blocks of M keep their common
    units. No exponent ends more than EXPONENT_MARGIN outside the range of the exponents of the first sweep.

    rows : the largest |entry| of each row of M, if they are known: M need then not be read if its diagonal is nearly as
        large.
    """
    rows, diagonal = matrices.row_maxima(M) if rows is None else rows, np.abs(M.diagonal())
    power = _power_of_all(float(diagonal.min()), float(rows.max())) if q.size else 0
    if power is not None:
        common = np.full(q.size, 2.0**power)
        return common, common
    columns = matrices.column_maxima(M)
    logarithms = np.log2(diagonal, where=diagonal > 0, out=np.full(q.size, -np.inf))
    low, high = -LARGEST_POWER, LARGEST_POWER
    row_power, column_power = np.zeros(q.size), np.zeros(q.size)
    if _are_far_apart(rows) or _are_far_apart(columns):
        powers = units(M)
        row_power, column_power = np.clip(np.rint([powers.rows, powers.columns]), low, high)
        rows, columns = matrices.row_and_column_maxima(M, np.exp2(row_power), np.exp2(column_power))
    else:
        changes = np.concatenate([half_power(rows), half_power(columns)])
        if changes.max() - changes.min() <= NEAR_UNITS:
            low, high = -changes.max() - EXPONENT_MARGIN, -changes.min() + EXPONENT_MARGIN
    for _ in range(MOST_SWEEPS):
        row_change, column_change = half_power(rows), half_power(columns)
        if not row_change.any() and not column_change.any():
            break
        row_power = np.clip(row_power - row_change, low, high)
        column_power = np.clip(column_power - column_change, low, high)
        if (row_power + column_power + logarithms >= -1).all():
            break  # as no entry is now above 2, all largest ones lie between 1/2 and 2
        rows, columns = matrices.row_and_column_maxima(M, np.exp2(row_power), np.exp2(column_power))
    empty = (rows == 0) & (q != 0)
    if empty.any():
        sizes = row_power[~empty] + 2 * half_power(np.abs(q[~empty]))
        size = sizes[q[~empty] != 0].max(initial=-LARGEST_POWER)
        own = 2 * half_power(np.abs(q[empty]))
        row_power[empty] = np.clip((size if size > -LARGEST_POWER else 0.0) - own, -LARGEST_POWER, LARGEST_POWER)
    return np.exp2(row_power), np.exp2(column_power)


def _power_of_all(least: float, largest: float) -> int | None:
    """Return the power of two that scales all rows and columns, as their largest entries lie between the least |M_ii|
    and the largest |M_ij|; None if these two need different powers, or are far from 1."""
    if not (least > 1 / FAR_FROM_ONE and largest < FAR_FROM_ONE):
        return None
    first, last = -round(math.log2(largest) / 2), -round(math.log2(least) / 2)
    return first if first == last else None


def _are_far_apart(sizes: Vector) -> bool:
    """Return whether sizes differ by more than units in common use do."""
    used = sizes[sizes > 0]
    return bool(used.size and math.log2(used.max()) - math.log2(used.min()) > UNITS_FAR_APART)


def half_power(sizes: Vector) -> Vector:
    """Return half the binary logarithm of each size, rounded to an integer; 0 where the size is 0."""
    return np.asarray(np.rint(0.5 * np.log2(sizes, where=sizes > 0, out=np.zeros_like(sizes))))
