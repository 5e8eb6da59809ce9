"""Factors of M + diag(d) for sparse M and one d after another, by scipy's SuperLU and by QDLDL."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.interrupts import interruptibly
from lcpcli.linalg import factors
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.fill import order_of
from lcpcli.linalg.threads import include_loaded
from lcpcli.typing import Indices, Matrix, Vector


class SuperLU:
    """scipy's; with diagonal pivots in an order that is given or found once, or with partial pivoting.

    Its own search for an order may take longer than all factorizations.
    """

    library = "SuperLU"

    def __init__(self, M: Matrix, pivoting: bool = False, order: Indices | None = None) -> None:
        from scipy.sparse.linalg import splu

        include_loaded()
        self._splu, self._columns, self._places = splu, *_columns(*_entries(M), M.shape[0])
        self._diagonal = M.diagonal()
        self._order: Indices | None = None
        self._inverse: Indices | None = None
        self._how: dict[str, Any] = {"permc_spec": "COLAMD"}
        if not pivoting:
            options = {"SymmetricMode": True, "Equil": False}
            found = "NATURAL" if order is not None else order_of(M)
            self._how = {"permc_spec": found, "diag_pivot_thresh": 0.0, "options": options}
        if order is not None:
            self._keep_order(order)

    def factorize(self, d: Vector) -> None:
        diagonal = self._diagonal + d
        self._columns.data[self._places] = diagonal if self._inverse is None else diagonal[self._inverse]
        large = self._columns.nnz > factors.QUICK
        try:
            self._lu = interruptibly(self._factors) if large else self._factors()
        except RuntimeError as error:
            raise SingularMatrix from error
        self._solving = self._order
        if self._order is None and "options" in self._how:
            self._keep_order(self._lu.perm_c)

    @property
    def nonzeros(self) -> int:
        return int(self._lu.L.nnz + self._lu.U.nnz - self._diagonal.size)

    def _factors(self) -> Any:
        return self._splu(self._columns, **self._how)

    def _keep_order(self, order: Indices) -> None:
        """Permute rows and columns to these places, so that the next factorizations need not look for an order."""
        coo = self._columns.tocoo()
        self._columns, self._places = _columns(coo.data, order[coo.row], order[coo.col], order.size)
        self._order, self._inverse = order, np.argsort(order)
        self._how["permc_spec"] = "NATURAL"

    def solve(self, b: Vector) -> Vector:
        if self._solving is None:
            plain: Vector = self._lu.solve(b)
            return plain
        permuted = np.empty_like(b)
        permuted[self._solving] = b
        x: Vector = self._lu.solve(permuted)[self._solving]
        return x


class LDL:
    """QDLDL's, of S (M + diag(d))."""

    library = "QDLDL"

    def __init__(self, M: Matrix, S: Vector) -> None:
        from scipy.sparse import csc_matrix

        values, rows, columns = _entries(M)
        upper = rows <= columns
        held, self._places = _columns((S[rows] * values)[upper], rows[upper], columns[upper], S.size)
        self._upper = csc_matrix(held)
        self._S, self._diagonal = S, M.diagonal()
        self._solver: Any = None

    def factorize(self, d: Vector) -> None:
        self._upper.data[self._places] = self._S * (self._diagonal + d)
        try:
            if self._upper.nnz > factors.QUICK:
                interruptibly(self._factors)
            else:
                self._factors()
        except RuntimeError as error:
            raise SingularMatrix from error

    @property
    def order(self) -> Indices:
        """The place of each row and column among the pivots."""
        pivots: Indices = self._solver.factors()[2]
        return np.argsort(pivots)

    @property
    def nonzeros(self) -> int:
        L, D, _ = self._solver.factors()
        return int(L.nnz + D.size)

    def _factors(self) -> None:
        import qdldl

        if self._solver is None:
            self._solver = qdldl.Solver(self._upper, upper=True)
        else:
            self._solver.update(self._upper, upper=True)

    def solve(self, b: Vector) -> Vector:
        x: Vector = self._solver.solve(self._S * b)
        return x


def _entries(M: Matrix) -> tuple[Vector, Indices, Indices]:
    """Values, rows and columns of the entries of M, with all of the diagonal, which is last."""
    coo, every = M.tocoo(), np.arange(M.shape[0])
    off = coo.row != coo.col
    values = np.concatenate((coo.data[off], M.diagonal()))
    return values, np.concatenate((coo.row[off], every)), np.concatenate((coo.col[off], every))


def _columns(values: Vector, rows: Indices, columns: Indices, n: int) -> tuple[Any, Indices]:
    """The matrix of these entries in compressed sparse columns, and where those of the diagonal are."""
    from scipy.sparse import csc_array

    matrix = csc_array((values, (rows, columns)), shape=(n, n))
    matrix.sort_indices()
    owners = np.repeat(np.arange(n), np.diff(matrix.indptr))
    return matrix, np.flatnonzero(matrix.indices == owners)
