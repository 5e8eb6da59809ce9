"""Rigorous bounds on the distance of any z from the solution, for the data in doubles, rounding errors included.

X. Chen and S. Xiang, Computation of error bounds for P-matrix linear complementarity problems, Mathematical Programming
106 (2006) 513-525, where M is an H-matrix with positive diagonal (H+). R. Mathias and J.-S. Pang, Error bounds for the
linear complementarity problem with a P-matrix, Linear Algebra and its Applications 132 (1990) 123-136, and J.-S. Pang,
A posteriori error bounds for the linearly-constrained variational inequality problem, Mathematics of Operations
Research 12 (1987) 474-484, where M is positive definite, symmetric or not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lcpcli.linalg.doubles import EPS, sizes
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.model.arrays import as_vector
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector, VectorLike
from lcpcli.verify.error_theorems import LARGEST_ENTRY, SMALLEST_ENTRY, Theorem, in_range, residual, solver, theorems

NEIGHBOUR_REFINEMENTS = 3  # of a basic solution: each gains several digits where the bound is of any use


@dataclass(frozen=True)
class Bound:
    """|z - z*|_inf <= value, in the problem's units; the value is infinite if nothing is known.

    source : the theorem, and the class of M that was verified for it.
    """

    value: float
    source: str

    @property
    def proved(self) -> bool:
        return self.value < math.inf


UNPROVED_IN_TIME = Bound(math.inf, "the time limit was reached before one was proved")
NO_BOUND = Bound(math.inf, "M is not known to be H+ or positive definite")


@np.errstate(all="ignore")
def error_bound(problem: Problem, z: VectorLike) -> Bound | None:
    """Return the smallest proved bound on |z - z*|_inf for this M, z* being the unique solution.

    The class of M is verified, not estimated, and all rounding errors are bounded and included. The cost is O(n^3) for
    dense M, more than that of solving the problem, and a few solves for sparse M. A sparse M that is not H+ is treated
    as dense for up to `error_theorems.MOST_DENSIFIED` unknowns.

    Parameters
    ----------
    problem : an LCP or a mixed problem with n unknowns; the theorems hold for any bounds.
    z : shape (n,), of any sign.

    Returns
    -------
    The bound; None if M is in neither class or too close to the boundary of both, if z or an entry of M is not finite
    or is beyond `LARGEST_ENTRY`, or if a nonzero entry of M or of the bounds is below `SMALLEST_ENTRY`.

    Raises
    ------
    ProblemError : z does not have n numbers.

    Examples
    --------
    >>> from lcpcli import Problem, error_bound
    >>> bound = error_bound(Problem([[2, 1], [1, 2]], [-5, -6]), [1.3333, 2.3333])
    >>> 3e-5 < bound.value < 1e-3, bound.source
    (True, 'Chen and Xiang 2006, M is H+')
    >>> error_bound(Problem([[0, 1], [1, 0]], [-1, 1]), [0, 0]) is None
    True
    """
    if isinstance(z, np.ndarray) and z.dtype.kind == "f" and not np.isfinite(z).all():
        return None
    given = as_vector("z", z, problem.n)
    if not problem.n:
        return Bound(0.0, "M has no entries")
    if not in_range(problem.M, SMALLEST_ENTRY) or not in_range(given) or not problem.M.diagonal().min() > 0:
        return None
    if sizes(np.concatenate(problem.box.vectors(problem.n)))[0] < SMALLEST_ENTRY:
        return None  # products with distances from the bounds may underflow
    known = theorems(problem)
    points = [given, _neighbour(problem, given)] if known else []
    claims = [_claim(problem, known, given, point) for point in points if point is not None]
    return min(filter(None, claims), key=lambda claim: claim.value, default=None)


def _claim(problem: Problem, known: dict[str, Theorem], z: Vector, y: Vector) -> Bound | None:
    """Return the smallest of the bounds at y, plus the distance from z to y."""
    y = np.where(np.abs(y) < SMALLEST_ENTRY, 0.0, y)
    w = residual(problem, y)
    if w is None:
        return None
    values = {source: theorem(y, w) for source, theorem in known.items()}
    best = min(values, key=lambda source: values[source] if values[source] < LARGEST_ENTRY else math.inf)
    way = float(np.abs(z - y).max())
    value = values[best] if way == 0 else (way + values[best]) * (1 + 4 * EPS)
    return Bound(value, best) if value < LARGEST_ENTRY else None


def _neighbour(problem: Problem, z: Vector) -> Vector | None:
    """Return a point y near z at which a bound is sharp, as |z - z*| <= |z - y| + |y - z*|: about the basic solution
    of the states of z - w_i / M_ii, moved within the bounds, which is z* up to rounding if z comes from a solver."""
    basis = problem.box.basis_of(0.5 * (z - problem.w(z) / problem.M.diagonal()))
    y, active = problem.box.nonbasic(basis), np.flatnonzero(basis == BASIC)
    if not active.size:
        return y
    try:
        solve = solver(problem.M[active][:, active])
    except SingularMatrix:
        return None
    for _ in range(NEIGHBOUR_REFINEMENTS):
        left = residual(problem, y)
        if left is None:
            return None
        y[active] -= solve(left[active])
        if not np.isfinite(y).all():
            return None
    return problem.box.project(y)
