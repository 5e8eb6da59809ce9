"""Scaling of least-squares problems: columns of A, rows of E and right-hand sides are
divided by powers of two, which changes no digit of a result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.formulations.least_squares.active_set import Minimizer
from lcpcli.formulations.least_squares.fit import Data
from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Indices, Matrix, Vector


@dataclass(frozen=True)
class Scaled:
    """A problem in which the largest entry of b, and the largest one of each column of
    A, are between 1/2 and 1, unless they are 0.

    data : the scaled problem. Its coefficients are those of the problem, divided by
        2^(side - columns).
    columns, side : the exponents by which the columns of A and b have been divided.
    rows : the exponents by which the rows of E have been divided after that.
    """

    data: Data
    columns: Indices
    rows: Indices
    side: int

    @classmethod
    def of(cls, data: Data) -> Scaled:
        columns = _exponents(_maxima(data.A, 0))
        side = int(_exponents(np.abs(data.b).max(initial=0.0)[np.newaxis])[0])
        E = times_powers(data.E, -columns)
        rows = _exponents(_maxima(E, 1))
        scaled = Data(
            times_powers(data.A, -columns),
            np.ldexp(data.b, -side),
            np.ldexp(data.lower, columns - side),
            np.ldexp(data.upper, columns - side),
            times_powers(E.T, -rows).T,
            np.ldexp(data.d, -side - rows),
        )
        return cls(scaled, columns, rows, side)

    def x(self, scaled: Vector) -> Vector:
        """Return the coefficients of the problem for those of the scaled problem."""
        return np.ldexp(scaled, self.side - self.columns)

    def r(self, scaled: Vector) -> Vector:
        return np.ldexp(scaled, self.side)

    def y(self, scaled: Vector) -> Vector:
        return np.ldexp(scaled, self.side - self.rows)

    def minimizer(self, minimizer: Minimizer) -> Minimizer:
        """Return the minimizer of the scaled problem for one of the problem."""
        return Minimizer(
            np.ldexp(minimizer.x, self.columns - self.side),
            np.ldexp(minimizer.r, -self.side),
            np.ldexp(minimizer.y, self.rows - self.side),
            minimizer.statuses,
            minimizer.steps,
        )


def _maxima(A: Matrix, axis: int) -> Vector:
    if is_sparse(A):
        sizes = abs(A)
        shape = sizes.shape[1 - axis]
        largest = sizes.max(axis=axis).toarray() if sizes.size else np.zeros(shape)
        return np.asarray(largest).ravel()
    return np.asarray(np.abs(A).max(axis=axis, initial=0.0))


def times_powers(A: Matrix, powers: Indices) -> Matrix:
    """Return the matrix with each column multiplied by 2 to the power for it."""
    if not is_sparse(A):
        return np.ldexp(A, powers)
    scaled = A.tocsr(copy=True)
    scaled.data = np.ldexp(scaled.data, powers[scaled.indices])
    return scaled


def _exponents(sizes: Vector) -> Indices:
    """Return for each number the exponent e for which it is f times 2^e with f in [1/2,
    1); 0 for the number 0.
    """
    exponents: Indices = np.frexp(sizes)[1]
    return exponents
