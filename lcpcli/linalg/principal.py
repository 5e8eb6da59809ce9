"""Linear systems with M and its principal submatrices, dense and sparse, exploiting positive definiteness."""

from __future__ import annotations

import sys
from contextlib import suppress
from functools import cache, partial

import numpy as np

from lcpcli.linalg import factors, matrices
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.products import product
from lcpcli.linalg.threads import include_loaded
from lcpcli.typing import Indices, Matrix, Vector

LAPACK = "scipy.linalg.lapack"  # solves small systems in half the time of numpy, but importing it takes longer
UPDATED = 1 / 12  # of an index set: changes up to which an update costs clearly less than a factorization


def definite_solver(M: Matrix) -> Solve | None:
    """A solver of M x = b if M is symmetric positive definite to working precision, else None."""
    if not matrices.is_symmetric(M) or not M.diagonal().min() > 0:
        return None
    try:
        if not is_sparse(M):
            return _small_cholesky(M) if M.shape[0] <= factors.SMALL else _dense_factors().cholesky(M)
        lu = factors.sparse_lu(symmetric=True)(M)
    except SingularMatrix:
        return None
    return lu.solve if factors.positive_pivots(lu) else None


class PrincipalSolver:
    """Solves M_PP x = b for one set of indices P after another.

    Blocks of a symmetric M are assumed positive definite until one is found not to be: Cholesky for dense ones,
    diagonal pivots for sparse ones. The factors of a large or sparse block are kept for the same P, and those of a
    dense one are updated while P differs in few indices from that block's.
    """

    def __init__(self, M: Matrix) -> None:
        self._M = M
        self._small = not is_sparse(M) and M.shape[0] <= factors.SMALL
        self._dense = None if is_sparse(M) or (self._small and LAPACK not in sys.modules) else _dense_factors()
        self._definite = not self._small and bool(M.diagonal().min() > 0)
        if is_sparse(M):
            self._definite = self._definite and matrices.is_symmetric(M)
        self._kept: tuple[Indices, Solve] | None = None

    def solve(self, indices: Indices, b: Vector) -> Vector:
        """x with one step of iterative refinement, for b of shape (k,); SingularMatrix if there is none."""
        if indices.size == 0:
            return np.empty(0)
        solve = self.at(indices)
        with np.errstate(over="ignore", invalid="ignore"):
            x = solve(b)
            refined: Vector = x + solve(b - self._product(indices, x))
        if not np.isfinite(refined).all():
            raise SingularMatrix
        return refined

    def at(self, indices: Indices) -> Solve:
        """A solver of systems with M_PP, without refinement; it, or this, raises SingularMatrix if there is none."""
        if self._small:
            return self._factorized(indices)
        if self._kept is not None and np.array_equal(indices, self._kept[0]):
            return self._kept[1]
        if self._kept is not None and self._dense is not None:
            with suppress(SingularMatrix):
                if (solve := self._updated(indices, *self._kept)) is not None:
                    return solve
        solve = self._factorized(indices)
        self._kept = indices, solve
        return solve

    def block(self, indices: Indices) -> Matrix:
        """M_PP for the indices of P; small ones by columns, so that their rows can be exchanged."""
        if self._small:
            return self._M.T.take(indices, 0).take(indices, 1).T
        return self._M if indices.size == self._M.shape[0] else self._M[indices][:, indices]

    def factorized(self, block: Matrix, overwrite: bool = False) -> Solve:
        """A solver of systems with M_PP, without refinement; SingularMatrix if there is none."""
        if self._dense is None and not is_sparse(block):
            return partial(_solve, block)
        if self._definite and (is_sparse(block) or matrices.is_symmetric(block)):
            try:
                return self._dense.cholesky(block) if self._dense else factors.sparse_lu(symmetric=True)(block).solve
            except SingularMatrix:
                self._definite = False
        return self._dense.lu(block, overwrite) if self._dense else factors.sparse_lu(False)(block).solve

    def _factorized(self, indices: Indices) -> Solve:
        """The same for the indices of P; a copy of M_PP is not kept."""
        block = self.block(indices)
        return self.factorized(block, overwrite=block is not self._M)

    def _product(self, indices: Indices, x: Vector) -> Vector:
        """M_PP x."""
        if is_sparse(self._M):
            return product(self.block(indices), x)
        z = np.zeros(self._M.shape[0])
        z[indices] = x
        return product(self._M, z)[indices]

    def _updated(self, indices: Indices, kept: Indices, solve: Solve) -> Solve | None:
        """A solver for P from one for the set K that was factorized, by a Schur complement; None if they differ much.

        With K extended by the indices of P that it lacks, N, and one equation x_i = 0 with a multiplier for each index
        of K outside P, the rows in K are solved by the known factors.
        """
        n, M = self._M.shape[0], self._M
        before, now = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        before[kept], now[indices] = True, True
        added, dropped = indices[~before[indices]], np.flatnonzero(~now[kept])
        changes = added.size + dropped.size
        if changes > UPDATED * kept.size:
            return None
        if not changes:
            return solve
        columns = np.zeros((kept.size, changes), order="F")
        columns[:, : added.size] = M[np.ix_(kept, added)]
        columns[dropped, np.arange(added.size, changes)] = 1
        rows = M[np.ix_(added, kept)]
        inner = solve(columns)
        small = np.zeros((changes, changes))
        small[: added.size, : added.size] = M[np.ix_(added, added)]
        small[: added.size] -= product(rows, inner)
        small[added.size :] -= inner[dropped]
        invert = factors.invert(small)

        def updated(b: Vector) -> Vector:
            right = np.zeros(kept.size)
            right[now[kept]] = b[before[indices]]
            first = solve(right)
            outer = invert(np.concatenate([b[~before[indices]] - product(rows, first), -first[dropped]]))
            x = np.empty(indices.size)
            x[before[indices]] = (first - product(inner, outer))[now[kept]]
            x[~before[indices]] = outer[: added.size]
            return x

        return updated


class _DenseFactors:
    """LAPACK's factorizations of copies of dense matrices. Raises SingularMatrix."""

    def __init__(self) -> None:
        from scipy.linalg import get_lapack_funcs

        include_loaded()
        self._potrf, self._potrs, self._getrf, self._getrs = get_lapack_funcs(("potrf", "potrs", "getrf", "getrs"))

    def cholesky(self, A: Matrix) -> Solve:
        if A.shape[0] >= factors.LONG_CHOLESKY:
            return factors.interruptible_cholesky(A)
        factor, info = self._potrf(A.T, lower=True, clean=False)
        if info > 0:
            raise SingularMatrix
        return lambda b: self._potrs(factor, b, lower=True)[0]

    def lu(self, A: Matrix, overwrite: bool) -> Solve:
        by_columns = A.flags.f_contiguous
        factor, pivots, info = factors.dense_lu(self._getrf, A if by_columns else A.T, overwrite_a=overwrite)
        if info > 0:
            raise SingularMatrix
        return lambda b: self._getrs(factor, pivots, b, trans=not by_columns)[0]


@cache
def _dense_factors() -> _DenseFactors:
    return _DenseFactors()


def _solve(A: Matrix, b: Vector) -> Vector:
    try:
        return np.linalg.solve(A, b).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        raise SingularMatrix from None


def _small_cholesky(A: Matrix) -> Solve:
    """A solver of A x = b without scipy, after Cholesky's factorization has shown that A is positive definite."""
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        raise SingularMatrix from None
    return factors.invert(A)
