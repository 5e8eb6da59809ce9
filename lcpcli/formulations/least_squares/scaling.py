"""Least squares in units of its own: columns and right-hand sides are divided by powers
of two, so that these change no digit of an answer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.formulations.least_squares.active_set import Minimizer
from lcpcli.formulations.least_squares.fit import Data
from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Indices, Matrix, Vector


@dataclass(frozen=True)
class Scaled:
    """A problem in which the largest entries of b, and of each column of A, are between
    1/2 and 1, unless all are 0.

    data : it, with x divided by 2^(side - columns). rows : the powers of two by which
        the rows of E have been divided.
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
        """Return the coefficients in the units of the problem."""
        return np.ldexp(scaled, self.side - self.columns)

    def r(self, scaled: Vector) -> Vector:
        return np.ldexp(scaled, self.side)

    def y(self, scaled: Vector) -> Vector:
        return np.ldexp(scaled, self.side - self.rows)

    def minimizer(self, minimizer: Minimizer) -> Minimizer:
        """Return a minimizer of the problem in these units."""
        return Minimizer(
            np.ldexp(minimizer.x, self.columns - self.side),
            np.ldexp(minimizer.r, -self.side),
            np.ldexp(minimizer.y, self.rows - self.side),
            minimizer.states,
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
    """Return the matrix with its columns times powers of two."""
    if not is_sparse(A):
        return np.ldexp(A, powers)
    scaled = A.tocsr(copy=True)
    scaled.data = np.ldexp(scaled.data, powers[scaled.indices])
    return scaled


def _exponents(sizes: Vector) -> Indices:
    """Return the exponents of numbers in [1/2, 1) times powers of two; 0 for 0."""
    exponents: Indices = np.frexp(sizes)[1]
    return exponents
