"""Signs S = +-1 with S M symmetric, as for the conditions of programs: then S (M + D) is quasidefinite if M + M' is
positive semidefinite and D positive (R. J. Vanderbei, Symmetric quasidefinite matrices, SIAM J. Optim. 5 (1995)
100-113), so that it has LDL' factors for every order of the pivots.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.matrices import compressed
from lcpcli.typing import Matrix, Vector


def signs(M: Matrix) -> Vector | None:
    """S of shape (n,), entries 1 or -1, with S_i M_ij = S_j M_ji for all i and j; None if there is none.

    i and j have the same sign where M_ij = M_ji and opposite ones where M_ij = -M_ji: in the graph of all (i, +) and
    (i, -) with these edges, (i, +) and (i, -) must not be connected.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    M, n = compressed(M), M.shape[0]
    same, opposite = (M + M.T).tocoo(), (M - M.T).tocoo()
    kept, turned = (same.row != same.col) & (same.data != 0), opposite.data != 0
    rows = np.concatenate((same.row[kept], opposite.row[turned]))
    to_plus = np.concatenate((same.col[kept], opposite.col[turned] + n))
    to_minus = np.concatenate((same.col[kept] + n, opposite.col[turned]))
    places = np.concatenate((rows, rows + n)), np.concatenate((to_plus, to_minus))
    _, part = connected_components(coo_array((np.ones(2 * rows.size), places), shape=(2 * n, 2 * n)), directed=False)
    plus, minus = part[:n], part[n:]
    return None if (plus == minus).any() else np.where(plus < minus, 1.0, -1.0)
