"""Proofs that no z within its bounds has w = A z + b with the required signs.

J. Farkas, Theorie der einfachen Ungleichungen, Journal für die reine und angewandte Mathematik 124 (1902) 1-27: either
some z >= 0 has A z + b >= 0, or there is y >= 0 with A'y <= 0 and b'y < 0, and never both, as
0 <= y'(A z + b) = (A'y)'z + b'y.

With bounds l <= z <= u, let y_i >= 0 where w_i >= 0 is asked for, y_i <= 0 where w_i <= 0 is, any y_i where w_i = 0
is, and y_i = 0 where w_i may have either sign. Then 0 <= y'(A z + b) <= b'y + sum_j sup {(A'y)_j t : l_j <= t <= u_j}
for any such z: if the right-hand side is negative, there is none. For a problem, w_i >= 0 is asked for where only l_i
is finite, w_i <= 0 where only u_i is, w_i = 0 where neither is; so if all bounds are finite, there is a solution.

A proof found in floats is accepted only after a check without rounding (D. Applegate, W. Cook, S. Dash and D. Espinoza,
Exact solutions to linear programming problems, Operations Research Letters 35 (2007) 693-699).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.model.box import ORTHANT, Box
from lcpcli.typing import Indices, Mask, Matrix, Vector

if TYPE_CHECKING:
    from fractions import Fraction

ACTIVE_COLUMN = 1e-8  # a column with |A'y| below this times |A|'|y| counts as one with A'y = 0
SNAP = 1e-9  # entries of y below this times the largest one count as 0
NEAR = 1e-6  # of each entry of y: how far the exact proof that it stands for may be from it
LEAST_CANCELLATION = 1e10  # of the terms of a row: six digits of a double are left of their sum
LARGEST_EXACT = 48  # unknowns of the largest linear system that is solved exactly: about a second at worst
LARGEST_BY_FLINT = 400  # the same with FLINT
MOST_BITS = 10_000_000  # the number of entries times the bits of the largest: a second or two


class Sides(NamedTuple):
    """Bounds of n variables, each of shape (n,), and where they are finite."""

    lower: Vector
    upper: Vector
    low: Mask
    high: Mask


def sides(box: Box, n: int) -> Sides:
    """Return the bounds of n variables as vectors."""
    lower, upper = box.vectors(n)
    return Sides(lower, upper, np.isfinite(lower), np.isfinite(upper))


def refutes(A: Matrix, b: Vector, y: Vector, box: Box = ORTHANT, rows: Box | None = None) -> bool:
    """Return whether y proves that no such z exists, for finite A of shape (m, n), b and y (m,). False proves nothing.

    box : the bounds of z. rows : bounds that ask for the signs of w, by default the same: A is then square, or all
    bounds are 0 and infinity.

    True only for a proof that holds without rounding, so never for a system that has a solution:

    - y has its signs, and its exact total, b'y with the suprema, is negative;
    - the exact (A'y)_j is not positive where u_j is infinite, and not negative where l_j is. Floats alone show this
      where the computed value is beyond a bound on its rounding error; the other columns are summed in integers. A
      margin would not do instead: with A'y = delta > 0 there may be a solution of size |b'y| / delta.
    - If only that last test fails, by rounding of y, the proof is y corrected in rational arithmetic: an exact solution
      of A'y = 0 in those columns, on the support of y, has to pass all the tests, or if there is none, as rounding of A
      has made them independent, one with A'y < 0 near y. y itself is then that proof rounded.
      This is tried for at most LARGEST_EXACT columns and entries, or LARGEST_BY_FLINT.
    """
    rows = box if rows is None else rows
    if not (np.isfinite(y).all() and y.any() and _has_signs(y, rows)):
        return False
    bounds = sides(box, A.shape[1])
    with np.errstate(all="ignore"):
        product, size = A.T @ y, abs(A).T @ np.abs(y)
        error = 4 * (y.size + 2) * (EPS * size + SMALLEST_NORMAL)
        supremum = _finite_end(bounds, product) * product
        excess = np.maximum(np.where(bounds.high, -np.inf, product), np.where(bounds.low, -np.inf, -product))
        total, terms = float(b @ y + supremum.sum()), float(np.abs(b) @ np.abs(y) + np.abs(supremum).sum())
        if (excess > error + ACTIVE_COLUMN * size).any() or total > SNAP * terms:
            return False
        certain = (np.abs(product) > error) & (excess < 0) & (_finite_end(bounds, product) == 0)
        active = np.flatnonzero(excess >= -error - ACTIVE_COLUMN * size)
    if _is_near_proof(A, b, y, box, rows):
        return True
    with imports:
        from fractions import Fraction
    support = np.flatnonzero(y)
    exact = [Fraction(value) for value in y[support].tolist()]
    if (excess <= error).all() and _holds(A, b, bounds, support, exact, certain):
        return True
    found = _corrected(A, support, exact, active)
    if found is None or not _has_signs(np.array(found), rows, support):
        return False
    return _holds(A, b, bounds, support, found)


@np.errstate(all="ignore")
def cancellation(A: Matrix, b: Vector, y: Vector, box: Box = ORTHANT) -> float:
    """Return by how much the terms of A z exceed their sum, for every z as above and in some row at least, if A'y has
    wrong signs that may be due to the rounding of A alone; 0 if y shows nothing of that kind, or less than
    LEAST_CANCELLATION.

    For then 0 <= b'y + sum_j (A'y)_j z_j, where the second term is but rounding of its own terms: data that have been
    rounded to doubles do not tell whether there is such a z.
    """
    if not (np.isfinite(y).all() and y.any() and _has_signs(y, box)):
        return 0.0
    of = _Multiplied(A, b, y, box)
    wrong = of.excess > -of.error
    if not (of.excess <= of.y.size * EPS * of.size).all() or not (of.size[wrong] > SMALLEST_NORMAL / EPS).all():
        return 0.0
    total = -of.largest_total(np.ones(of.size.size, dtype=bool), 0.0, of.error, SNAP)
    if not total > 0:
        return 0.0
    # y'(A z) is at least `total`, and at most the terms of b'y more, as A z + b has its signs
    among = total / (total + 2 * float(np.abs(of.b) @ np.abs(of.y) + np.abs(of.supremum).sum()))
    times = float(among * 0.5 / ((of.excess + of.error)[wrong] / of.size[wrong]).max(initial=EPS))
    return times if times >= LEAST_CANCELLATION else 0.0


class _Multiplied:
    """A'y in floats, with bounds on its rounding, on the support of y.

    excess : by how much (A'y)_j is beyond 0 on a side where z_j has no bound, -inf if it has both bounds.
    """

    def __init__(self, A: Matrix, b: Vector, y: Vector, box: Box) -> None:
        self.support, bounds = np.flatnonzero(y), sides(box, A.shape[1])
        self.rows, self.y, self.b = A[self.support], y[self.support], b[self.support]
        product, self.size = self.rows.T @ self.y, abs(self.rows).T @ np.abs(self.y)
        self.used = np.asarray(abs(self.rows).sum(axis=0)).ravel() > 0  # elsewhere A'y is exactly 0
        self.error = 4 * (self.y.size + 2) * (EPS * self.size + SMALLEST_NORMAL) * self.used
        self.excess = np.maximum(np.where(bounds.high, -np.inf, product), np.where(bounds.low, -np.inf, -product))
        self.supremum = _finite_end(bounds, product) * product
        own = (np.where(finite, np.abs(end), 0.0) for end, finite in zip(bounds[:2], bounds[2:], strict=True))
        self.ends = np.maximum(*own)

    def largest_total(self, counted: Mask, change: Vector | float, error: Vector, margin: float = 0.0) -> float:
        """Return an upper bound on the total over some columns, for every y within the change and A'y within the error,
        plus a margin relative to its terms."""
        supremum, rounding = self.supremum[counted], 4 * (self.y.size + self.ends.size + 2)
        terms = np.abs(self.b) @ np.abs(self.y) + np.abs(supremum).sum()
        rest = 2 * ((np.abs(self.b) * change).sum() + self.ends[counted] @ error[counted])
        return float(self.b @ self.y + supremum.sum() + rest + (rounding * EPS + margin) * terms + SMALLEST_NORMAL)


@np.errstate(all="ignore")
def _is_near_proof(A: Matrix, b: Vector, y: Vector, box: Box, rows: Box) -> bool:
    """Return whether floats show that a y' near y is a proof: with A'y' = 0 exactly in the columns where A'y is nearly
    0 or has the wrong sign, as `enclosure` finds, and beyond all bounds on rounding elsewhere."""
    with imports:
        from lcpcli.verify.enclosure import enclosure, is_enclosable
    of = _Multiplied(A, b, y, box)
    is_open = of.used & (of.excess >= -of.error - ACTIVE_COLUMN * of.size)
    if not is_enclosable(int(is_open.sum()), of.y.size):
        return False
    change = enclosure(matrices.dense(of.rows[:, np.flatnonzero(is_open)]).T, of.y)
    if change is None:
        return False
    own = rows.mapped(lambda bound: bound[of.support])
    one_sign = np.isfinite(own.lower) | np.isfinite(own.upper)
    error = of.error + 2 * (abs(of.rows).T @ change)
    if (one_sign & (change > 0) & (np.abs(of.y) <= change)).any():
        return False
    beyond = (of.excess + error < 0) | is_open | ~of.used
    return bool(beyond.all()) and of.largest_total(~is_open, change, error) < 0


@np.errstate(all="ignore")
def is_clear_proof(A: Matrix, b: Vector, y: Vector, box: Box) -> bool:
    """Return whether floats show that y is a proof as it is, beyond all bounds on rounding."""
    of = _Multiplied(A, b, y, box)
    beyond = bool(((of.excess + of.error < 0) | ~of.used).all())
    return beyond and _has_signs(y, box) and of.largest_total(np.ones(of.used.size, dtype=bool), 0.0, of.error) < 0


def _has_signs(y: Any, box: Box, support: Indices | slice = slice(None)) -> bool:
    """Return whether y, on a support, has the signs of multipliers of the rows."""
    own = box.mapped(lambda bound: bound[support])
    low, high = np.isfinite(own.lower), np.isfinite(own.upper)
    return not ((low & (y < 0)).any() or (high & (y > 0)).any())


def _finite_end(bounds: Sides, product: Vector) -> Vector:
    """Return the bounds at which (A'y)_j z_j is largest, 0 where they are infinite."""
    end = np.where(product > 0, bounds.upper, bounds.lower)
    return np.where(np.isfinite(end), end, 0.0)


def _holds(
    A: Matrix,
    b: Vector,
    bounds: Sides,
    support: Indices,
    y: Sequence[Fraction],
    certain: Mask | bool = False,
) -> bool:
    """Return whether the rational y on a support, with the right signs, is a proof, in exact arithmetic; certain :
    columns that certainly have the right sign and add nothing to the total."""
    with imports:
        from fractions import Fraction

        from lcpcli.rational import numbers
    rows, (multiple, _) = A[support], numbers.over_one_denominator(y)
    total = numbers.product(b[support], multiple)
    used = np.zeros(rows.shape[1], dtype=bool)
    used[rows.indices if matrices.is_sparse(rows) else rows.any(axis=0)] = True
    for j in np.flatnonzero(used & np.logical_not(certain)).tolist():
        value = numbers.product(matrices.dense(rows[:, [j]])[:, 0], multiple)
        if (value > 0 and not bounds.high[j]) or (value < 0 and not bounds.low[j]):
            return False
        end = float(bounds.upper[j] if value > 0 else bounds.lower[j])
        total += value * Fraction(end) if value and end else 0
    return total < 0


def _corrected(A: Matrix, support: Indices, y: Sequence[Fraction], active: Indices) -> list[Fraction] | None:
    """Return y on its support, `corrected` in the active columns of A, where A'y is likeliest to be 0."""
    with imports:
        from lcpcli.rational import numbers
    part = matrices.dense(A[support][:, active])
    part = part[:, part.any(axis=0)]
    if not part.size or max(part.shape) > most_exact() or not np.isfinite(part).all():
        return None
    if remaining() <= 0:
        raise TimeIsUp
    rows, _ = numbers.row_integers(part.T)
    return corrected(rows, y) if is_short(rows) else None


def corrected(A: Sequence[Sequence[int]], y: Sequence[Fraction]) -> list[Fraction] | None:
    """Return y changed, mainly in its large entries, so that A y = 0; if A is nonsingular, so that A y < 0, provided
    that y is such a vector but for rounding. None if none is found."""
    with imports:
        from lcpcli.rational import elimination
    order = sorted(range(len(y)), key=lambda k: -abs(y[k]))  # large entries best absorb a correction
    rows, values = [[row[k] for k in order] for row in A], [y[k] for k in order]
    is_singular = len(rows) != len(order) or not elimination.is_nonsingular(rows)
    found = elimination.null_vector(rows, values) if is_singular else _beyond(rows, values)
    return None if found is None else [value for _, value in sorted(zip(order, found, strict=True))]


def _beyond(rows: Sequence[Sequence[int]], y: Sequence[Fraction]) -> list[Fraction] | None:
    """Return a vector with A'y < 0 in the columns of a nonsingular part of A, the rows here, if it is y but for
    rounding: where they are nearly dependent, it is nearly their null vector, whose sign rounding of A decides."""
    with imports:
        from fractions import Fraction

        from lcpcli.rational import elimination
    terms = [sum(abs(value * factor) for value, factor in zip(row, y, strict=True)) for row in rows]
    common = max(term.denominator for term in terms)
    found = elimination.solve(rows, [int(-term * common) for term in terms]).x
    if found is None:
        return None
    k = max(range(len(y)), key=lambda i: abs(y[i]))
    factor = y[k] / found[k] if found[k] else Fraction(0)
    close = all(abs(factor * value - own) <= Fraction(NEAR) * abs(own) for value, own in zip(found, y, strict=True))
    return [factor * value for value in found] if factor > 0 and close else None


def is_short(A: Sequence[Sequence[int]]) -> bool:
    """Return whether A, of at least one row, is small enough to be solved exactly."""
    with imports:
        from lcpcli.rational import elimination
    return max(len(A), len(A[0])) <= most_exact() and len(A) * len(A[0]) * elimination.bits(A) <= MOST_BITS


def most_exact() -> int:
    """Return the number of unknowns of the largest linear system that is solved exactly."""
    with imports:
        from lcpcli.rational import elimination
    return LARGEST_BY_FLINT if elimination.library() else LARGEST_EXACT
