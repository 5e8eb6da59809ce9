"""Linear systems with M and its principal submatrices, dense and sparse, exploiting positive definiteness."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import factors, matrices
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.products import product
from lcpcli.typing import Indices, Matrix, Vector


def definite_solver(M: Matrix) -> Solve | None:
    """A solver of M x = b if M is symmetric positive definite to working precision, else None."""
    if not matrices.is_symmetric(M) or not M.diagonal().min() > 0:
        return None
    try:
        if not is_sparse(M):
            return _small_cholesky(M) if M.shape[0] <= factors.SMALL else _DenseFactors().cholesky(M)
        lu = factors.sparse_lu(symmetric=True)(M)
    except SingularMatrix:
        return None
    return lu.solve if factors.positive_pivots(lu) else None


class PrincipalSolver:
    """Solves M_PP z_P = b for one set of indices P after another, each with one step of iterative refinement.

    Blocks of a symmetric M are assumed positive definite until one is found not to be: Cholesky for dense ones,
    diagonal pivots for sparse ones. All imports are done when the solver is created.
    """

    def __init__(self, M: Matrix) -> None:
        self._M = M
        self._definite = matrices.is_symmetric(M) and bool(M.diagonal().min() > 0)
        self._dense = None if is_sparse(M) or M.shape[0] <= factors.SMALL else _DenseFactors()

    def solve(self, indices: Indices, b: Vector) -> Vector:
        """z_P for the indices of P and b, both of shape (k,); SingularMatrix if there is none."""
        if indices.size == 0:
            return np.empty(0)
        block = self.block(indices)
        solve = self.factorized(block)
        with np.errstate(over="ignore", invalid="ignore"):
            x = solve(b)
            refined: Vector = x + solve(b - product(block, x))
        if not np.isfinite(refined).all():
            raise SingularMatrix
        return refined

    def block(self, indices: Indices) -> Matrix:
        """M_PP for the indices of P."""
        return self._M if indices.size == self._M.shape[0] else self._M[indices][:, indices]

    def factorized(self, block: Matrix) -> Solve:
        """A solver of systems with M_PP, without refinement; SingularMatrix if there is none."""
        if self._definite and (self._dense or is_sparse(block)):
            try:
                return self._dense.cholesky(block) if self._dense else factors.sparse_lu(symmetric=True)(block).solve
            except SingularMatrix:
                self._definite = False
        if self._dense:
            return self._dense.lu(block)
        return factors.sparse_lu(False)(block).solve if is_sparse(block) else factors.invert(block)


class _DenseFactors:
    """LAPACK's factorizations of copies of dense matrices. Raises SingularMatrix."""

    def __init__(self) -> None:
        from scipy.linalg import get_lapack_funcs

        self._potrf, self._potrs, self._getrf, self._getrs = get_lapack_funcs(("potrf", "potrs", "getrf", "getrs"))

    def cholesky(self, A: Matrix) -> Solve:
        factor, info = self._potrf(A.T, lower=True, clean=False)
        if info > 0:
            raise SingularMatrix
        return lambda b: self._potrs(factor, b, lower=True)[0]

    def lu(self, A: Matrix) -> Solve:
        factor, pivots, info = self._getrf(A.T)
        if info > 0:
            raise SingularMatrix
        return lambda b: self._getrs(factor, pivots, b, trans=1)[0]


def _small_cholesky(A: Matrix) -> Solve:
    """A solver of A x = b without scipy, after Cholesky's factorization has shown that A is positive definite."""
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        raise SingularMatrix from None
    return factors.invert(A)
