"""A mixed problem without the variables whose values are evident, and the way back.

Fixed variables; rows of M with no entry but a positive M_ii, for which z_i = mid(l_i, u_i, -q_i / M_ii); and rows
without entries, where the sign of w_i = q_i says at which bound z_i is. What is left out may leave such rows behind.
As PATH has it: M. C. Ferris, T. S. Munson, Preprocessing complementarity problems, in: Complementarity: Applications,
Algorithms and Extensions, Kluwer (2001) 143-164.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

WORTHWHILE = 0.4  # of the variables: if fewer are evident, leaving them out costs about what it saves
ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Presolved:
    """The problem of the variables `kept`; the others have the values of z, shape (n,)."""

    problem: Problem
    given: Problem
    kept: Indices
    z: Vector

    @property
    def is_exact(self) -> bool:
        """Whether it is certain that nothing was rounded: this is not checked."""
        return False

    def start(self, x: Vector) -> Vector:
        """x of the variables that are kept."""
        return x[self.kept]

    def back(self, x: Vector) -> Vector:
        """x of the given problem."""
        z = self.z.copy()
        z[self.kept] = self.problem.box.z_of(x)
        whole = self.given.box.x_of(z, self.given.w(z))
        whole[self.kept] = x
        return whole

    def residual(self, F: Vector) -> Vector:
        """F of the given problem, 0 where w follows from z."""
        whole = np.zeros(self.given.n)
        whole[self.kept] = F
        return whole

    def multipliers(self, y: Vector) -> Vector:
        """Farkas' y, 0 for the rows that are left out."""
        return self.residual(y)


def presolved(given: Problem) -> Presolved | None:
    """The problem without evident variables; None if they are too few, or all."""
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
    """Add the variables that empty and singleton rows determine, M sparse."""
    diagonal = given.M.diagonal()
    pattern = given.M.copy()
    pattern.data = (pattern.data != 0).astype(float)
    for _ in range(ROUNDS):
        others = pattern @ (~known).astype(float) - (diagonal != 0) * ~known
        alone = ~known & (others == 0) & (diagonal >= 0)
        if not alone.any():
            return
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
