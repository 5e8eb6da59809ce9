"""Null spaces by a QR factorization with pivoting of columns: G. H. Golub, C. F. Van
Loan, Matrix Computations (4th ed. 2013), section 5.4.2."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.typing import Indices, Vector


class Pivoted:
    """The factor R of A, shape (m, n).

    order : the columns of A in the order of their pivots, shape (n,).
    pivots : sizes of the pivots, relative to the largest, as many as A has columns.
    """

    def __init__(self, A: Vector) -> None:
        with imports:
            from scipy.linalg import qr
        self.shape = A.shape
        self._R, self.order = A, np.arange(A.shape[1])
        if A.size:
            self._R, self.order = qr(A, mode="r", pivoting=True)
        diagonal = np.abs(self._R.diagonal())
        self.pivots = np.zeros(A.shape[1])
        if diagonal.any():
            self.pivots[: diagonal.size] = diagonal / diagonal[0]

    @cached_property
    def rank(self) -> int:
        """Return the rank up to rounding."""
        return int(np.count_nonzero(self.pivots > max(self.shape) * ROW_ROUNDING))

    @property
    def independent(self) -> Indices:
        """Return as many columns as the rank, which are independent."""
        return np.asarray(self.order[: self.rank])

    @property
    def null(self) -> Vector:
        """Return a basis of the null space of A, in columns."""
        with imports:
            from scipy.linalg import solve_triangular
        n, rank = self.shape[1], self.rank
        if not rank:
            return np.eye(n)
        basis = np.zeros((n, n - rank))
        R = self._R[:rank]
        basis[self.order[:rank]] = -solve_triangular(R[:, :rank], R[:, rank:])
        basis[self.order[rank:]] = np.eye(n - rank)
        return basis
