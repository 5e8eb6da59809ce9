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

    i and j have the same sign where M_ij = M_ji and opposite ones where M_ij = -M_ji.
    """
    from scipy.sparse import block_array, csr_array
    from scipy.sparse.csgraph import connected_components, dijkstra

    M = compressed(M)
    even, odd = M + M.T, M - M.T
    even.setdiag(0.0)
    even.eliminate_zeros()
    odd.eliminate_zeros()
    count, part = connected_components(even, directed=False)
    edges = odd.tocoo()
    first, second = part[edges.row], part[edges.col]
    if (first == second).any():
        return None
    graph = csr_array((np.ones(first.size), (first, second)), shape=(count, count))
    _, component = connected_components(graph, directed=False)
    roots = np.unique(component, return_index=True)[1]
    root = csr_array((np.ones(roots.size), (roots, np.zeros(roots.size, dtype=np.intp))), shape=(count, 1))
    graph = block_array([[graph, root], [root.T, None]], format="csr")
    negative = dijkstra(graph, unweighted=True, indices=count)[:-1] % 2 == 0
    if (negative[first] == negative[second]).any():
        return None
    return np.where(negative[part], -1.0, 1.0)
