"""The verification of a path in floating point: its breakpoints, and all points between them.

At a breakpoint the criterion of `solve` counts. On a piece z, w, q and the bounds are linear in t. Take for each row i
the terms |q|_i + sum_j |M_ij| |z_j| over those numbers only that do not change their sign on the piece: they are linear
there, and no larger than the terms of the row. So if at both ends what violates the conditions of the states of the
piece is at most the tolerance times these terms, this holds at each point between them, which is then the exact
solution of a problem whose numbers differ by no more than the tolerance, relatively (Oettli and Prager 1964, as in
`verify.measure`).

A breakpoint t is known to a few digits less than those of a double; by as much of the numbers between which they move
q(t) and z(t) may be off, even where they pass through 0. So NEGLIGIBLE of those may be left in each row: of
(1 - s) |q_0| + s |q_1|, and of |M| times the largest |z| of the breakpoint and those beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.doubles import FAR_FROM_ONE, ROW_ROUNDING
from lcpcli.linalg.matrices import absolute_product, is_sparse, product
from lcpcli.linalg.rounding import row_errors
from lcpcli.model.right_hand_sides import Columns
from lcpcli.parametric.family import Family
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.measure import ROUNDING, Measure, Rows
from lcpcli.verify.point import Criterion, Point

MOST_AT_ONCE = 1_000_000  # entries of z that are verified together
NEGLIGIBLE = 2.0**-44  # of other breakpoints: what rounding may leave at a breakpoint


def on_bounds(family: Family, s: Vector, z: Vector, states: Indices) -> Vector:
    """Return the z of breakpoints, shape (m, n), with each component exactly at the bound where it is on a piece beside
    it, and within its bounds elsewhere; states : shape (m - 1, n)."""
    low, high = family.bounds(s[:, np.newaxis])
    before, after = _beside(states)
    z = np.clip(z, low, high)
    z = np.where((before < 0) | (after < 0), low, z)
    return np.where((before > 0) | (after > 0), high, z)


def _beside(pieces: Any) -> tuple[Any, Any]:
    """Return for each breakpoint the row of the piece before it and of that after it; at the ends both are the same."""
    if not len(pieces):
        nothing = np.zeros((1, pieces.shape[1]), dtype=pieces.dtype)
        return nothing, nothing
    return np.concatenate((pieces[:1], pieces)), np.concatenate((pieces, pieces[-1:]))


def verify(family: Family, t: Vector, z: Vector, states: Indices, tol: float) -> tuple[Vector, bool]:
    """Return w = M z + q at the breakpoints, shape (m, n), and whether breakpoints and pieces are verified. A z that is
    no solution is replaced by one that differs from it by rounding, if there is one."""
    s = family.share(t)
    Q = family.q(s[:, np.newaxis])
    w, verified = np.empty(z.shape), True
    size = max(MOST_AT_ONCE // z.shape[1], 2)
    for first in range(0, max(t.size - 1, 1), size):
        check()
        some = slice(first, first + size + 1)
        part = _Part(family, s[some], z[some], Q[some], tol)
        verified &= part.are_solutions()
        w[some] = part.w
        verified &= part.are_pieces(states[first : first + size])
    return w, verified


class _Part:
    """Some breakpoints, m in a row: s, z, q, of shapes (m,), (m, n) and (m, n)."""

    def __init__(self, family: Family, s: Vector, z: Vector, Q: Vector, tol: float) -> None:
        self.family, self.s, self.z, self.Q, self.tol = family, s, z, Q, tol
        self.w, self.sizes = self._products()

    def _products(self) -> tuple[Vector, Vector]:
        """Return M z + q and |M| |z| of each breakpoint, by products with those columns of M only that count."""
        M, z = self.family.problem.M, self.z
        used = z.any(axis=0)
        if not is_sparse(M) and 2 * np.count_nonzero(used) < used.size:
            M, z = M[:, used], z[:, used]
        return product(M, z.T).T + self.Q, absolute_product(M, np.abs(z).T).T

    def are_solutions(self) -> bool:
        """Return whether the breakpoints solve their problems, or do without rounding, which is taken from z."""
        before, left = self.z.copy(), self._left()
        settled = [self._settles(k) for k in left[~self._surely_solve(left)].tolist()]  # each: it may change z
        if not np.array_equal(self.z, before):
            self.w, self.sizes = self._products()
        return all(settled)

    def _left(self) -> Indices:
        """Return the breakpoints for which |q| alone is too small a scale to see that they are solutions."""
        if self.family.is_mixed or not (self.family.problem.is_moderate and self.family.to.is_moderate):
            return np.arange(self.s.size)
        sizes = np.abs(self.Q)
        worst = np.where(self.z > 0, np.abs(self.w), -self.w) + ROW_ROUNDING * (self.sizes + sizes)
        return np.flatnonzero((worst > self.tol * sizes).any(axis=1) | (sizes.min(axis=1) < 1 / FAR_FROM_ONE))

    def _surely_solve(self, some: Indices) -> Mask:
        """Return which of some breakpoints solve their problems by the measure, without a closer look at rounding."""
        if not some.size:
            return np.zeros(0, dtype=bool)
        low, high = 0.0, np.inf
        if self.family.is_mixed:
            low, high = (bound.T for bound in self.family.bounds(self.s[some, np.newaxis]))
        block, z = Columns(self.family.problem.M, self.Q[some].T, low, high).block(0, some.size), self.z[some]
        measure, terms = Measure(block), self.sizes[some] + np.abs(self.Q[some])
        with np.errstate(all="ignore"):
            rows = Rows(self.w[some], terms, terms, row_errors(self.family.problem.M, z, terms))
            own = rows if block.reference_z is None else measure.rows(z, self.w[some])
            return np.asarray(measure.surely_solves(z, own, self.tol) & block.are_moderate)

    def _settles(self, k: int) -> bool:
        """Return whether a breakpoint solves its problem, up to rounding; a z_j at a distance from a bound that is
        rounding beside those of other breakpoints is put there if that helps."""
        family, z = self.family, self.z[k]
        criterion, snapped = Criterion(family.at(family.t_of(self.s[k])), self.tol), z
        box = criterion.problem.box
        for bound in box.vectors(z.size):
            close = np.abs(z - bound) <= NEGLIGIBLE * np.abs(self.z - bound).max(axis=0)
            snapped = np.where(close & np.isfinite(bound), bound, snapped)
        for own in (z, snapped):
            point = Point(criterion, own)
            solution = point.solution()
            if solution is not None and not solution.negligible:
                z[:] = solution.z
                return True
            rows = np.flatnonzero(point.relative_residuals > max(self.tol, ROUNDING))
            if (box.excess(own, point.w)[rows] <= self._rounding(k, rows)).all():
                z[:] = own
                return True
        return False

    def _rounding(self, k: int, rows: Indices) -> Vector:
        """Return what rounding may leave in some rows at a breakpoint."""
        near = np.abs(self.z[max(k - 1, 0) : k + 2]).max(axis=0)
        first, last = (np.abs(problem.q[rows]) for problem in (self.family.problem, self.family.to))
        moved = (1 - self.s[k]) * first + self.s[k] * last
        return np.asarray(NEGLIGIBLE * (absolute_product(self.family.problem.M[rows], near) + moved))

    def are_pieces(self, states: Indices) -> bool:
        """Return whether on each piece both ends satisfy the conditions of its states."""
        keeps, sizes = _keeps_sign(self.z), self.sizes
        if not keeps.all():
            sizes = absolute_product(self.family.problem.M, np.where(keeps, np.abs(self.z), 0.0).T).T
        allowed = max(self.tol, ROUNDING) * (sizes + np.where(_keeps_sign(self.Q), np.abs(self.Q), 0.0))
        w = np.where(self.family.is_fixed, 0.0, self.w)
        for offset in (0, 1):
            ends = slice(offset, len(states) + offset)
            wrong = np.where(states < 0, -w[ends], np.where(states > 0, w[ends], np.abs(w[ends])))
            for k in np.flatnonzero((wrong > allowed[ends]).any(axis=1)).tolist():
                rows = np.flatnonzero(wrong[k] > allowed[ends][k])
                if (wrong[k, rows] > self._rounding(k + offset, rows)).any():
                    return False
        return True


def _keeps_sign(values: Vector) -> Mask:
    """Return where values of breakpoints, shape (m, n), do not have opposite signs at the ends of a piece beside."""
    changes = values[:-1] * values[1:] < 0
    before, after = _beside(changes) if len(changes) else (np.zeros(values.shape, dtype=bool),) * 2
    kept: Mask = ~(before | after)
    return kept
