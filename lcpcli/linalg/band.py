"""The bandwidth of a sparse matrix after reordering, which bounds the cost of factorizing it.

E. Cuthill and J. McKee, Reducing the bandwidth of sparse symmetric matrices, Proceedings of the 24th ACM National
Conference (1969) 157-172, reversed after A. George (1971). Elimination without row exchanges causes no fill-in
outside the band.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Matrix

LARGEST_DENSE = 5000  # n up to which factorizing a dense matrix is affordable
NARROW = 4  # times the entries of M
MAX_ENTRIES = 150_000_000  # of a band whose factorization is affordable
MAX_OPERATIONS = 100_000_000_000


def affordable(M: Matrix) -> bool:
    """Whether a factorization of M costs little enough to be a side computation."""
    return Band(M).affordable if is_sparse(M) else M.shape[0] <= LARGEST_DENSE


def is_narrow(M: Matrix) -> bool:
    """Whether the entries of a sparse M are so near its diagonal, as in one dimension, that its factors cannot have
    many more."""
    rows = np.repeat(np.arange(M.shape[0]), np.diff(M.indptr))
    width = np.abs(rows - M.indices).max(initial=0)
    return bool(M.shape[0] * (2 * width + 1) <= NARROW * M.nnz)


class Band:
    """The band of a sparse matrix of shape (n, n) and of its transpose together, in the reverse Cuthill-McKee order."""

    def __init__(self, M: Matrix) -> None:
        self._M = M

    @cached_property
    def width(self) -> int:
        """The largest |i - j| of a stored entry in that order."""
        from scipy.sparse.csgraph import reverse_cuthill_mckee

        symmetric = (abs(self._M) + abs(self._M.T)).tocsr()
        order = reverse_cuthill_mckee(symmetric, symmetric_mode=True)
        position = np.empty(order.size, dtype=np.int64)
        position[order] = np.arange(order.size)
        rows = np.repeat(position, np.diff(symmetric.indptr))
        return int(np.abs(rows - position[symmetric.indices]).max(initial=0))

    @property
    def entries(self) -> int:
        """An upper bound on the entries of both triangular factors, if each stays in the band."""
        return int(self._M.shape[0] * (2 * self.width + 1))

    @property
    def operations(self) -> int:
        """An upper bound on the multiplications and additions of the elimination within the band."""
        return int(2 * self._M.shape[0] * self.width * (self.width + 1) + self._M.shape[0])

    @property
    def affordable(self) -> bool:
        """Whether a factorization is affordable. Better orderings than this one usually save most of its cost."""
        return self.entries <= MAX_ENTRIES and self.operations <= MAX_OPERATIONS
