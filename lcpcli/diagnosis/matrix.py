"""Facts about M that determine difficulty and cost: scaling, condition, spectrum, factorization."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import factors, krylov, matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import Band, affordable
from lcpcli.linalg.units import equilibrate
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

EIGEN = 500  # n up to which all eigenvalues are computed


@dataclass(frozen=True)
class Spread:
    """The range in decades of the largest entries of nonzero rows, and of nonzero columns."""

    rows: float
    columns: float

    @property
    def largest(self) -> float:
        """The larger of the two."""
        return max(self.rows, self.columns)


@dataclass(frozen=True)
class Spectrum:
    """The smallest and the largest eigenvalue of a symmetric M, in units of M.

    estimated : by a few steps of inverse and of power iteration, each accurate to a factor of about 3.
    """

    smallest: float
    largest: float
    estimated: bool


@dataclass(frozen=True)
class Cost:
    """The storage of M in bytes, and the cost of its triangular factors in entries and operations.

    bandwidth : of a sparse M after reordering; its factors lie within the band. None if dense.
    """

    bytes: int
    bandwidth: int | None
    factor_entries: int
    factor_operations: int


def nonzeros(M: Matrix) -> int:
    """The number of nonzero entries of M."""
    return int(np.count_nonzero(M.data if is_sparse(M) else M))


def spreads(problem: Problem) -> tuple[Spread, Spread, Matrix]:
    """The spread of M, that of M equilibrated, and the equilibrated M itself."""
    ones = np.ones(problem.n)
    R, C = equilibrate(problem.M, problem.q)
    return _spread(problem.M, ones, ones), _spread(problem.M, R, C), matrices.scaled(problem.M, R, C)


def _spread(M: Matrix, R: Vector, C: Vector) -> Spread:
    return Spread(*map(_decades, matrices.row_and_column_maxima(M, R, C)))


def _decades(sizes: Vector) -> float:
    used = sizes[sizes > 0]
    return float(np.log10(used.max()) - np.log10(used.min())) if used.size else 0.0


def condition(M: Matrix) -> float:
    """|M|_1 |M^-1|_1 of an affordable M; estimated from below for n above factors.SMALL. Infinite if M is singular."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            if is_sparse(M):
                value = _sparse_condition(M)
            elif M.shape[0] <= factors.SMALL:
                value = float(np.linalg.cond(M, 1))
            else:
                value = _dense_condition(M)
        except (factors.SingularMatrix, np.linalg.LinAlgError):
            return math.inf
    return value if value >= 1 else math.inf


def _dense_condition(M: Matrix) -> float:
    from scipy.linalg import get_lapack_funcs

    getrf, gecon = get_lapack_funcs(("getrf", "gecon"), (M,))
    lu, _, info = getrf(M)
    if info > 0:
        return math.inf
    reciprocal, _ = gecon(lu, float(matrices.norm_inf(M.T)), norm="1")
    return 1 / float(reciprocal) if reciprocal > 0 else math.inf


def _sparse_condition(M: Matrix) -> float:
    from scipy.sparse.linalg import LinearOperator, onenormest

    lu = factors.sparse_lu(matrices.is_symmetric(M))(M)
    if not np.isfinite(lu.solve(np.ones(M.shape[0]))).all():
        return math.inf
    inverse = LinearOperator(M.shape, matvec=lu.solve, rmatvec=lambda b: lu.solve(b, "T"), dtype=np.float64)
    # with one column it uses no random vector, so that the result is reproducible
    return float(onenormest(inverse, t=1)) * float(abs(M).sum(axis=0).max())


def eigenvalues(M: Matrix, definite: bool) -> Spectrum | None:
    """The ends of the spectrum of a symmetric M; estimated if it is large, positive definite and affordable."""
    if M.shape[0] <= EIGEN:
        dense = matrices.dense(M)
        if M.shape[0] <= factors.SMALL:
            values = np.linalg.eigvalsh(dense)
        else:
            from scipy.linalg import eigvalsh

            values = eigvalsh(dense)
        return Spectrum(float(values[0]), float(values[-1]), estimated=False)
    found = krylov.ends(M) if definite and affordable(M) else None
    return None if found is None or not np.isfinite(found).all() else Spectrum(*found, estimated=True)


def cost(M: Matrix, definite: bool) -> Cost:
    """The cost of M and of its factorization; half for a symmetric positive definite one."""
    n = int(M.shape[0])
    if is_sparse(M):
        band, held = Band(M), M.data.nbytes + M.indices.nbytes + M.indptr.nbytes
        return Cost(held, band.width, min(band.entries, n * n), min(band.operations, 2 * n**3 // 3))
    return Cost(M.nbytes, None, n * n, n**3 // 3 if definite else 2 * n**3 // 3)
