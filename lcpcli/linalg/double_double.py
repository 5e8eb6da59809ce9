"""Vectors of unevaluated sums of two doubles, with some 32 decimal digits, and products
of a sparse matrix with them.

Every operation of doubles here leaves its rounding error as another double: of a sum,
D. E. Knuth, The Art of Computer Programming 2, 3rd ed. (1997), section 4.2.2; of a
product, whose factors are split into halves, as numpy has no fused multiplication and
addition, T. J. Dekker, A floating-point technique for extending the available
precision, Numerische Mathematik 18 (1971) 224-242. Sums of products as if in twice the
precision: T. Ogita, S. M. Rump and S. Oishi, Accurate sum and dot product, SIAM Journal
on Scientific Computing 26 (2005) 1955-1988.

A stiff M needs this where doubles of z are too coarse for M z + q: with condition k,
rounding z alone changes rows of M z by eps k times their own size.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from lcpcli.linalg.matrices import (
    MAX_PADDED,
    accurate_residual,
    product,
    split,
    split_products,
)
from lcpcli.typing import Indices, Matrix, Vector


def two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """Return a + b as its rounded value and its rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


class DoubleDouble:
    """A vector high + low, where |low_i| is at most half a unit in the last place of
    high_i; shape (n,).

    Sums, and products with doubles, have relative errors of about eps^2.
    """

    __slots__ = ("high", "low")
    __array_ufunc__ = None  # arrays and numbers of numpy leave operations to this class

    def __init__(self, high: Vector, low: Vector) -> None:
        self.high, self.low = high, low

    @classmethod
    def of(cls, values: Vector) -> DoubleDouble:
        return cls(values, np.zeros_like(values))

    def __add__(self, other: DoubleDouble | Vector) -> DoubleDouble:
        added = other.high if isinstance(other, DoubleDouble) else other
        high, error = two_sum(self.high, added)
        error += self.low
        if isinstance(other, DoubleDouble):
            error += other.low
        total = high + error
        return DoubleDouble(total, error - (total - high))

    def __sub__(self, other: DoubleDouble | Vector) -> DoubleDouble:
        return self + -other

    def __neg__(self) -> DoubleDouble:
        return DoubleDouble(-self.high, -self.low)

    def __mul__(self, other: DoubleDouble | Vector | float) -> DoubleDouble:
        factor = other.high if isinstance(other, DoubleDouble) else np.asarray(other)
        high, error = split_products(factor, self.high)
        error -= factor * self.low
        if isinstance(other, DoubleDouble):
            error -= other.low * self.high
        total = high + error
        return DoubleDouble(-total, -(error - (total - high)))

    __rmul__ = __mul__

    def __getitem__(self, indices: Any) -> DoubleDouble:
        return DoubleDouble(self.high[indices], self.low[indices])

    def copy(self) -> DoubleDouble:
        return DoubleDouble(self.high.copy(), self.low.copy())


class AccurateProduct:
    """M z + q for one sparse M of shape (n, n), as if in twice the precision.

    Its entries are kept by diagonals, or else as the k-th ones of all rows, so that a
    product takes a few dozen operations on vectors; of an M with a few long rows each
    row is added up by itself.
    """

    def __init__(self, M: Matrix) -> None:
        self._M = M
        n, lengths = M.shape[0], np.diff(M.indptr)
        owners = np.repeat(np.arange(n), lengths)
        shifts = M.indices - owners
        present = np.bincount(shifts + n, minlength=2 * n).nonzero()[0] - n
        longest = int(lengths.max(initial=0))
        self._terms: list[tuple[Any, Any, Vector, Vector, Vector]] | None = None
        if present.size * n <= MAX_PADDED * M.nnz:
            terms = self._by_diagonals(owners, shifts, present)
        elif longest * n <= MAX_PADDED * M.nnz:
            terms = self._by_entries(lengths)
        else:
            return
        self._terms = [
            (*rows_and_columns, v, *split(v)) for *rows_and_columns, v in terms
        ]

    def _by_diagonals(
        self, owners: Indices, shifts: Indices, present: Indices
    ) -> Iterator[tuple[Any, Any, Vector]]:
        n = self._M.shape[0]
        for shift in present.tolist():
            is_on_diagonal = shifts == shift
            values = np.zeros(n)
            values[owners[is_on_diagonal]] = self._M.data[is_on_diagonal]
            rows = slice(max(0, -shift), n - max(0, shift))
            yield rows, slice(rows.start + shift, rows.stop + shift), values[rows]

    def _by_entries(self, lengths: Indices) -> Iterator[tuple[Any, Any, Vector]]:
        M = self._M
        for k in range(int(lengths.max(initial=0))):
            rows = (lengths > k).nonzero()[0]
            positions = M.indptr[rows] + k
            row_selection = slice(None) if rows.size == lengths.size else rows
            yield row_selection, M.indices[positions], M.data[positions]

    def __call__(self, z: DoubleDouble, q: Vector) -> Vector:
        """Return M z + q, shape (n,), with an error of about eps of itself and eps^2
        of its terms."""
        w = product(self._M, z.low)
        if self._terms is None:
            w -= accurate_residual(self._M, z.high, -q)
            return w
        total, (first, second) = q.copy(), split(z.high)
        for rows, columns, entries, large, small in self._terms:
            a, b = first[columns], second[columns]
            term = entries * z.high[columns]
            # Dekker's error of the product, with the halves of the entries at hand
            error = large * a
            error -= term
            error += small * a
            error += large * b
            error += small * b
            total[rows], of_sum = two_sum(total[rows], term)
            error += of_sum
            w[rows] += error
        w += total
        return w
