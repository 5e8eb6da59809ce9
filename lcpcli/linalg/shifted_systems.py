"""Systems with M + diag(d) for one d after another: the pattern is analysed once.

If signs S make S M symmetric, no pivoting is needed (see `signs`): LDL' by QDLDL, where it is installed and faster, or
SuperLU with diagonal pivots in an order for symmetric patterns. Dense M has LU factors with partial pivoting.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import interruptibly
from lcpcli.linalg import factors
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.threads import include_loaded
from lcpcli.typing import Indices, Matrix, Vector

PATIENCE = 0.02  # seconds of a factorization from which it is worth trying another library for the next
DECIDED = 3  # factorizations that tell which library is faster: two by QDLDL, one by SuperLU in its order


class Systems(Protocol):
    """Systems with M + diag(d) of one M."""

    def factorize(self, d: Vector) -> None:
        """Factorize M + diag(d); SingularMatrix if that fails."""

    def solve(self, b: Vector) -> Vector:
        """(M + diag(d))^-1 b for the last d."""


class SparseSystems(Systems, Protocol):
    """Those of sparse M."""

    @property
    def library(self) -> str:
        """The one that the last factors are by."""

    @property
    def nonzeros(self) -> int:
        """Those of the last factors, without a unit diagonal."""


def systems(M: Matrix, S: Vector | None) -> Systems:
    """Those of M, dense or in compressed sparse rows, with signs S if there are any."""
    return sparse_systems(M, S) if is_sparse(M) else _Dense(M)


def sparse_systems(M: Matrix, S: Vector | None) -> SparseSystems:
    """Those of M in compressed sparse rows, with signs S if there are any."""
    if S is None or not _has_qdldl():
        return SuperLU(M)
    ldl = _LDL(M, S)
    return _Faster(lambda: ldl, lambda: SuperLU(M, order=ldl.order))


class _Dense:
    def __init__(self, M: Matrix) -> None:
        with imports:
            from scipy.linalg import get_lapack_funcs

        include_loaded()
        self._M = M
        self._getrf, self._getrs = get_lapack_funcs(("getrf", "getrs"), (M,))

    def factorize(self, d: Vector) -> None:
        A = self._M.copy(order="F")
        A.reshape(-1, order="F")[:: A.shape[0] + 1] += d
        self._lu, self._pivots, info = factors.dense_lu(self._getrf, A, overwrite_a=True)
        if info:
            raise SingularMatrix

    def solve(self, b: Vector) -> Vector:
        x: Vector = self._getrs(self._lu, self._pivots, b)[0]
        return x


class SuperLU:
    """scipy's; with diagonal pivots in an order that is given or found once, or with partial pivoting.

    Its own search for an order may take longer than all factorizations.
    """

    library = "SuperLU"

    def __init__(self, M: Matrix, pivoting: bool = False, order: Indices | None = None) -> None:
        with imports:
            from scipy.sparse.linalg import splu

        include_loaded()
        self._splu, self._columns, self._places = splu, *_columns(*_entries(M), M.shape[0])
        self._diagonal = M.diagonal()
        self._order: Indices | None = None
        self._inverse: Indices | None = None
        self._how: dict[str, Any] = {"permc_spec": "COLAMD"}
        if not pivoting:
            options = {"SymmetricMode": True, "Equil": False}
            self._how = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": options}
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


class _LDL:
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


class _Faster:
    """The first of several that factorizes again within PATIENCE, or the quickest.

    The time of the second factorization counts, as the first one includes the analysis of the pattern.
    """

    def __init__(self, *candidates: Callable[[], SparseSystems]) -> None:
        self._used, self._untried = candidates[0](), list(candidates[1:])
        self._tried: list[tuple[float, SparseSystems]] = []
        self._count, self._seconds = 0, 0.0

    def factorize(self, d: Vector) -> None:
        if self._count == 2:
            self._tried.append((self._seconds, self._used))
            if self._seconds > PATIENCE and self._untried:
                self._used, self._count = self._untried.pop(0)(), 0
            else:
                self._used = min(self._tried, key=lambda each: each[0])[1]
        began = time.perf_counter()
        self._used.factorize(d)
        self._seconds = time.perf_counter() - began
        self._count += 1

    def solve(self, b: Vector) -> Vector:
        return self._used.solve(b)

    @property
    def library(self) -> str:
        return self._used.library

    @property
    def nonzeros(self) -> int:
        return self._used.nonzeros


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


def _has_qdldl() -> bool:
    from importlib.util import find_spec

    return find_spec("qdldl") is not None
