"""A mixed problem as an LCP, for methods that accept only z >= 0.

As an LCP, finite lower bounds are shifted to 0, variables with only an upper bound are mirrored, free ones are split by
one common extra column, z_F = p - t e (which keeps M positive semidefinite if it is), and a box gets its upper bound as
a row, with a multiplier v: [M I; -I 0]. Fixed variables are left out.
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


@dataclass(eq=False, repr=False)
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

    @property
    def are_parts_of_free(self) -> Mask:
        """Return which unknowns of the LCP are parts of free variables: the p of these, and t."""
        free = self.original.box.free
        of_v = np.zeros(self.problem.n, dtype=bool)
        of_v[: self.kept.size] = np.broadcast_to(free, self.original.n)[self.kept]
        of_v[self.kept.size : self.problem.n - self.boxed.size] = True
        return of_v

    def restricted(self, active: Mask, inactive: Mask) -> tuple[Box, Box] | None:
        """Return the bounds of z, and bounds that ask for the signs of w, if of the unknowns of the LCP those that are
        active have w' = 0, and those that are inactive are 0; None if no z is within such bounds."""
        box, n = self.original.box, self.original.n
        lower, upper = box.vectors(n)
        basic, at_corner, at_upper, below, has_v = np.zeros((5, n), dtype=bool)
        own, v = slice(self.kept.size), slice(self.problem.n - self.boxed.size, None)
        basic[self.kept], at_corner[self.kept] = active[own], inactive[own]
        at_upper[self.boxed], below[self.boxed], has_v[self.boxed] = active[v], inactive[v], True
        at_corner &= ~box.free
        corner = np.broadcast_to(box.corner, n)
        low = np.where(at_upper, upper, np.where(at_corner, corner, lower))
        high = np.where(at_corner, corner, upper)
        if (low > high).any():
            return None
        rises = np.where(has_v, below, basic | np.isinf(upper))  # where w >= 0 is asked for, and where w <= 0 is
        falls = basic | np.isinf(lower)
        return Box(low, high), Box(np.where(falls, -np.inf, 0.0), np.where(rises, np.inf, 0.0))


def standard_form(given: Problem) -> StandardForm:
    """Return the LCP of a problem, itself if it is one; else M is copied once. If all variables are fixed, they count
    as boxed."""
    if not given.is_mixed:
        return StandardForm(given, given, np.arange(given.n), np.arange(0), np.ones(given.n))
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
