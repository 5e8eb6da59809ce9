"""Elimination for tridiagonal LCPs whose basic variables lie at one end, as for American options.

M. J. Brennan and E. S. Schwartz, The valuation of American put options, Journal of Finance 32 (1977) 449-462: Gaussian
elimination from the end of the basic variables, and in the substitution back from the other end max(0, .) in each step.
For M-matrices that is the solution if the basic variables do lie at that end (P. Jaillet, D. Lamberton and B. Lapeyre,
Variational inequalities and the pricing of American options, Acta Applicandae Mathematicae 21 (1990) 263-289). What it
finds has to be verified.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.matrices import is_sparse, width
from lcpcli.model.box import of_masks
from lcpcli.typing import Matrix, States, Vector


class Elimination:
    """The factors of a tridiagonal M-matrix by elimination from its first row on, or from its last row on."""

    def __init__(self, M: Matrix, from_last: bool) -> None:
        with imports:
            from scipy.linalg.lapack import dtbtrs
        self._solve, self.turn = dtbtrs, -1 if from_last else 1
        below, diagonal, above = (M.diagonal(side)[:: self.turn] for side in (-1, 0, 1))
        if from_last:
            below, above = above, below
        pivots, factors = [float(diagonal[0])], list[float]()
        for beneath, pivot, over in zip(below.tolist(), diagonal[1:].tolist(), above.tolist(), strict=True):
            factors.append(beneath / pivots[-1] if pivots[-1] else np.inf)
            pivots.append(pivot - factors[-1] * over)
        self.L, self.U = np.ones((2, diagonal.size), order="F"), np.zeros((2, diagonal.size), order="F")
        self.L[1, :-1], self.U[0, 1:], self.U[1] = factors, above, pivots

    @property
    def is_of_m_matrix(self) -> bool:
        """Return whether M is an M-matrix: no entry off the diagonal is positive, and all pivots are."""
        are_pivots = np.isfinite(self.U).all() and (self.U[1] > 0.0).all()
        return bool(are_pivots and (self.U[0] <= 0.0).all() and (self.L[1, :-1] <= 0.0).all())

    def solution(self, q: Vector) -> tuple[Vector, States]:
        """Return z of shape (n,) for a q, and the states with the variables basic up to the last one, in the order of
        elimination, that is positive."""
        n = q.size
        y = self._solve(self.L, -q[:: self.turn], uplo="L", diag="U")[0]
        count = n - int((y[::-1] > 0.0).argmax()) if (y > 0.0).any() else 0
        z, basic = np.zeros(n), np.zeros(n, np.bool_)
        if count:
            z[:count] = self._solve(self.U[:, :count], y[:count], uplo="U")[0]
        basic[:count] = True
        return np.maximum(z, 0.0)[:: self.turn].copy(), of_masks(basic[:: self.turn])


def eliminations(M: Matrix) -> Iterator[Elimination]:
    """Yield the eliminations from both ends, if M is a sparse tridiagonal M-matrix."""
    if not is_sparse(M) or M.shape[0] < 2 or M.nnz > 3 * M.shape[0] or width(M) > 1:
        return
    for from_last in (True, False):
        own = Elimination(M, from_last)
        if not own.is_of_m_matrix:
            return
        yield own
