"""Vectors of double-double numbers, unevaluated sums of two double precision numbers
with about 32 decimal digits, and products of a sparse matrix with them.

Every floating-point operation here also yields its rounding error: for a sum, by D. E.
Knuth, The Art of Computer Programming 2, 3rd ed. (1997), section 4.2.2; for a product,
whose factors are split into halves as numpy has no fused multiply-add, by T. J. Dekker,
A floating-point technique for extending the available precision, Numerische Mathematik
18 (1971) 224-242. Sums of products are as accurate as in twice the precision: T. Ogita,
S. M. Rump and S. Oishi, Accurate sum and dot product, SIAM Journal on Scientific
Computing 26 (2005) 1955-1988.

A stiff M needs double-double numbers: if its condition number is k, rounding z alone to
double precision changes rows of M z by up to eps k times their size.
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
    """Return the rounded sum of a and b, and its rounding error (Knuth's TwoSum)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


class DoubleDouble:
    """A vector high + low of shape (n,), where |low_i| is at most half an ulp of
    high_i.

    Sums, and products with double precision numbers, have relative errors of about
    eps^2.
    """

    __slots__ = ("high", "low")
    # With None, numpy's arrays leave binary operations to this class.
    __array_ufunc__ = None

    def __init__(self, high: Vector, low: Vector) -> None:
        self.high, self.low = high, low

    @classmethod
    def of(cls, values: Vector) -> DoubleDouble:
        """Return double precision numbers as double-double numbers."""
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
    """M z + q for one sparse M of shape (n, n), as accurate as if computed in twice the
    precision and then rounded.

    The entries of M are stored by diagonals, or else as arrays of the k-th entries of
    all rows, so that a product takes a few dozen operations on vectors. If M has a few
    long rows, which would make these arrays mostly empty, each row is summed
    separately.
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
        """Yield the rows, the columns and the entries of each diagonal of M.

        owners, shifts : i and j - i of each entry M_ij; present : the distinct j - i.
        """
        n = self._M.shape[0]
        for shift in present.tolist():
            is_on_diagonal = shifts == shift
            values = np.zeros(n)
            values[owners[is_on_diagonal]] = self._M.data[is_on_diagonal]
            rows = slice(max(0, -shift), n - max(0, shift))
            yield rows, slice(rows.start + shift, rows.stop + shift), values[rows]

    def _by_entries(self, lengths: Indices) -> Iterator[tuple[Any, Any, Vector]]:
        """Yield the rows, the columns and the values of the k-th entries of all rows
        that have so many, for k = 0, 1, ..."""
        M = self._M
        for k in range(int(lengths.max(initial=0))):
            rows = (lengths > k).nonzero()[0]
            positions = M.indptr[rows] + k
            row_selection = slice(None) if rows.size == lengths.size else rows
            yield row_selection, M.indices[positions], M.data[positions]

    def __call__(self, z: DoubleDouble, q: Vector) -> Vector:
        """Return M z + q, shape (n,), with an error of about eps |M z + q| + eps^2 (|M|
        |z| + |q|).
        """
        w = product(self._M, z.low)
        if self._terms is None:
            w -= accurate_residual(self._M, z.high, -q)
            return w
        total, (first, second) = q.copy(), split(z.high)
        for rows, columns, entries, large, small in self._terms:
            a, b = first[columns], second[columns]
            term = entries * z.high[columns]
            # Dekker's error of the product; the halves of the entries are stored.
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
