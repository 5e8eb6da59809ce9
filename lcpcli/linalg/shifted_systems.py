"""Systems with M + diag(d) for one d after another: the pattern is analysed once.

If signs S make S M symmetric, no pivoting is needed (see `signs`): LDL' by QDLDL, where it is installed and faster, or
SuperLU with diagonal pivots in an order for symmetric patterns, without dense rows and columns (see `bordered`). Dense
M has LU factors with partial pivoting.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from lcpcli import clock
from lcpcli.linalg import factors
from lcpcli.linalg.bordered import Bordered, dense_places
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.sparse_factors import LDL, SuperLU
from lcpcli.linalg.threads import include_loaded
from lcpcli.typing import Matrix, Vector

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
        dense = dense_places(M)
        return Bordered(M, dense, SuperLU) if dense.size else SuperLU(M)
    ldl = LDL(M, S)
    return _Faster(lambda: ldl, lambda: SuperLU(M, order=ldl.order))


class _Dense:
    def __init__(self, M: Matrix) -> None:
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
        began = clock.seconds()
        self._used.factorize(d)
        self._seconds = clock.seconds() - began
        self._count += 1

    def solve(self, b: Vector) -> Vector:
        return self._used.solve(b)

    @property
    def library(self) -> str:
        return self._used.library

    @property
    def nonzeros(self) -> int:
        return self._used.nonzeros


def _has_qdldl() -> bool:
    from importlib.util import find_spec

    return find_spec("qdldl") is not None
