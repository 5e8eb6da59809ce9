"""Whether a sparse matrix may be stiff."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.matrices import absolute_product, has_no_positive_links, is_sparse
from lcpcli.typing import Matrix

# Of the entries off the diagonal of a row, in units of the diagonal, their largest sum:
# where all sums are smaller, the condition number is below 2 / (1 - 0.95) = 40, by
# Gershgorin's theorem.
DOMINATED = 0.95


def may_be_stiff(M: Matrix) -> bool:
    """Return whether a sparse M has a positive diagonal, which does not dominate, and
    positive entries off it.

    Such are fourth differences, and stiffness matrices of beams, plates and bodies;
    differences of second order have no positive entry off the diagonal, and methods of
    their own.
    """
    if not is_sparse(M) or not M.shape[0]:
        return False
    diagonal = M.diagonal()
    if not diagonal.min() > 0 or has_no_positive_links(M):
        return False
    units = 1 / np.sqrt(diagonal)
    sums = units * absolute_product(M, units)
    return bool(sums.max() > 1 + DOMINATED)
