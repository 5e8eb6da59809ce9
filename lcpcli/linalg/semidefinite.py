"""Whether a symmetric matrix is positive semidefinite up to rounding, for those who need no proof."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import matrices, products
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.principal import definite_solver
from lcpcli.typing import Matrix

# times n: how far rounding may push the eigenvalues of a semidefinite M with unit diagonal below 0
SEMIDEFINITE = 10 * EPS


def is_semidefinite(M: Matrix) -> bool:
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
