"""Proofs that a mixed problem has no z within its bounds whose w has the signs that these ask for.

As in `farkas`, with bounds l <= z <= u: let y_i >= 0 where only l_i is finite (w_i >= 0 is asked for), y_i <= 0 where
only u_i is (w_i <= 0), y_i = 0 where both are (w_i may have either sign), and y_i have any sign where neither is
(w_i = 0). For any such z, 0 <= y'(M z + q) <= q'y + sum_i sup {(M'y)_i t : l_i <= t <= u_i}: if that is negative, there
is none. A problem whose bounds are all finite always has a solution.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.linear_program import linprog
from lcpcli.linalg.matrices import is_sparse, stack
from lcpcli.model.box import Box
from lcpcli.rational import sums
from lcpcli.typing import Indices, Mask, Matrix, Vector
from lcpcli.verify.farkas import ACTIVE, GRID, SNAP, corrected, identity, least_violation

LARGEST_POWER = 1000  # of two, that q is multiplied by


def refutes(M: Matrix, q: Vector, box: Box, y: Vector, asked: Box | None = None) -> bool:
    """Whether y, of shape (n,), is such a proof. True only if it holds without rounding; False proves nothing.

    asked : bounds that ask for other signs of w than the box does: for some states of the variables.

    Floats decide the signs of M'y where they are certain. Columns that have to vanish, as those of free variables,
    which possibly no y in floats satisfies, may be corrected in rational arithmetic, as in `farkas.refutes`.
    """
    if not (np.isfinite(y).all() and y.any() and _has_signs(y, asked or box)):
        return False
    low, high = _sides(box)
    with np.errstate(all="ignore"):
        product = M.T @ y
        slack = np.where(product > 0, np.where(high, box.upper, 0.0), np.where(low, box.lower, 0.0)) * product
        total, terms = float(q @ y + slack.sum()), float(np.abs(q) @ np.abs(y) + np.abs(slack).sum())
        if total > SNAP * terms:
            return False
        size = abs(M).T @ np.abs(y)
        error = 4 * (y.size + 2) * (EPS * size + SMALLEST_NORMAL)
        excess = np.maximum(np.where(high, -np.inf, product), np.where(low, -np.inf, -product))
    if (excess > error + ACTIVE * size).any():
        return False
    support, active = np.flatnonzero(y), np.flatnonzero(excess >= -error - ACTIVE * size)
    exact = [Fraction(value) for value in y[support].tolist()]
    if _holds(M, q, box, support, exact):
        return True
    found = corrected(M, support, exact, active)
    if found is None or not _has_signs(np.array(found[1]), asked or box, found[0]):
        return False
    return _holds(M, q, box, *found)


def _has_signs(y: Any, asked: Box, support: Indices | slice = slice(None)) -> bool:
    """Whether y, on a support, has the signs of multipliers."""
    low, high = (side[support] for side in _sides(asked))
    return not ((y < 0)[low].any() or (y > 0)[high].any())


def _sides(box: Box) -> tuple[Mask, Mask]:
    """Where the lower, and where the upper bound is finite."""
    return np.isfinite(box.lower), np.isfinite(box.upper)


def _holds(M: Matrix, q: Vector, box: Box, support: Indices, y: Sequence[Fraction]) -> bool:
    """Whether the rational y on a support, with the right signs, is a proof."""
    low, high = _sides(box)
    rows, (multiple, _) = M[support], sums.over_one_denominator(y)
    total = sums.product(q[support], multiple)
    for j in _columns(rows):
        value = sums.product(_column(rows, j), multiple)
        if (value > 0 and not high[j]) or (value < 0 and not low[j]):
            return False
        total += value * Fraction(float(box.upper[j] if value > 0 else box.lower[j])) if value else 0
    return total < 0


def _columns(rows: Matrix) -> list[int]:
    """The columns with an entry."""
    used = np.unique(rows.indices) if is_sparse(rows) else np.flatnonzero(rows.any(axis=0))
    columns: list[int] = used.tolist()
    return columns


def candidates(M: Matrix, q: Vector, box: Box, seconds: float = math.inf, asked: Box | None = None) -> Iterator[Vector]:
    """Vectors y that may be proofs, the likeliest first; M should be equilibrated. One or two LPs of half the seconds.

    The first minimises q'y + u'v - l'v' with M'y = v - v', v and v' >= 0, where v_i = 0 if u_i is infinite and v'_i = 0
    if l_i is, over the y with the signs above, from a total of -1 on: its minimum is -1 or 0. If it fails or yields no
    proof, as for problems that are nearly feasible, whose y are large, the second is `farkas.least_violation`.
    """
    low, high = _sides(asked or box)
    positive, negative = np.flatnonzero(~high), np.flatnonzero(~low)  # the y_i that may be positive, negative
    low, high = _sides(box)
    above, below = np.flatnonzero(high), np.flatnonzero(low)
    scale = math.ldexp(1.0, min(-math.frexp(np.abs(q).max())[1], LARGEST_POWER))
    cost = np.concatenate((q[positive], -q[negative], box.upper[above], -box.lower[below])) * scale
    transposed = M.T
    one = identity(M)
    equations = stack([[transposed[:, positive], -transposed[:, negative], -one[:, above], one[:, below]]])
    if not (positive.size or negative.size) or not np.isfinite(cost).all():
        return
    found = linprog(cost, -cost[np.newaxis], np.ones(1), seconds / 2, equal=(equations, np.zeros(q.size)))
    if found is not None:
        if found.fun > -0.5:
            return
        y = np.zeros(q.size)
        y[positive] += found.x[: positive.size]
        y[negative] -= found.x[positive.size : positive.size + negative.size]
        yield from rounded(y)
        yield y
    bounds = scale * box.lower, scale * box.upper
    yield from rounded(least_violation(M, scale * q, _sides(asked or box), bounds, seconds / 2))


def rounded(y: Vector) -> Iterator[Vector]:
    """y without what is small, and what it may be an approximation of: fractions, or integers."""
    largest = float(np.abs(y).max())
    snapped = np.where(np.abs(y) < SNAP * largest, 0.0, y)
    if snapped.any():
        yield snapped
        yield np.rint(GRID * (snapped / largest)) / GRID
        yield np.rint(snapped / np.abs(snapped[snapped != 0]).min())


def _column(A: Matrix, j: int) -> Vector:
    column: Vector = matrices.dense(A[:, [j]])[:, 0]
    return column
