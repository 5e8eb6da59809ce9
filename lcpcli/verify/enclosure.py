"""Exact solutions of linear systems near given doubles, proved to exist by floats with bounds on their rounding.

If R is an approximate inverse of B with |I - R B| <= a < 1 in the maximum norm, B is nonsingular, and the c with
B c = -g has |c| <= |R g| + a |c|: S. M. Rump, Verification methods: rigorous results using floating-point arithmetic,
Acta Numerica 19 (2010) 287-449, section 10. For proofs that a linear program is infeasible: C. Keil and C. Jansson,
Computational experience with rigorous error bounds for the Netlib linear programming library, Reliable Computing 12
(2006) 303-321.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.typing import Indices, Vector

LARGEST_ENCLOSED, MOST_WORK = 1000, 2e9  # equations, and their square times the unknowns: a second or so
DEPENDENT = 1e-10  # a last pivot below this times the first one: the equations may depend on each other


def is_enclosable(equations: int, unknowns: int) -> bool:
    """Return whether so many equations in so many unknowns may have an enclosure, which takes at most a second or
    so."""
    return equations <= min(unknowns, LARGEST_ENCLOSED) and equations**2 * unknowns <= MOST_WORK


@np.errstate(all="ignore")
def enclosure(G: Vector, y: Vector) -> Vector | None:
    """Return d >= 0, such that some y' with |y' - y| <= d has G y' = 0 exactly; None if that is not shown.

    G : dense, of shape (k, n). Only k entries of y change, by preference the large ones.
    """
    d = np.zeros(y.size)
    if not G.shape[0]:
        return d
    if not is_enclosable(*G.shape) or not np.isfinite(G).all():
        return None
    rows, columns = _units(np.abs(G).max(axis=1)), 1 / _units(np.abs(y))
    G = rows[:, np.newaxis] * G * columns  # of powers of two, so that nothing is rounded
    chosen = _independent(G)
    if chosen is None:
        return None
    scaled = y / columns
    d[chosen] = regular_change(G[:, chosen], _size(G, scaled)) * columns[chosen]
    return d if np.isfinite(d).all() else None


def change(B: Vector, y: Vector, size: Vector) -> Vector:
    """Return a bound on |c|, where B (y + c) = b exactly, for square B, y without zeros and |B y - b| <= size; infinite
    if none is found."""
    try:
        R = np.linalg.inv(B)
    except np.linalg.LinAlgError:
        return np.full(size.size, np.inf)
    absolute, units, rounding = np.abs(R), np.abs(y), 4 * (y.size + 2)
    off = np.abs(np.eye(y.size) - R @ B) + rounding * (EPS * (absolute @ np.abs(B)) + SMALLEST_NORMAL)
    a, first = 2 * float((off @ units / units).max()), 2 * (absolute @ (size + SMALLEST_NORMAL))
    return first + 2 * a * (first / units).max() * units if a < 0.5 else np.full(size.size, np.inf)


def _size(G: Vector, y: Vector) -> Vector:
    """Return an upper bound on |G y|."""
    size: Vector = np.abs(G @ y) + 4 * (y.size + 2) * (EPS * (np.abs(G) @ np.abs(y)) + SMALLEST_NORMAL)
    return size


def _units(sizes: Vector) -> Vector:
    """Return the powers of two that make sizes about 1; 1 where they are 0."""
    exponents = np.where(sizes > 0, -np.frexp(sizes)[1], 0)
    units: Vector = np.ldexp(1.0, np.clip(exponents, -1000, 1000))
    return units


def _independent(G: Vector) -> Indices | None:
    """Return as many columns as there are rows, far from dependent; None if there are none."""
    with imports:
        from scipy.linalg import qr
    R, chosen = qr(G, mode="r", pivoting=True, check_finite=False)
    pivots = np.abs(R.diagonal())
    return chosen[: G.shape[0]] if pivots[-1] > DEPENDENT * pivots[0] else None


def regular_change(B: Vector, size: Vector) -> Vector:
    """Return a bound on |c|, where B c = -g with |g| <= size; infinite if none is found."""
    k, nothing = size.size, np.full(size.size, np.inf)
    with suppress(np.linalg.LinAlgError):
        R = np.linalg.inv(B)
        absolute, rounding = np.abs(R), 4 * (k + 2)
        terms = absolute @ np.abs(B)
        a = 2 * float((np.abs(np.eye(k) - R @ B) + rounding * (EPS * terms + SMALLEST_NORMAL)).sum(axis=1).max())
        if a < 0.5:
            change = 2 * (absolute @ size + rounding * SMALLEST_NORMAL)
            own: Vector = change + 2 * a * float(change.max())
            return own
    return nothing
