"""Least squares in units of its own: columns and right-hand sides are divided by powers
of two, so that these change no digit of an answer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.formulations.least_squares.active_set import Minimizer
from lcpcli.formulations.least_squares.fit import Data
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
        E = np.ldexp(data.E, -columns)
        rows = _exponents(_maxima(E, 1))
        scaled = Data(
            np.ldexp(data.A, -columns),
            np.ldexp(data.b, -side),
            np.ldexp(data.lower, columns - side),
            np.ldexp(data.upper, columns - side),
            np.ldexp(E.T, -rows).T,
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

    def minimizer(self, found: Minimizer) -> Minimizer:
        """Return a minimizer of the problem in these units."""
        return Minimizer(
            np.ldexp(found.x, self.columns - self.side),
            np.ldexp(found.r, -self.side),
            np.ldexp(found.y, self.rows - self.side),
            found.states,
            found.steps,
        )


def _maxima(A: Matrix, axis: int) -> Vector:
    return np.asarray(np.abs(A).max(axis=axis, initial=0.0))


def _exponents(sizes: Vector) -> Indices:
    """Return the exponents of numbers in [1/2, 1) times powers of two; 0 for 0."""
    exponents: Indices = np.frexp(sizes)[1]
    return exponents
