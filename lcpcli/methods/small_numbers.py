"""What is left of a problem at a point that solves it but for rows of small numbers, as a problem of its own.

A path ends once z_0 is within rounding of the largest numbers, before numbers decide that are smaller by sixteen
digits, as those of bodies at rest: momenta of 1e-17 beside impulses of 1. At the point z that it finds, M (z + s d) + q
= s (M d + (M z + q) / s): in units s of what is violated this is a problem in d with the bounds (l - z) / s, in which
components far inside their bounds are free, and those with a large w stay where they are.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg.doubles import SIGN_ROUNDING
from lcpcli.linalg.matrices import absolute_product
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

MOST_LEVELS = 3
SMALL = 1e-8  # relative to the largest |q|: violations above this are not those of small numbers
FAR = 1e4  # in units of the violations: distances from bounds, and sizes of w, that stay as they are
NOISE = 1e-10  # in these units: components of z and of w that are rounding of 0


def violations(problem: Problem, z: Vector) -> tuple[Vector, Vector, Mask]:
    """Return how a z within its bounds violates the problem: w = M z + q with 0 in place of what may be rounding of 0,
    the natural residuals of the rows, and in which rows these are more than rounding."""
    w = problem.w(z)
    gaps = np.abs(problem.box.gaps(z, w))
    rounding = SIGN_ROUNDING * (absolute_product(problem.M, np.abs(z)) + np.abs(problem.q))
    return np.where(np.abs(w) <= rounding, 0.0, w), gaps, gaps > rounding


@np.errstate(all="ignore")
def settled(problem: Problem, z: Vector, solve: Callable[[Problem], Vector | None]) -> Vector:
    """Return z with small numbers settled, as far as `solve` finds solutions of what is left."""
    for _ in range(MOST_LEVELS):
        w, gaps, violated = violations(problem, z)
        size = gaps.max(where=violated, initial=0.0)
        if not 0.0 < size <= SMALL * np.abs(problem.q_ref).max():
            break
        try:
            d = solve(_left(problem, z, w, violated, size))
        except ProblemError:
            break
        if d is None or not np.isfinite(d).all():
            break
        z = z + size * d
        z = problem.box.project(np.where(np.abs(z) <= NOISE * size, 0.0, z))
    return z


def _left(problem: Problem, z: Vector, w: Vector, violated: Mask, size: float) -> Problem:
    """Return the problem that is left at z, in units of this size."""
    lower, upper = ((bound - z) / size for bound in problem.box.vectors(problem.n))
    stays = ((lower >= 0.0) & (w > FAR * size)) | ((upper <= 0.0) & (w < -FAR * size))
    lower, upper = np.where(lower < -FAR, -np.inf, lower), np.where(upper > FAR, np.inf, upper)
    is_settled = (np.isinf(lower) & np.isinf(upper) & ~violated) | stays | (np.abs(w) <= NOISE * size)
    q = np.where(is_settled, 0.0, w / size)
    return Problem(problem.M, q, lower=np.where(stays, 0.0, lower), upper=np.where(stays, 0.0, upper))
