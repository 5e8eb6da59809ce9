"""Systems with a singular matrix: a solution, what all solutions share, and whether there is one."""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.factors import finite
from lcpcli.linalg.units import units
from lcpcli.typing import Mask, Vector

LEAST_DIGITS = 1e-3  # the relative change by rounding from which a matrix counts as singular
LEAST_SINGULAR_VALUE = ROW_ROUNDING / LEAST_DIGITS  # relative to the largest: smaller ones count as 0


class PseudoInverse:
    """A generalized inverse of a dense matrix A of shape (k, k), and bases of the null spaces of A and of A':
    G = C (R A C)^+ R in the units R, C that A suggests, so that A G A = A and G A G = G.
    """

    def __init__(self, A: Vector) -> None:
        R, C = units(A).diagonals()
        left, sizes, right = np.linalg.svd(finite(R[:, np.newaxis] * A * C))
        rank = int(np.count_nonzero(sizes > LEAST_SINGULAR_VALUE * sizes[0]))
        self._inverse = (C[:, np.newaxis] * right[:rank].T / sizes[:rank]) @ (left[:, :rank].T * R)
        self._null, self._left_null = C[:, np.newaxis] * right[rank:].T, left[:, rank:].T * R
        self.is_singular = rank < len(A)
        self._rounding = len(A) * ROW_ROUNDING * (sizes[0] / sizes[rank - 1] if rank else 1.0)  # of the null spaces

    def __call__(self, b: Vector, transposed: bool = False) -> Vector:
        """Return G b or G'b."""
        return np.asarray((self._inverse.T if transposed else self._inverse) @ b)

    def determines(self, J: Vector) -> Mask:
        """Return for which rows of J, shape (m, k), J x is the same for all solutions x, up to rounding."""
        sizes = np.abs(J) @ np.abs(self._null)
        return np.asarray((np.abs(J @ self._null) <= self._rounding * sizes).all(axis=1))

    def is_consistent(self, b: Vector, terms: Vector) -> bool:
        """Return whether A x = b has a solution, up to rounding of the terms that b is the sum of."""
        return bool((np.abs(self._left_null @ b) <= self._rounding * (np.abs(self._left_null) @ terms)).all())
