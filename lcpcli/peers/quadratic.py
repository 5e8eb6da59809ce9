"""The LCP as a convex quadratic program: minimize z'Mz / 2 + q'z over z >= 0, or over l <= z <= u.

If M is symmetric, its optimality conditions are the LCP; if M is positive semidefinite too, they are sufficient:
R. W. Cottle, J.-S. Pang and R. E. Stone, The linear complementarity problem (1992), section 1.2.

Differs from qpsolvers in: DAQP's z and status and HiGHS's status are kept on failure; conversion and setup are timed.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from lcpcli.linalg import matrices, products
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.principal import definite_solver
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

# times n: how far rounding may push the eigenvalues of a semidefinite M with unit diagonal below 0
SEMIDEFINITE = 10 * EPS

_semidefinite: WeakKeyDictionary[Problem, bool] = WeakKeyDictionary()


def not_convex(problem: Problem) -> str:
    """Why the problem is not a convex quadratic program, as a clause; "" if it is."""
    return (
        "" if matrices.is_symmetric(problem.M) and is_monotone(problem) else "needs a symmetric positive semidefinite M"
    )


def bounds(problem: Problem, infinite: float = np.inf) -> tuple[Vector, Vector]:
    """New vectors l and u of shape (n,), with a solver's own infinity."""
    lower, upper = np.full(problem.n, problem.lower), np.full(problem.n, problem.upper)
    return np.maximum(lower, -infinite), np.minimum(upper, infinite)


def is_monotone(problem: Problem) -> bool:
    """Whether v'Mv >= 0 for all v, up to rounding. Cached for each problem, as it may take a factorization."""
    if problem not in _semidefinite:
        M = problem.M
        _semidefinite[problem] = _is_semidefinite(M if matrices.is_symmetric(M) else (M + M.T) / 2)
    return _semidefinite[problem]


def _is_semidefinite(M: Matrix) -> bool:
    """Whether a symmetric M is positive semidefinite up to rounding.

    Diagonal dominance settles it without a factorization. Otherwise M is scaled to a diagonal of about 1 first, so that
    the answer does not depend on units.
    """
    diagonal, ones = M.diagonal(), np.ones(M.shape[0])
    largest = matrices.row_maxima(M)
    if diagonal.min() < 0 or largest[diagonal == 0].any():
        return False
    if (products.absolute_product(M, ones) <= 2 * diagonal).all():
        return True
    C = np.exp2(-np.rint(0.5 * np.log2(np.where(diagonal > 0, diagonal, 1.0))))  # powers of two: M stays symmetric
    shift = SEMIDEFINITE * M.shape[0]
    return definite_solver(_shifted(matrices.scaled(M, C, C), shift)) is not None


def _shifted(M: Matrix, shift: float) -> Matrix:
    if not is_sparse(M):
        return M + shift * np.eye(M.shape[0])
    from scipy.sparse import eye_array

    return (M + shift * eye_array(M.shape[0], format="csr")).tocsr()
