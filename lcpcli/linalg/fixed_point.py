"""Triangular factors of a band matrix in fixed-point arithmetic, by Python's integers.

For condition numbers of about 1e16, iterative refinement with factors in double
precision does not converge, so factors of higher precision are needed. For a narrow
band, products of integers of 200 bits, one after another, take no longer than numpy
needs for double-double numbers, as the columns of a band depend on each other: a matrix
with 20,000 rows of five entries takes 60 ms here, and took 90 ms by cyclic reduction in
double-double arithmetic, with half as many digits.

Elimination without row interchanges is stable if A + A' is positive definite (G. H.
Golub and C. F. Van Loan, Matrix Computations, 4th ed. (2013), section 4.3.3).
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.double_double import DoubleDouble
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.typing import Vector

# Binary digits after the point. Entries are scaled to about 1, so that a pivot of 1e-28
# still has 30 correct decimal digits.
BITS = 192
MANTISSA = 53  # binary digits of a double precision number
CHECKED_EVERY = 512  # rows between two checks of the time limit


def fixed(values: Vector) -> list[int]:
    """Return double precision numbers as integer multiples of 2^-BITS, rounded towards
    minus infinity.
    """
    mantissas, exponents = np.frexp(values)
    numbers = np.ldexp(mantissas, MANTISSA).astype(np.int64).tolist()
    shifts = (exponents.astype(np.int64) + (BITS - MANTISSA)).tolist()
    return [
        number << shift if shift >= 0 else number >> -shift
        for number, shift in zip(numbers, shifts, strict=True)
    ]


def doubled(numbers: list[int], exponent: int) -> DoubleDouble:
    """Return the integers times 2^exponent, rounded to double-double numbers. Raises
    SingularMatrix if one exceeds the largest double precision number, as in the
    solution of a system with a pivot close to 0.
    """
    try:
        highs = list(map(float, numbers))
    except OverflowError:
        raise SingularMatrix from None
    lows = [
        float(number - int(high)) for number, high in zip(numbers, highs, strict=True)
    ]
    return DoubleDouble(
        np.ldexp(np.array(highs), exponent), np.ldexp(np.array(lows), exponent)
    )


class FixedPointFactors:
    """The factors L U of a band matrix A + diag(added) of shape (n, n); for a symmetric
    A, those of L D L' with U = D L'.

    lower, upper : shape (width + 1, n), with lower[k, j] = A[j + k, j] and upper[k, j]
        = A[j, j + k], and zeros where that is outside A; upper is None if A is
        symmetric. Raises SingularMatrix if a pivot is 0.
    is_definite : whether all pivots are positive, as they are if A + A' is positive
        definite.
    """

    def __init__(
        self, lower: Vector, upper: Vector | None, added: Vector | None
    ) -> None:
        self.is_definite = True
        self._width, self._n = lower.shape[0] - 1, lower.shape[1]
        # Row j of U from its pivot on, which elimination computes from row j of A.
        self._rows = _by_rows(lower if upper is None else upper)
        # Column j of A below the diagonal, which elimination updates.
        self._columns = None if upper is None else _by_rows(lower[1:])
        self._multipliers = list[list[int]]()
        if added is not None:
            for row, number in zip(self._rows, fixed(added), strict=True):
                row[0] += number
        self._eliminate()

    def _eliminate(self) -> None:
        rows = self._rows
        columns = self._columns
        n = self._n
        for j, row in enumerate(rows):
            if not j % CHECKED_EVERY:
                raise_if_timed_out()
            pivot = row[0]
            if not pivot:
                raise SingularMatrix
            self.is_definite &= pivot > 0
            below = row[1:] if columns is None else columns[j]
            factors = [(entry << BITS) // pivot for entry in below[: n - 1 - j]]
            self._multipliers.append(factors)
            for a, factor in enumerate(factors, 1):
                if not factor:
                    continue
                # The entries of row j + a from its diagonal on, then those below the
                # diagonal in the columns j + 1, ..., j + a - 1.
                target = rows[j + a]
                for b in range(self._width + 1 - a):
                    target[b] -= factor * row[a + b] >> BITS
                if columns is None:
                    continue
                for b in range(1, a):
                    columns[j + b][a - b - 1] -= factor * row[b] >> BITS

    @property
    def largest(self) -> float:
        """Return the largest absolute value of an entry of U and L, infinite if it
        overflows.
        """
        numbers = [max(map(abs, row)) for row in self._rows + self._multipliers if row]
        try:
            return float(max(numbers, default=0) / (1 << BITS))
        except OverflowError:
            return math.inf

    def solve(self, b: Vector) -> DoubleDouble:
        """Return x with A x = b, for b of shape (n,)."""
        size = float(np.abs(b).max(initial=0.0))
        if not size:
            return DoubleDouble.of(np.zeros(self._n))
        exponent = int(np.frexp(size)[1])
        x = self.solve_fixed(fixed(np.ldexp(b, -exponent)))
        return doubled(x, exponent - BITS)

    def solve_fixed(self, b: list[int]) -> list[int]:
        """Return the solution x as `solve` does, for b and x in fixed-point numbers."""
        x = b.copy()
        for j, factors in enumerate(self._multipliers):
            value = x[j]
            for a, factor in enumerate(factors, j + 1):
                x[a] -= factor * value >> BITS
        raise_if_timed_out()
        for j in range(self._n - 1, -1, -1):
            row, total = self._rows[j], x[j] << BITS
            for a in range(1, min(self._width + 1, self._n - j)):
                total -= row[a] * x[j + a]
            x[j] = total // row[0]
        return x


def _by_rows(diagonals: Vector) -> list[list[int]]:
    """Return the columns of an array as lists of fixed-point numbers."""
    width, n = diagonals.shape
    numbers = fixed(np.ascontiguousarray(diagonals.T).ravel())
    row_ends = range(0, (n + 1) * width, width) if width else [0] * (n + 1)
    return [numbers[first:last] for first, last in pairwise(row_ends)]
