"""A mixed problem as an LCP, for methods that know only z >= 0.

Finite lower bounds are shifted to 0, variables with only an upper bound are mirrored, free ones are split by one
common extra column, z_F = p - t e (which keeps M positive semidefinite if it is), and a box gets its upper bound as a
row, with a multiplier v: [M I; -I 0]. Fixed variables are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Matrix, Vector


@dataclass(frozen=True, eq=False)
class StandardForm:
    """An LCP whose solutions are those of a mixed problem, with the way back.

    given : the mixed problem, n unknowns z.
    problem : the LCP, with unknowns p >= 0 for the variables `kept`, then t if some are free, then v for those `boxed`:
        z = base + sign p - t on the free ones; w' = sign w + v, -sum of the free w, and upper - lower - p.
    kept, boxed, free : indices of variables; boxed and free ones are among the kept.
    base, sign : shape (n,).
    """

    given: Problem
    problem: Problem
    kept: Indices
    boxed: Indices
    free: Indices
    base: Vector
    sign: Vector

    def z(self, unknowns: Vector) -> Vector:
        """z of the mixed problem, within its bounds."""
        z = self.base.copy()
        z[self.kept] += self.sign[self.kept] * unknowns[: self.kept.size]
        if self.free.size:
            z[self.free] -= unknowns[self.kept.size]
        return self.given.box.project(z)

    def start(self, x: Vector) -> Vector:  # noqa: ARG002 (methods that need this form use none)
        """The origin of the LCP."""
        return np.zeros(self.problem.n)

    @property
    def is_exact(self) -> bool:
        """Whether it is certain that nothing was rounded."""
        return self.given.has_small_integers

    def back(self, x: Vector) -> Vector:
        """x of the mixed problem, from an x of the LCP."""
        unknowns, own = self.problem.box.z_of(x), self.problem.box.reflected(x) - x
        w = np.zeros(self.given.n)
        w[self.kept] = own[: self.kept.size]
        w[self.boxed] -= unknowns[unknowns.size - self.boxed.size :]
        return self.given.box.x_of(self.z(unknowns), self.sign * w)

    def multipliers(self, y: Vector) -> Vector:
        """Farkas' y for the mixed problem from one for the LCP: the multipliers of w."""
        own = np.zeros(self.given.n)
        own[self.kept] = self.sign[self.kept] * y[: self.kept.size]
        if self.free.size:
            own[self.free] -= y[self.kept.size]
        return own


def standard_form(given: Problem) -> StandardForm:
    """The LCP of a mixed problem; M is copied once. If all variables are fixed, they count as boxed."""
    box = given.box
    kept = np.flatnonzero(~box.fixed) if not box.fixed.all() else np.arange(given.n)
    low, high = np.isfinite(box.lower), np.isfinite(box.upper)
    sign, base = np.where(high & ~low, -1.0, 1.0), np.where(low, box.lower, np.where(high, box.upper, 0.0))
    boxed, free = kept[(low & high)[kept]], kept[~(low | high)[kept]]
    M, q = given.M[kept][:, kept], given.q
    if base.any():
        q = given.w(base)
    M, q = matrices.scaled(M, sign[kept], sign[kept]), sign[kept] * q[kept]
    if free.size:
        M, q = _with_common_column(M, q, np.isin(kept, free))
    if boxed.size:
        M, q = _with_boxes(M, q, np.searchsorted(kept, boxed), box.upper[boxed] - box.lower[boxed])
    return StandardForm(given, Problem(M, q, name=given.name), kept, boxed, free, base, sign)


def _with_common_column(M: Matrix, q: Vector, free: Mask) -> tuple[Matrix, Vector]:
    """E'ME and E'q for E = [I, -e_F]."""
    column, row = -(M @ free.astype(float)), -(free.astype(float) @ M)
    corner = np.array([[-float(column[free].sum())]])
    return matrices.stack([[M, column[:, np.newaxis]], [row[np.newaxis], corner]]), np.append(q, -q[free].sum())


def _with_boxes(M: Matrix, q: Vector, boxed: Indices, widths: Vector) -> tuple[Matrix, Vector]:
    """[M E; -E' 0] and (q, widths), with the columns of the identity for the boxed variables in E."""
    n, k = q.size, boxed.size
    if not is_sparse(M):
        E = np.zeros((n, k))
        E[boxed, np.arange(k)] = 1.0
        return np.block([[M, E], [-E.T, np.zeros((k, k))]]), np.append(q, widths)
    from scipy.sparse import csr_array

    E = csr_array((np.ones(k), (boxed, np.arange(k))), shape=(n, k))
    return matrices.stack([[M, E], [-E.T, csr_array((k, k))]]), np.append(q, widths)
