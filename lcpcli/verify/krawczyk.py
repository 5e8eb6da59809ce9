"""Proofs that a nonlinear problem has a solution near a point, and no other one as near, by interval arithmetic.

With the variables N at bounds held there, z_B solves F_B = 0. If K = z_B - Y F_B(z) + (I - Y J_BB(X)) (X - z_B) lies
inside the box X around z_B, for any Y, then F_B has a zero in K and no other one in X: R. Krawczyk,
Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken, Computing 4 (1969) 187-201; R. E. Moore, A test
for existence of solutions to nonlinear systems, SIAM Journal on Numerical Analysis 14 (1977) 611-615. This zero is the
only solution nearby if X lies between the bounds of z_B and F_N has the strict signs for the bounds of z_N, for all z
in X and near these bounds.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import dense
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.typing import Vector
from lcpcli.verify.error_theorems import Bound

SOURCE = "Krawczyk 1969, the only solution at this distance"
NO_INTERVALS = Bound(math.inf, "F has no evaluation in interval arithmetic")
UNPROVED = Bound(math.inf, "Krawczyk's operator proves no solution nearby, or a component is at a bound with w = 0")
MOST_UNKNOWNS = 1000  # for which Y is formed
ATTEMPTS, GROWTH = 8, 8.0  # boxes that are tried, and how much larger each is


@np.errstate(all="ignore")
def proved_bound(problem: NonlinearProblem, z: Vector) -> Bound:
    """Return a proved bound on |z - z*|_inf to a solution z*, the only one at this distance; infinite if none is
    proved. z : shape (n,), admissible, with what is to be at a bound exactly there."""
    if problem.interval is None:
        return NO_INTERVALS
    box, J = problem.box, problem.interval(z, z).J_lower
    if problem.n > MOST_UNKNOWNS or not np.isfinite(dense(J)).all():
        return UNPROVED
    at_lower, at_upper = (z <= box.lower) & ~box.fixed, (z >= box.upper) & ~box.fixed
    B = (~(at_lower | at_upper | box.fixed)).nonzero()[0]
    try:
        Y = np.linalg.inv(dense(J)[np.ix_(B, B)])
    except np.linalg.LinAlgError:
        return UNPROVED
    point = problem.interval(z, z)
    middle, width = _middle(point.F_lower[B], point.F_upper[B])
    moved = _rounded_up(np.abs(Y @ middle) + _errors(Y, middle, width), B.size)
    radius = 2 * moved + 4 * EPS * np.abs(z[B]) + SMALLEST_NORMAL
    for _ in range(ATTEMPTS):
        most = float(radius.max(initial=SMALLEST_NORMAL))
        if not most < math.inf:
            break
        low, high = z.copy(), z.copy()
        low[B], high[B] = z[B] - radius, z[B] + radius
        low[at_upper], high[at_lower] = z[at_upper] - most, z[at_lower] + most
        ends = np.where(low < z, np.nextafter(low, -np.inf), low), np.where(high > z, np.nextafter(high, np.inf), high)
        found, widths = problem.interval(*ends), np.nextafter(np.maximum(ends[1] - z, z - ends[0]), np.inf)
        J_middle, J_width = _middle(dense(found.J_lower)[np.ix_(B, B)], dense(found.J_upper)[np.ix_(B, B)])
        rest = np.abs(np.eye(B.size) - Y @ J_middle) + _errors(Y, J_middle, J_width) + EPS
        reached = _rounded_up(moved + rest @ widths[B], 2 * B.size)
        if (reached < radius).all():
            inside = (ends[0][B] > box.lower[B]).all() and (ends[1][B] < box.upper[B]).all()
            strict = (found.F_lower[at_lower] > 0).all() and (found.F_upper[at_upper] < 0).all()
            return Bound(float(reached.max(initial=0.0)), SOURCE) if inside and strict else UNPROVED
        radius = GROWTH * np.clip(np.where(np.isfinite(reached), reached, radius), radius, GROWTH * radius)
    return UNPROVED


def _middle(lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """Return midpoints of intervals and bounds on their half widths."""
    middle = lower + (upper - lower) / 2
    return middle, np.nextafter(np.maximum(upper - middle, middle - lower), np.inf)


def _errors(Y: Vector, middle: Vector, width: Vector) -> Vector:
    """Return bounds on the errors of the product of Y with midpoints, from rounding and the half widths."""
    k = 4 * (middle.shape[0] + 2)
    absolute = np.abs(Y)
    bounds: Vector = absolute @ width + k * (EPS * (absolute @ (np.abs(middle) + width)) + SMALLEST_NORMAL)
    return bounds


def _rounded_up(sums: Vector, terms: int) -> Vector:
    """Return upper bounds on sums of so many numbers, none negative, from their values in doubles."""
    bounds: Vector = sums * (1 + 4 * (terms + 4) * EPS)
    return bounds
