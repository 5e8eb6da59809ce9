"""The LCP as a convex quadratic program: minimise z'Mz / 2 + q'z over z >= 0.

Its optimality conditions are the LCP where M is symmetric, and suffice where M is positive semidefinite: R. W. Cottle,
J.-S. Pang and R. E. Stone, The linear complementarity problem (1992), section 1.2.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from lcpcli.linalg import matrices, products
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.principal import definite_solver
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix

SEMIDEFINITE = 10 * float(
    np.finfo(np.float64).eps
)  # times n: what rounding may take from a semidefinite M of unit diagonal

_semidefinite: WeakKeyDictionary[Problem, bool] = WeakKeyDictionary()


def not_convex(problem: Problem) -> str:
    """Why the problem is no convex quadratic program, as a clause; "" if it is one."""
    return (
        "" if matrices.is_symmetric(problem.M) and is_monotone(problem) else "needs M symmetric positive semidefinite"
    )


def is_monotone(problem: Problem) -> bool:
    """Whether v'Mv >= 0 for all v, to rounding. Found out once for a problem, as it may take a factorization."""
    if problem not in _semidefinite:
        M = problem.M
        _semidefinite[problem] = _is_semidefinite(M if matrices.is_symmetric(M) else (M + M.T) / 2)
    return _semidefinite[problem]


def _is_semidefinite(M: Matrix) -> bool:
    """Whether a symmetric M is positive semidefinite to rounding.

    Diagonal dominance shows it without a factorization. Else the diagonal is scaled to nearly ones: units play no part.
    """
    diagonal, ones = M.diagonal(), np.ones(M.shape[0])
    largest = matrices.row_and_column_maxima(M, ones, ones)[0]
    if diagonal.min() < 0 or largest[diagonal == 0].any():
        return False
    if (products.absolute_product(M, ones) <= 2 * diagonal).all():
        return True
    C = np.exp2(-np.rint(0.5 * np.log2(np.where(diagonal > 0, diagonal, 1.0))))  # powers of two keep it symmetric
    shift = SEMIDEFINITE * M.shape[0]
    return definite_solver(_shifted(matrices.scaled(M, C, C), shift)) is not None


def _shifted(M: Matrix, shift: float) -> Matrix:
    if not is_sparse(M):
        return M + shift * np.eye(M.shape[0])
    from scipy.sparse import eye_array

    return (M + shift * eye_array(M.shape[0], format="csr")).tocsr()
