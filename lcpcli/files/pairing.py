"""Equations, and the free variables to which they belong in a mixed complementarity problem."""

from __future__ import annotations

import numpy as np

from lcpcli.clock import imports
from lcpcli.typing import Indices, Vector

LEAST = 2.0**-500  # stands for entries that happen to be 0, or are undefined


def paired(n: int, rows: Indices, columns: Indices, values: Vector) -> Indices:
    """Return for each of n free variables its equation: as many pairs as possible at entries of the Jacobian, of which
    the product is as large as possible, relative to the largest entries of the rows; what is left is paired in order.

    rows, columns, values : the entries. Every pairing has the same solutions, as an equation has to hold whatever its
    variable is; entries on the diagonal help the methods. (I. S. Duff and J. Koster, On algorithms for permuting large
    entries to the diagonal of a sparse matrix, 2001.)
    """
    with imports:
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    # Integers, as with rounding errors in the costs the matching may not end.
    sizes = np.rint(np.log2(np.clip(np.nan_to_num(np.abs(values), nan=LEAST), LEAST, 1 / LEAST)))
    largest = np.full(n, np.log2(LEAST))
    np.maximum.at(largest, rows, sizes)
    costs = 1.0 + largest[rows] - sizes
    own = np.arange(n)
    unpaired = n * (1.0 + costs.max(initial=0.0))  # of a row, and of a column, without a partner
    i = np.concatenate([rows, own, n + own, n + columns])
    j = np.concatenate([columns, n + own, own, n + rows])
    weights = np.concatenate([costs, np.full(2 * n, unpaired), np.ones(len(rows))])
    _, found = min_weight_full_bipartite_matching(csr_array((weights, (i, j)), shape=(2 * n, 2 * n)))
    equations = np.full(n, -1)
    is_paired = found[:n] < n
    equations[found[:n][is_paired]] = own[is_paired]
    equations[equations < 0] = own[~is_paired]
    return equations
