"""Orthogonal factors of the columns of the free coefficients, which the active-set
method changes by one column at a time.

Without equations the factors Q and R are updated: a column that is added is made
orthogonal to those before it twice, and one is removed by rotations: J. W. Daniel, W.
B. Gragg, L. Kaufman, G. W. Stewart, Reorthogonalization and stable algorithms for
updating the Gram-Schmidt QR factorization, Math. Comp. 30 (1976) 772-795. With
equations, of which there are few, the factors are computed again.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from lcpcli.clock import imports
from lcpcli.formulations.least_squares.factors import (
    DEPENDENT,
    Factors,
    Step,
    lapack,
)
from lcpcli.formulations.least_squares.fit import Data
from lcpcli.typing import Indices, Vector


class FreeColumns(Protocol):
    """The columns of the free coefficients.

    indices : the free coefficients, in the order of the columns.
    """

    indices: Indices

    def step(self, x: Vector, r: Vector) -> Step:
        """Return the step from x, with the residuals r, to the minimizer over the free
        coefficients.
        """

    def add(self, j: int, x: Vector, r: Vector, slope: float) -> bool:
        """Add the column of coefficient j, if it is independent of the others and the
        step from x then moves the coefficient in the direction of `slope`, in which |A
        x - b| decreases. Return whether it was added.
        """

    def remove(self, positions: Indices) -> None:
        """Remove the columns at these positions, in ascending order."""


def free_columns(data: Data, free: Indices) -> FreeColumns:
    """Return the columns of these coefficients, which must be independent."""
    if data.d.size:
        return Recomputed(data, free)
    return Updated(data, free)


class Recomputed:
    """Columns whose factors are computed again for each set of free coefficients."""

    def __init__(self, data: Data, free: Indices) -> None:
        self.data = data
        self._set(free, self._factors(free))

    def _factors(self, indices: Indices) -> Factors:
        return Factors(self.data.A[:, indices], self.data.E[:, indices])

    def _set(self, indices: Indices, factors: Factors) -> None:
        self.indices, self.factors = indices, factors

    def step(self, x: Vector, r: Vector) -> Step:
        e = self.data.d - self.data.E @ x
        return self.factors.step(r, np.zeros(self.indices.size), e)

    def add(self, j: int, x: Vector, r: Vector, slope: float) -> bool:
        before = self.indices, self.factors
        indices = np.append(self.indices, j)
        self._set(indices, self._factors(indices))
        if self.factors.is_regular and self.step(x, r).dx[-1] * slope > 0:
            return True
        self._set(*before)
        return False

    def remove(self, positions: Indices) -> None:
        indices = np.delete(self.indices, positions)
        self._set(indices, self._factors(indices))


class Updated:
    """Columns with updated factors. Q and R have space for as many columns as can be
    independent; the unused ones are those of 0 and of the identity.
    """

    def __init__(self, data: Data, free: Indices) -> None:
        m, n = data.A.shape
        size = min(m, n)
        self.A = np.asfortranarray(data.A)
        self.indices = free
        self.Q = np.zeros((m, size), order="F")
        self.R = np.eye(size, order="F")
        if free.size:
            self._set(*np.linalg.qr(self.A[:, free]))

    def _set(self, Q: Vector, R: Vector) -> None:
        p = R.shape[1]
        self.Q[:, :p], self.R[:p, :p] = Q[:, :p], R[:p]

    def step(self, x: Vector, r: Vector) -> Step:  # noqa: ARG002
        if not self.indices.size:  # LAPACK refuses matrices of order 0
            return Step(np.zeros(0), r, np.zeros(0))
        turned = self.Q.T @ r
        dx = lapack().dtrtrs(self.R, turned)[0][: self.indices.size]
        return Step(dx, r - self.Q @ turned, np.zeros(0))

    def add(self, j: int, x: Vector, r: Vector, slope: float) -> bool:  # noqa: ARG002
        column, p = self.A[:, j], self.indices.size
        if p == self.R.shape[0]:
            return False
        of_Q = self.Q.T @ column
        rest = column - self.Q @ of_Q
        correction = self.Q.T @ rest
        rest -= self.Q @ correction
        of_Q += correction
        pivot = float(np.sqrt(rest @ rest))
        norm = float(np.sqrt(column @ column))
        if not pivot > DEPENDENT * np.sqrt(len(column) + p + 1) * norm:
            return False
        rest /= pivot
        if not (rest @ r) * slope > 0:
            return False
        self.Q[:, p] = rest
        self.R[:, p] = of_Q
        self.R[p, p] = pivot
        self.indices = np.append(self.indices, j)
        return True

    def remove(self, positions: Indices) -> None:
        with imports:
            from scipy.linalg import qr_delete
        for position in positions[::-1].tolist():
            p = self.indices.size
            Q, R = self.Q[:, :p], self.R[:p, :p]
            # Lists of numbers that are not finite are not searched for here.
            reduced = qr_delete(Q, R, position, which="col", check_finite=False)
            self.indices = np.delete(self.indices, position)
            self.Q[:, p - 1] = 0.0
            self.R[:, p - 1] = 0.0
            self.R[p - 1, p - 1] = 1.0
            self._set(*reduced)
