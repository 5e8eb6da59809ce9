"""Rigorous bounds on the distance of any z from the solution, for the data as floats, rounding included.

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

from lcpcli.bounds import comparison, definite
from lcpcli.bounds.neighbour import neighbour
from lcpcli.bounds.rounding import LARGEST_ENTRY, SMALLEST_ENTRY, Theorem, in_range, residual
from lcpcli.linalg.doubles import EPS
from lcpcli.model.arrays import as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector, VectorLike

SOURCES = {
    "comparison": "Chen and Xiang 2006, M is H+",
    "definite": "Mathias and Pang 1990, M is positive definite",
    "symmetrised": "Mathias and Pang 1990, M is positive definite after row scaling",
}


@dataclass(frozen=True)
class Bound:
    """|z - z*|_inf <= value, in the problem's units; infinite if nothing is known.

    source : the theorem, and the class of M that was verified for it.
    """

    value: float
    source: str

    @property
    def proved(self) -> bool:
        return self.value < math.inf


LATE = Bound(math.inf, "the time limit was reached before one was proved")
NO_BOUND = Bound(math.inf, "M is not known to be H+ or positive definite")


@np.errstate(over="ignore", invalid="ignore", divide="ignore", under="ignore")
def error_bound(problem: Problem, z: VectorLike) -> Bound | None:
    """The smallest proved bound on |z - z*|_inf for this M, z* being the unique solution.

    The class of M is verified, not estimated, and all rounding errors are bounded and included. It costs O(n^3) for
    dense M, more than solving; for sparse M a few solves. Sparse M that are not H+ are treated as dense up to
    `definite.LARGEST_DENSE` unknowns.

    Parameters
    ----------
    problem : an LCP or a mixed one, n unknowns; the theorems hold for any bounds.
    z : shape (n,), of any sign.

    Returns
    -------
    The bound; None if M is in neither class or too close to its boundary, or if z or an entry of M is not finite or
    beyond `rounding.LARGEST_ENTRY`, or a nonzero entry of M or of the bounds is below `rounding.SMALLEST_ENTRY`.

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
    if not in_range(problem.M, SMALLEST_ENTRY) or not in_range(given) or _has_tiny_bounds(problem):
        return None
    diagonal = problem.M.diagonal()
    if not diagonal.min() > 0:
        return None
    theorems = definite.theorems(problem)
    h_plus = comparison.theorem(problem)
    if h_plus is not None:
        theorems["comparison"] = h_plus
    if not theorems:
        return None
    y = neighbour(problem, given)
    claims = [_claim(problem, theorems, given, point) for point in (given, y) if point is not None]
    return min((claim for claim in claims if claim is not None), key=lambda claim: claim.value, default=None)


def _has_tiny_bounds(problem: Problem) -> bool:
    """Whether products with distances from the bounds may underflow."""
    sizes = np.abs(np.concatenate(problem.box.vectors(problem.n)))
    return bool(sizes.min(where=sizes != 0, initial=np.inf) < SMALLEST_ENTRY)


def _claim(problem: Problem, theorems: dict[str, Theorem], z: Vector, y: Vector) -> Bound | None:
    """The smallest of the bounds at y, plus the distance from z to y."""
    y = np.where(np.abs(y) < SMALLEST_ENTRY, 0.0, y)
    w = residual(problem, y)
    if w is None:
        return None
    values = {name: theorem(y, w) for name, theorem in theorems.items()}
    best = min(values, key=lambda name: values[name] if values[name] < LARGEST_ENTRY else math.inf)
    way = float(np.abs(z - y).max())
    value = values[best] if way == 0 else (way + values[best]) * (1 + 4 * EPS)
    return Bound(value, SOURCES[best]) if value < LARGEST_ENTRY else None
