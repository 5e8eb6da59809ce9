"""How well an answer satisfies the optimality conditions of the program that a problem was made of.

As qpbenchmark measures it (S. Caron et al., qpbenchmark: Benchmark for quadratic programming solvers available in
Python): the largest violation of a constraint, the largest component of the gradient of the Lagrangian, and the
duality gap; absolutely, and each relative to the largest of its own terms.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import products
from lcpcli.linalg.accurate import accurate_residual
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.reductions.program import Program
from lcpcli.typing import Vector

ABSOLUTE, RELATIVE, NATURAL = "absolute", "relative", "natural"


@np.errstate(over="ignore", invalid="ignore")
def optimality(problem: Problem, z: Vector) -> dict[str, float] | None:
    """The largest of the three residuals, absolute and relative, and the natural residual relative to the terms of w;
    None if the problem is not made of a program, or if z is out of range.

    z = (x, y, s), shape (n,). A multiplier of a bound is w if the bound is near; otherwise w is left over, as a
    residual. w is rounded once, and the gap is the sum of the products of distances and multipliers, which is the
    difference of the objectives without its cancellation.
    """
    if not isinstance(problem.origin, Program):
        return None
    terms = products.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    if not terms.max() < np.inf:
        return None
    M, q, lower, upper = conditions_of(problem)
    w = accurate_residual(M, -z, q)
    outside = np.maximum(np.maximum(lower - z, z - upper), 0.0)
    end = np.where(w > 0, lower, upper)
    slack = np.where(np.isfinite(end), z - end, np.inf)
    taken = np.abs(slack) <= np.maximum(np.abs(z), 1.0)
    left, end = np.where(taken, 0.0, w), np.where(taken, end, 0.0)
    k = problem.origin.variables
    ranges = np.arange(z.size) >= z.size - problem.origin.ranges
    of_rows = (np.arange(z.size) >= k) & ~ranges
    gap = [np.abs(z[:k]) @ products.absolute_product(M[:k, :k], np.abs(z[:k])), np.abs(q) @ np.abs(z), np.abs(w @ end)]
    sizes = (
        (_largest(outside[:k], left[of_rows], outside[ranges]), _largest(terms[of_rows], z[:k], end[:k])),
        (_largest(left[:k], outside[of_rows]), _largest(terms[:k], z[of_rows])),
        (abs(float(w @ (z - end))), float(max(gap))),
    )
    natural = _largest(problem.box.gaps(z, w))
    return {
        ABSOLUTE: max(size for size, _ in sizes),
        RELATIVE: max(_over(*each) for each in sizes),
        NATURAL: _over(natural, float(terms.max())),
    }


def _largest(*parts: Vector) -> float:
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def _over(size: float, terms: float) -> float:
    return size / terms if size else 0.0
