"""Facts about M that determine difficulty and cost: scaling, condition, spectrum, and the size of its factors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import interruptibly
from lcpcli.linalg import factors, krylov, matrices
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import Band, affordable
from lcpcli.typing import Matrix

BAD_CONDITION = 1e12  # from which on a hint warns: at most 4 of 16 digits are left
BAD_SPREAD = 4.0  # decades of the largest entries of rows or columns, from which on a hint advises to scale
MOST_WITH_SPECTRUM = 500  # unknowns up to which all eigenvalues are computed, in a fraction of a second


class Spread(NamedTuple):
    """The range in decades of the largest entries of nonzero rows, and of nonzero columns."""

    rows: float
    columns: float


class Spectrum(NamedTuple):
    """The smallest and the largest eigenvalue of a symmetric M, in units of M; estimates, by a few steps of inverse and
    of power iteration, are accurate to a factor of about 3."""

    smallest: float
    largest: float
    estimated: bool


@dataclass(frozen=True)
class Cost:
    """The storage of M in bytes, and the cost of its triangular factors in entries and operations; the factors of a
    sparse M lie within a band of width `bandwidth` after reordering."""

    bytes: int
    bandwidth: int | None
    factor_entries: int
    factor_operations: int


def spread(M: Matrix) -> Spread:
    """Return the spread of M."""
    used = [sizes[sizes > 0] for sizes in (matrices.row_maxima(M), matrices.column_maxima(M))]
    return Spread(*(float(np.log10(sizes.max()) - np.log10(sizes.min())) if sizes.size else 0.0 for sizes in used))


def condition(M: Matrix) -> float:
    """Return |M|_1 |M^-1|_1 of an affordable M; estimated from below for more than factors.MOST_NUMPY_ROWS rows.
    Infinite if M is singular."""
    small = not is_sparse(M) and M.shape[0] <= factors.MOST_NUMPY_ROWS
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        try:
            value = float(np.linalg.cond(M, 1)) if small else _estimated_condition(M)
        except SingularMatrix:
            return math.inf
    return value if value >= 1 else math.inf


def _estimated_condition(M: Matrix) -> float:
    if is_sparse(M):
        with imports:
            from scipy.sparse.linalg import LinearOperator, onenormest
        lu = factors.sparse_lu(matrices.is_symmetric(M))(M)
        if not np.isfinite(lu.solve(np.ones(M.shape[0]))).all():
            return math.inf
        inverse = LinearOperator(M.shape, matvec=lu.solve, rmatvec=lambda b: lu.solve(b, "T"), dtype=np.float64)
        # with one column it uses no random vector, so that the result is reproducible
        return float(onenormest(inverse, t=1)) * float(abs(M).sum(axis=0).max())
    with imports:
        from scipy.linalg import get_lapack_funcs
    getrf, gecon = get_lapack_funcs(("getrf", "gecon"), (M,))
    lu, _, info = interruptibly(partial(getrf, M)) if M.shape[0] >= factors.LONG_LU else getrf(M)
    reciprocal = 0.0 if info > 0 else float(gecon(lu, float(matrices.norm_inf(M.T)), norm="1")[0])
    return 1 / reciprocal if reciprocal > 0 else math.inf


def eigenvalues(M: Matrix, definite: bool) -> Spectrum | None:
    """Return the ends of the spectrum of a symmetric M; estimated if it is large, positive definite and affordable."""
    if M.shape[0] <= MOST_WITH_SPECTRUM:
        values = np.linalg.eigvalsh(matrices.dense(M))
        return Spectrum(float(values[0]), float(values[-1]), estimated=False)
    found = krylov.ends(M) if definite and affordable(M) else None
    return None if found is None or not np.isfinite(found).all() else Spectrum(*found, estimated=True)


def cost(M: Matrix, definite: bool) -> Cost:
    """Return the cost of M and of its factorization; half for a symmetric positive definite one."""
    n = int(M.shape[0])
    if is_sparse(M):
        band, size = Band(M), M.data.nbytes + M.indices.nbytes + M.indptr.nbytes
        return Cost(size, band.width, min(band.entries, n * n), min(band.operations, 2 * n**3 // 3))
    return Cost(M.nbytes, None, n * n, n**3 // 3 if definite else 2 * n**3 // 3)
