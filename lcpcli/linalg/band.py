"""How wide the band of a sparse matrix is after reordering, which bounds what a factorization of it may cost.

E. Cuthill and J. McKee, Reducing the bandwidth of sparse symmetric matrices, Proceedings of the 24th ACM National
Conference (1969) 157-172, reversed after A. George (1971). Elimination without row exchanges fills nothing outside
the band.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Matrix

DENSE = 5000  # n up to which a dense matrix may be factorized in passing
MOST_ENTRIES = 150_000_000  # of a band, that may be factorized in passing
MOST_OPERATIONS = 100_000_000_000


def affordable(M: Matrix) -> bool:
    """Whether M may be factorized in passing."""
    return Band(M).affordable if is_sparse(M) else M.shape[0] <= DENSE


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
        place = np.empty(order.size, dtype=np.int64)
        place[order] = np.arange(order.size)
        rows = np.repeat(place, np.diff(symmetric.indptr))
        return int(np.abs(rows - place[symmetric.indices]).max(initial=0))

    @property
    def entries(self) -> int:
        """Entries of both triangular factors, at most, if each stays in the band."""
        return int(self._M.shape[0] * (2 * self.width + 1))

    @property
    def operations(self) -> int:
        """Multiplications and additions of the elimination within the band, at most."""
        return int(2 * self._M.shape[0] * self.width * (self.width + 1) + self._M.shape[0])

    @property
    def affordable(self) -> bool:
        """Whether a factorization may be made in passing. Better orders than this one usually save most of it."""
        return self.entries <= MOST_ENTRIES and self.operations <= MOST_OPERATIONS
