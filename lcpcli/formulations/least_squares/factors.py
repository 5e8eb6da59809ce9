"""Least squares on the free columns alone, with the equations eliminated. The systems

    dr + A dx         = f
    A' dr      + E'dy = g
              E dx    = e

are solved by an orthogonal basis of the solutions of E dx = 0, and the factors Q R of A
times this basis: A. Bjorck, Numerical Methods for Least Squares Problems (1996),
sections 1.5 and 5.1. With these factors, and f, g and e computed in twice the
precision, a solution can be refined to almost full double precision, whatever the size
of the residual: A. Bjorck, Iterative refinement of linear least squares solutions I,
BIT 7 (1967) 257-278.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import EPS
from lcpcli.typing import Matrix, Vector

# A column is treated as dependent on those before it if its pivot in R is below this,
# times the root of the number of rows, relative to the norm of the column; and singular
# values of E below this, relative to the largest, are treated as 0.
DEPENDENT = 8 * EPS


@cache
def lapack() -> Any:
    with imports:
        from scipy.linalg import lapack as loaded
    return loaded


class Step(NamedTuple):
    """A solution of the system, of shapes (p,), (m,) and (k,); for several right-hand
    sides, each has one column for each of them.
    """

    dx: Vector
    dr: Vector
    dy: Vector


class Factors:
    """The factors for p free columns A, of shape (m, p), and E, of shape (k, p).

    dependent : the index of the first column of A, restricted to the solutions of
        E dx = 0, that depends linearly on those before it; None if they are linearly
        independent, so that the system has a unique dx.
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
        m, self.rank = reduced.shape
        self.dependent: int | None = None
        if not self.rank:
            return
        if not m:
            self.dependent = 0
            return
        self._qr, self._tau, *_ = lapack().dgeqrf(reduced)
        self.R = self._qr[: self.rank]
        # The norm of a column of R equals that of the column of A, as Q is orthogonal.
        norms = np.sqrt(np.einsum("ij,ij->j", reduced, reduced))
        min_pivots = DEPENDENT * np.sqrt(m + self.rank) * norms
        pivots = np.abs(self.R.diagonal())
        dependent = (pivots <= min_pivots[: pivots.size]).nonzero()[0]
        if dependent.size:
            self.dependent = int(dependent[0])
        elif m < self.rank:
            self.dependent = m

    @property
    def is_regular(self) -> bool:
        return self.dependent is None

    def _times_Q(self, v: Vector, transposed: str) -> Vector:
        columns = v.reshape(len(v), -1)
        lwork = max(64 * columns.shape[1], 1)
        arguments = "L", transposed, self._qr, self._tau, columns, lwork
        return np.asarray(lapack().dormqr(*arguments)[0]).reshape(v.shape)

    def _solve(self, v: Vector, transposed: int) -> Vector:
        return np.asarray(lapack().dtrtrs(self.R, v, trans=transposed)[0])

    @property
    def inverse_of_R(self) -> Matrix:
        return self._solve(np.eye(self.rank), 0)

    @property
    def row_norms(self) -> Vector:
        """The 2-norms of the rows of the pseudoinverse of A; the factors must be
        regular and without E."""
        if not self.rank:
            return np.zeros(0)
        inverse = self.inverse_of_R
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", inverse, inverse)))

    @property
    def condition(self) -> float:
        """The condition of R in the Frobenius norm, 0 for no columns; the factors must
        be regular."""
        if not self.rank:
            return 0.0
        R = np.triu(self.R)
        return float(np.linalg.norm(R) * np.linalg.norm(self.inverse_of_R))

    def step(self, f: Vector, g: Vector, e: Vector) -> Step:
        """Return the solution for these right-hand sides. The factors must be
        regular.
        """
        minimum_norm = np.zeros_like(e)
        rest = g
        if self.basis is not None:
            U, V = self._rows
            minimum_norm = V @ (U.T @ e)
            f, rest = f - self.A @ minimum_norm, self.basis.T @ g
        v, dr = self._reduced_step(f, rest)
        if self.basis is None:
            return Step(v, dr, minimum_norm)
        dy = U @ (V.T @ (g - self.A.T @ dr))
        return Step(minimum_norm + self.basis @ v, dr, dy)

    def _reduced_step(self, f: Vector, g: Vector) -> tuple[Vector, Vector]:
        if not self.rank:
            return g, f
        turned = self._times_Q(f, "T")
        h = self._solve(g, 1) if g.any() else np.zeros_like(turned[: self.rank])
        v = self._solve(turned[: self.rank] - h, 0)
        turned[: self.rank] = h
        return v, self._times_Q(turned, "N")
