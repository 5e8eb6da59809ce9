"""How well an answer satisfies the optimality conditions of the program that a problem was made of.

As qpbenchmark measures it (S. Caron et al., qpbenchmark: Benchmark for quadratic programming solvers available in
Python): the largest violation of a constraint, the largest component of the gradient of the Lagrangian, and the
duality gap; absolutely, and each relative to its own terms.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import are_moderate
from lcpcli.linalg.matrices import accurate_residual, is_sparse
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.reductions.program import Conditions, Program
from lcpcli.typing import Vector

ABSOLUTE, RELATIVE, NATURAL = "absolute", "relative", "natural"
LEAST_TERMS = 1e-6  # of the largest of the three: below that, terms are 0 but for rounding


@np.errstate(over="ignore", invalid="ignore")
def optimality(problem: Problem, z: Vector | None) -> dict[str, float] | None:
    """The largest of the three residuals, absolute and relative, and the natural residual relative to the terms of w;
    None if the problem is not made of a program, and empty if there is no z, or numbers are out of range.

    z = (x, y, s), shape (n,). A multiplier of a bound is w if the bound is near; otherwise w is left over, as a
    residual. w is rounded once, and the gap is the sum of the products of distances and multipliers, which is the
    difference of the objectives without its cancellation.
    """
    if not isinstance(problem.origin, Program):
        return None
    if z is None or not np.isfinite(z).all():
        return {}
    M, q, lower, upper = conditions_of(problem)
    terms = matrices.absolute_product(M, np.abs(z)) + np.abs(q)
    moderate = all(map(are_moderate, (M.data if is_sparse(M) else M, q, z)))
    w = accurate_residual(M, -z, q) if moderate else problem.w(z)
    residuals, sizes = _residuals(problem.origin, Conditions(M, q, lower, upper), z, w, terms)
    floor = LEAST_TERMS * max(sizes)
    found = {
        ABSOLUTE: max(residuals),
        RELATIVE: max(_over(residual, max(size, floor)) for residual, size in zip(residuals, sizes, strict=True)),
        NATURAL: _over(_largest(problem.box.gaps(z, w)), float(terms.max()) or max(sizes)),
    }
    return found if np.isfinite(list(found.values())).all() else {}


def _residuals(
    origin: Program, given: Conditions, z: Vector, w: Vector, terms: Vector
) -> tuple[list[float], list[float]]:
    """Primal and dual residual and duality gap, and the largest terms of each."""
    M, q, lower, upper = given
    outside = np.maximum(np.maximum(lower - z, z - upper), 0.0)
    end = np.where(w > 0, lower, upper)
    slack = np.where(np.isfinite(end), z - end, np.inf)
    near = np.abs(slack) <= np.maximum(np.abs(z), 1.0)
    left, end = np.where(near, 0.0, w), np.where(near, end, 0.0)
    k = origin.variables
    ranges = np.arange(z.size) >= z.size - origin.ranges
    rows = (np.arange(z.size) >= k) & ~ranges
    curvature = np.abs(z[:k]) @ matrices.absolute_product(M[:k, :k], np.abs(z[:k]))
    residuals = (
        _largest(outside[:k], left[rows], outside[ranges]),
        _largest(left[:k], outside[rows]),
        abs(float(w @ (z - end))),
    )
    sizes = (
        _largest(terms[rows], z[:k], end[:k], outside[:k]),
        _largest(terms[:k], z[rows]),
        float(max(curvature, np.abs(q) @ np.abs(z), np.abs(w @ end))),
    )
    return list(residuals), list(sizes)


def _largest(*parts: Vector) -> float:
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def _over(size: float, terms: float) -> float:
    return 0.0 if size == 0 else size / terms if terms else np.inf
