"""Systems with principal submatrices of a tridiagonal matrix, as of problems in one dimension, in time of order n.

A principal submatrix is tridiagonal too: entries beside the diagonal remain where neighbours do. LAPACK's gttrf
factorizes it with row exchanges.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import width
from lcpcli.typing import Indices, Matrix, Vector

FEWEST_ROWS = 3  # that scipy's gttrs takes


class Tridiagonal:
    """A tridiagonal matrix, by its diagonals."""

    def __init__(self, M: Matrix) -> None:
        with imports:
            from scipy.linalg import get_lapack_funcs
        self._below, self._diagonal, self._above = (M.diagonal(k) for k in (-1, 0, 1))
        self._factorize, self._solve = get_lapack_funcs(("gttrf", "gttrs"))

    def at(self, indices: Indices) -> Callable[[Vector], Vector]:
        """Return a solver of systems with M_PP; raise LinAlgError if M_PP is singular."""
        first, beside = indices[:-1], np.diff(indices) == 1
        below, above = (side[first] * beside for side in (self._below, self._above))
        if indices.size < FEWEST_ROWS:
            return partial(np.linalg.solve, np.diag(self._diagonal[indices]) + np.diag(below, -1) + np.diag(above, 1))
        *factors, info = self._factorize(below, self._diagonal[indices], above)
        if info > 0:
            raise np.linalg.LinAlgError

        def solve(b: Vector) -> Vector:
            return np.asarray(self._solve(*factors, b)[0])

        return solve


def tridiagonal(M: Matrix) -> Tridiagonal | None:
    """Return a sparse matrix with at least two rows as a tridiagonal one, if it is that; else None."""
    n = M.shape[0]
    return Tridiagonal(M) if n >= 2 and M.nnz <= 3 * n and width(M) <= 1 else None
