"""Least squares on the free columns alone, with the equations eliminated: systems

    dr + A dx         = f
    A' dr      + E'dy = g
              E dx    = e

by an orthogonal basis of the solutions of E dx = 0, and the factors Q R of A on it:
A. Bjorck, Numerical Methods for Least Squares Problems (1996), sections 1.5 and 5.1.
With these factors, and residuals f and g of more digits, a solution is refined to
nearly all of its digits, whatever the size of the residual: A. Bjorck, Iterative
refinement of linear least squares solutions I, BIT 7 (1967) 257-278.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import EPS
from lcpcli.typing import Matrix, Vector

# Of the size of a column, and of the largest singular value of E: what rounding leaves
# of one that depends on others.
DEPENDENT = 8 * EPS


class Step(NamedTuple):
    """A solution of the system: shapes (p,), (m,) and (k,), or for several right-hand
    sides each with a column for each of them."""

    dx: Vector
    dr: Vector
    dy: Vector


class Factors:
    """The factors for p free columns A, of shape (m, p), and E, of shape (k, p).

    is_regular : whether no column of A depends on others, but for what E excludes.
    """

    def __init__(self, A: Matrix, E: Matrix) -> None:
        self.A, self.E = A, E
        self.basis: Matrix | None = None
        reduced = A
        if len(E):
            U, sizes, Vt = np.linalg.svd(E, full_matrices=True)
            largest = float(sizes.max(initial=0.0))
            rank = int((sizes > DEPENDENT * max(E.shape) * largest).sum())
            self._rows = U[:, :rank] / sizes[:rank], Vt[:rank].T
            self.basis = Vt[rank:].T
            reduced = A @ self.basis
        self.Q, self.R = np.linalg.qr(reduced)
        pivots = np.abs(self.R.diagonal())
        sizes = np.sqrt(np.einsum("ij,ij->j", reduced, reduced))
        is_tall = reduced.shape[0] >= reduced.shape[1]
        least = DEPENDENT * np.sqrt(sum(reduced.shape)) * sizes
        self.is_regular = is_tall and bool((pivots > least).all())

    def step(self, f: Vector, g: Vector, e: Vector) -> Step:
        """Return the solution for these right-hand sides; the factors must be
        regular."""
        known = np.zeros_like(e)
        if self.basis is not None:
            U, V = self._rows
            known = V @ (U.T @ e)
            f, rest = f - self.A @ known, self.basis.T @ g
        else:
            rest = g
        h = np.linalg.solve(self.R.T, rest)
        of_f = self.Q.T @ f
        v = np.linalg.solve(self.R, of_f - h)
        dr = f - self.Q @ (of_f - h)
        if self.basis is None:
            return Step(v, dr, known)
        dy = U @ (V.T @ (g - self.A.T @ dr))
        return Step(known + self.basis @ v, dr, dy)

    def inverse(self) -> Matrix:
        """Return the inverse of the system: what (f, g, e) contribute to (dx, dr,
        dy)."""
        (m, p), k = self.A.shape, len(self.E)
        unit = np.eye(m + p + k)
        return np.vstack(self.step(unit[:m], unit[m : m + p], unit[m + p :]))
