"""Proofs of positive definiteness by floating-point factorizations, rigorous in spite of rounding.

S. M. Rump, Verification of positive definiteness, BIT Numerical Mathematics 46 (2006) 433-452: if Cholesky's
factorization of S - c I runs to completion, and c exceeds a bound on its rounding error, S is positive definite. The
sparse case bounds the error of the factors in the same way: |S - c I - L U| <= gamma |L| |U|, and U = D L' up to a
difference that is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lcpcli.linalg import factors, matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import affordable
from lcpcli.typing import Matrix, Vector

WIDEST = 400  # binary exponents: matrices with entries further from 1 are left undecided


@dataclass(frozen=True, eq=False)
class Outcome:
    """Whether S is proved to be positive definite.

    direction : if not, a v, shape (n,), that may have v'Sv <= 0, or None. reason : why there is neither.
    """

    proved: bool
    direction: Vector | None = None
    reason: str = "rounding errors prevent a proof, and no counterexample was found"


def definite(S: Matrix) -> Outcome:
    """Whether S, shape (n, n), symmetric up to one rounding of each entry, is positive definite; with finite entries.

    S is first scaled by powers of two to a diagonal near 1, which does not affect the result. Sparse matrices that are
    expensive to factorize are left undecided.
    """
    diagonal = np.asarray(S.diagonal())
    if not diagonal.min() > 0:
        return Outcome(False)
    power = -np.rint(0.5 * np.log2(diagonal))
    if not affordable(S):
        return Outcome(False, None, "a factorization of M + M' may be too expensive")
    if np.abs(power).max() > WIDEST:
        return Outcome(False)
    D = np.exp2(power)
    with np.errstate(over="ignore"):
        A = matrices.scaled(S, D, D)
        rounding = EPS * matrices.norm_inf(A)
    if not rounding < 1:
        return Outcome(False)
    outcome = _sparse(A, rounding) if is_sparse(A) else _dense(A, rounding)
    return outcome if outcome.direction is None else Outcome(False, D * outcome.direction)


def _dense(A: Vector, rounding: float) -> Outcome:
    from scipy.linalg import get_lapack_funcs, solve_triangular

    n = A.shape[0]
    (potrf,) = get_lapack_funcs(("potrf",), (A,))
    shift = 2 * (n + 4) * EPS * float(np.trace(A)) + rounding
    shifted = A.copy(order="F")
    shifted.reshape(-1, order="F")[:: n + 1] -= shift
    if potrf(shifted, lower=True, overwrite_a=True)[1] == 0:
        return Outcome(True)
    factor, info = potrf(A, lower=True)
    v = np.zeros(n)
    if info > 0:
        k = info - 1
        v[:k] = -solve_triangular(factor[:k, :k], factor[k, :k], lower=True, trans=1)
        v[k] = 1.0
    return Outcome(False, v if v.any() else None)


def _sparse(A: Matrix, rounding: float) -> Outcome:
    from scipy.sparse import eye_array

    n = A.shape[0]
    shift = 2.0**-20
    while shift > 2.0**-44:
        try:
            lu = factors.sparse_lu(symmetric=True)((A - shift * eye_array(n, format="csr")).tocsr())
        except factors.SingularMatrix:
            return Outcome(False)
        if factors.positive_pivots(lu):
            return Outcome(_error(lu, n) + rounding + 4 * EPS < shift)
        shift *= 2.0**-12
    return Outcome(False, _direction(lu, n))


def _error(lu: Any, n: int) -> float:
    """A bound on |S - c I - L D L'| in the maximum norm, for factors computed without row interchanges."""
    L, U = lu.L.tocsr(), lu.U.tocsr()
    D = U.diagonal()
    gamma = 2 * (n + 4) * EPS
    with np.errstate(over="ignore"):
        sums = abs(L) @ (abs(U) @ np.ones(n))
        row = U.copy()
        row.data /= np.repeat(D, np.diff(U.indptr))
        difference = abs(L) @ (D * (abs(row - L.T.tocsr()) @ np.ones(n)))
        slack = abs(L) @ (D * (abs(row) @ np.ones(n)))
    return float((1 + gamma) * (gamma * sums.max() + difference.max() + gamma * slack.max()))


def _direction(lu: Any, n: int) -> Vector | None:
    """v with L'v = e_k in the order of elimination, for which v'Sv is about the k-th pivot, the smallest one."""
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    from scipy.sparse.linalg import spsolve_triangular

    pivots = lu.U.diagonal()
    unit = np.zeros(n)
    unit[int(pivots.argmin())] = 1.0
    v: Vector = spsolve_triangular(lu.L.T.tocsr(), unit, lower=False, unit_diagonal=True)[lu.perm_c]
    return v
