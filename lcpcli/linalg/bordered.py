"""Systems with M + diag(d) for sparse M with a few dense rows or columns, which are split off.

With these last, M = [A B; C E], and x_2 solves the system of the Schur complement E - C A^-1 B, a small dense matrix.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.typing import Indices, Matrix, Vector

if TYPE_CHECKING:
    from lcpcli.linalg.shifted_systems import SparseSystems

DENSE, MOST = 10.0, 30  # times the root of n: the entries of a row that is dense; and so many are split off


def dense_places(M: Matrix) -> Indices:
    """The indices of dense rows and columns; none if they are too many."""
    n = M.shape[0]
    counts = np.maximum(np.diff(M.indptr), np.bincount(M.indices, minlength=n))
    places = np.flatnonzero(counts > DENSE * np.sqrt(n))
    return places if places.size <= MOST else places[:0]


class Bordered:
    """The border at some places; `inner` makes the systems of the rest."""

    def __init__(self, M: Matrix, places: Indices, inner: Callable[[Matrix], SparseSystems]) -> None:
        self._places, self._rest = places, np.setdiff1d(np.arange(M.shape[0]), places)
        rows, border = M[self._rest], M[places]
        self._inner = inner(rows[:, self._rest])
        self._B, self._C = matrices.dense(rows[:, places]), border[:, self._rest]
        self._E = matrices.dense(border[:, places])

    def factorize(self, d: Vector) -> None:
        self._inner.factorize(d[self._rest])
        self._W = np.column_stack([self._inner.solve(column) for column in self._B.T])
        schur = self._E + np.diag(d[self._places]) - self._C @ self._W
        try:
            self._inverse = np.linalg.inv(schur)
        except np.linalg.LinAlgError as error:
            raise SingularMatrix from error

    def solve(self, b: Vector) -> Vector:
        y = self._inner.solve(b[self._rest])
        x = np.empty_like(b)
        x[self._places] = self._inverse @ (b[self._places] - self._C @ y)
        x[self._rest] = y - self._W @ x[self._places]
        return x

    @property
    def library(self) -> str:
        return self._inner.library

    @property
    def nonzeros(self) -> int:
        """Those of the inner factors, the border and its inverse."""
        return int(self._inner.nonzeros + self._W.size + self._C.nnz + self._inverse.size)
