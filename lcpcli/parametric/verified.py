"""The verification of a path in floating point: its breakpoints, and all points between them.

At a breakpoint the criterion of `solve` counts, but for rows in which z differs from a solution by no more than ROUNDING
of (1 - s) |q_0| + s |q_1|: of that size is the rounding of t and q(t), which may cancel there. On a piece z, w, q and the bounds are linear in t. Take for each row i
the terms |q|_i + sum_j |M_ij| |z_j| over those numbers only that do not change their sign on the piece: they are linear
there, and no larger than the terms of the row. So if at both ends what violates the conditions of the states of the
piece is at most the tolerance times these terms, this holds at each point between them, which is then the exact
solution of a problem whose numbers differ by no more than the tolerance, relatively (Oettli and Prager 1964, as in
`verify.measure`). Rounding of t, z and q may leave ROUNDING of the terms, all of them, with (1 - s) |q_0| + s |q_1| for
q; these are linear, too.
"""

from __future__ import annotations

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.matrices import absolute_product, product
from lcpcli.model.right_hand_sides import Columns
from lcpcli.parametric.family import Family
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.measure import ROUNDING, Measure
from lcpcli.verify.point import Criterion, Point

MOST_AT_ONCE = 4_000_000  # entries of z that are verified together
NEGLIGIBLE = 2.0**-44  # of the distance from a bound at the breakpoints beside: a distance that may be rounding


def on_bounds(family: Family, s: Vector, z: Vector, states: Indices) -> Vector:
    """Return the z of breakpoints, shape (m, n), with each component exactly at the bound where it is on a piece beside
    it, and within its bounds elsewhere; states : shape (m - 1, n)."""
    low, high = np.array([family.bounds(share) for share in s.tolist()]).transpose(1, 0, 2)
    before, after = _beside(states)
    z = np.clip(z, low, high)
    z = np.where((before < 0) | (after < 0), low, z)
    return np.where((before > 0) | (after > 0), high, z)


def _beside(pieces: Vector) -> tuple[Vector, Vector]:
    """Return for each breakpoint the row of the piece before it and of that after it; at the ends both are the same."""
    if not len(pieces):
        nothing = np.zeros((1, pieces.shape[1]), dtype=pieces.dtype)
        return nothing, nothing
    return np.concatenate((pieces[:1], pieces)), np.concatenate((pieces, pieces[-1:]))


def verify(family: Family, t: Vector, z: Vector, states: Indices, tol: float) -> tuple[Vector, bool]:
    """Return w = M z + q at the breakpoints, shape (m, n), and whether breakpoints and pieces are verified. A z that is
    no solution is replaced by one that differs from it by rounding, if there is one."""
    s = np.array([family.share(value) for value in t.tolist()])
    Q = np.array([family.q(share) for share in s.tolist()])
    w, verified = np.empty(z.shape), True
    size = max(MOST_AT_ONCE // z.shape[1], 2)
    for first in range(0, max(t.size - 1, 1), size):
        check()
        part = slice(first, first + size + 1)
        verified &= _breakpoints(family, s[part], z[part], Q[part], tol)
        w[part], terms, rounding = _w_and_terms(family, s[part], z[part], Q[part])
        w_part = np.where(family.is_fixed, 0.0, w[part])
        verified &= _pieces(w_part, np.maximum(tol * terms, ROUNDING * rounding), states[first : first + size])
    return w, verified


def _w_and_terms(family: Family, s: Vector, z: Vector, Q: Vector) -> tuple[Vector, Vector, Vector]:
    """Return w, the terms of each row over the numbers that keep their sign on the pieces beside a breakpoint, and the
    terms with those of q in both problems."""
    M = family.problem.M
    kept, own = (np.where(_keeps_sign(values), np.abs(values), 0.0) for values in (z, Q))
    terms = absolute_product(M, kept.T).T
    ends = np.outer(1 - s, np.abs(family.problem.q)) + np.outer(s, np.abs(family.to.q))
    return product(M, z.T).T + Q, terms + own, terms + ends


def _keeps_sign(values: Vector) -> Mask:
    """Return where values of breakpoints, shape (m, n), do not have opposite signs at the ends of a piece beside."""
    changes = values[:-1] * values[1:] < 0
    before, after = _beside(changes) if len(changes) else (np.zeros(values.shape, dtype=bool),) * 2
    kept: Mask = ~(before | after)
    return kept


def _breakpoints(family: Family, s: Vector, z: Vector, Q: Vector, tol: float) -> bool:
    """Return whether the breakpoints solve their problems, or do without rounding, which is taken from z."""
    low, high = 0.0, np.inf
    if family.problem.is_mixed:
        low, high = np.array([family.bounds(share) for share in s.tolist()]).transpose(1, 2, 0)
    block = Columns(family.problem.M, Q.T, low, high).block(0, s.size)
    measure = Measure(block)
    with np.errstate(all="ignore"):
        sure = measure.surely_solves(z, measure.rows(z), tol) & block.are_moderate
    return all([_settles(family, s[k], z[max(k - 1, 0) : k + 2], z[k], tol) for k in np.flatnonzero(~sure).tolist()])


def _settles(family: Family, s: float, near: Vector, z: Vector, tol: float) -> bool:
    """Return whether a breakpoint solves its problem, up to the rounding of the data there; rounding is taken from z if
    it then does. near : the breakpoint and those beside it, beside whose z_j a z_j may be rounding."""
    criterion, snapped = Criterion(family.at(family.t_of(s)), tol), z
    ends = (1 - s) * np.abs(family.problem.q) + s * np.abs(family.to.q)
    for bound in criterion.problem.box.vectors(z.size):
        close = np.abs(z - bound) <= NEGLIGIBLE * np.abs(near - bound).max(axis=0)
        snapped = np.where(close & np.isfinite(bound), bound, snapped)
    for own in (z, snapped):
        point = Point(criterion, own)
        rows = np.flatnonzero([] if point.solves() else point.relative_residuals > max(tol, ROUNDING))
        if (criterion.problem.box.excess(own, point.w)[rows] <= ROUNDING * ends[rows]).all():
            z[:] = own
            return True
    return False


def _pieces(w: Vector, allowed: Vector, states: Indices) -> bool:
    """Return whether on each piece both ends satisfy the conditions of its states up to what is allowed there."""
    for ends in (slice(0, len(states)), slice(1, len(states) + 1)):
        wrong = np.where(states < 0, -w[ends], np.where(states > 0, w[ends], np.abs(w[ends])))
        if not (wrong <= allowed[ends]).all():
            return False
    return True
