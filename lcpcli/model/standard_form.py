"""A mixed problem as an LCP, for methods that accept only z >= 0; and without the variables whose values are evident.

As an LCP, finite lower bounds are shifted to 0, variables with only an upper bound are mirrored, free ones are split by
one common extra column, z_F = p - t e (which keeps M positive semidefinite if it is), and a box gets its upper bound as
a row, with a multiplier v: [M I; -I 0]. Fixed variables are left out.

A value is evident if the variable is fixed; if row i of M has no entry but a positive M_ii, so that z_i = mid(l_i, u_i,
-q_i / M_ii); or if row i is empty, so that the sign of w_i = q_i says at which bound z_i is. Without these variables,
more rows may become evident. PATH does the same: M. C. Ferris, T. S. Munson, Preprocessing complementarity problems,
in: Complementarity: Applications, Algorithms and Extensions, Kluwer (2001) 143-164.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse, unit_columns
from lcpcli.model.box import Box
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Matrix, Vector

WORTHWHILE = 0.4  # of the variables: if fewer are evident, leaving them out costs about what it saves
PRESOLVE_ROUNDS = 5  # each costs a product with M; what they leave, the methods solve as well


@dataclass(frozen=True, eq=False)
class StandardForm(Change):
    """An LCP whose solutions are those of a mixed problem, with the way back.

    original : the mixed problem, n unknowns z.
    problem : the LCP, with unknowns p >= 0 for the variables `kept`, then t if some are free, then v for those `boxed`:
        z = corner + sign p - t on the free ones; w' = sign w + v, -sum of the free w, and upper - lower - p.
    kept, boxed : indices of variables; the boxed ones are among the kept. sign : shape (n,).
    """

    kept: Indices
    boxed: Indices
    sign: Vector

    def start(self, x: Vector) -> Vector:  # noqa: ARG002 (methods that need this form use none)
        return np.zeros(self.problem.n)

    @property
    def is_exact(self) -> bool:
        return self.original.has_small_integers

    def back(self, x: Vector) -> Vector:
        unknowns, own = self.problem.box.z_of(x), self.problem.box.reflected(x) - x
        w = np.zeros(self.original.n)
        w[self.kept] = own[: self.kept.size]
        w[self.boxed] -= unknowns[unknowns.size - self.boxed.size :]
        z = self.original.box.project(self.original.box.corner + self.multipliers(unknowns))
        return self.original.box.x_of(z, self.sign * w)

    def multipliers(self, y: Vector) -> Vector:
        """Return a Farkas vector y for the mixed problem from one for the LCP; z - corner is mapped likewise."""
        own = np.zeros(self.original.n)
        own[self.kept] = self.sign[self.kept] * y[: self.kept.size]
        if self.original.box.free.any():
            own[self.original.box.free] -= y[self.kept.size]
        return own


def standard_form(given: Problem) -> StandardForm:
    """Return the LCP of a mixed problem; M is copied once. If all variables are fixed, they count as boxed."""
    box = given.box
    kept = np.flatnonzero(~box.fixed) if not box.fixed.all() else np.arange(given.n)
    low, high = np.isfinite(box.lower), np.isfinite(box.upper)
    boxed, sign = kept[(low & high)[kept]], np.where(high & ~low, -1.0, 1.0)
    q = given.w(box.corner) if box.corner.any() else given.q
    M, q = matrices.scaled(given.M[kept][:, kept], sign[kept], sign[kept]), sign[kept] * q[kept]
    if box.free.any():
        M, q = _with_common_column(M, q, box.free[kept])
    if boxed.size:
        E = unit_columns(q.size, np.searchsorted(kept, boxed), is_sparse(M))
        zero = matrices.compressed((boxed.size, boxed.size)) if is_sparse(M) else np.zeros((boxed.size, boxed.size))
        M, q = matrices.stack([[M, E], [-E.T, zero]]), np.append(q, box.upper[boxed] - box.lower[boxed])
    return StandardForm(Problem(M, q, name=given.name), given, kept, boxed, sign)


def _with_common_column(M: Matrix, q: Vector, free: Mask) -> tuple[Matrix, Vector]:
    """Return E'ME and E'q for E = [I, -e_F]."""
    column, row = -(M @ free.astype(float)), -(free.astype(float) @ M)
    corner = np.array([[-float(column[free].sum())]])
    return matrices.stack([[M, column[:, np.newaxis]], [row[np.newaxis], corner]]), np.append(q, -q[free].sum())


@dataclass(frozen=True, eq=False)
class Presolved(Change):
    """The problem of the variables `kept`; the others have the values of z, shape (n,). Rounding is not checked."""

    kept: Indices
    z: Vector

    def start(self, x: Vector) -> Vector:
        return x[self.kept]

    def back(self, x: Vector) -> Vector:
        z = self.z.copy()
        z[self.kept] = self.problem.box.z_of(x)
        whole = self.original.box.x_of(z, self.original.w(z))
        whole[self.kept] = x
        return whole

    def residual(self, F: Vector) -> Vector:
        """Return F, or Farkas' y, of the original problem: 0 for the rows that are left out."""
        whole = np.zeros(self.original.n)
        whole[self.kept] = F
        return whole


def presolved(given: Problem) -> Presolved | None:
    """Return the problem without its evident variables; None if they are too few, or all."""
    box = given.box
    known, z = box.fixed.copy(), np.where(box.fixed, box.lower, 0.0)
    if is_sparse(given.M):
        _find_by_rows(given, box, known, z)
    count = int(np.count_nonzero(known))
    if not WORTHWHILE * given.n <= count < given.n:
        return None
    kept = np.flatnonzero(~known)
    q = given.w(z) if z.any() else given.q
    reduced = Problem(given.M[kept][:, kept], q[kept], lower=box.lower[kept], upper=box.upper[kept])
    return Presolved(reduced, given, kept, z)


def _find_by_rows(given: Problem, box: Box, known: Mask, z: Vector) -> None:
    """Add to `known` and z the variables that empty and singleton rows determine, for sparse M."""
    diagonal = given.M.diagonal()
    pattern = given.M.copy()
    pattern.data = (pattern.data != 0).astype(float)
    for _ in range(PRESOLVE_ROUNDS):
        others = pattern @ (~known).astype(float) - (diagonal != 0) * ~known
        alone = ~known & (others == 0) & (diagonal >= 0)
        w = given.w(z)  # with z_i = 0 there
        single = alone & (diagonal > 0)
        value = np.zeros(given.n)
        value[single] = -w[single] / diagonal[single]
        value = np.where(single, value, np.where(w > 0, box.lower, box.upper))
        alone &= np.isfinite(value) & (single | (w != 0))
        if not alone.any():
            return
        z[alone] = box.project(value)[alone]
        known |= alone
