"""Verification of answers from the original M and q, never from what the solver reports."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.bench.timing import NONE, SOLUTION, TimedAnswer
from lcpcli.linalg import matrices
from lcpcli.linalg.accurate import accurate_residual
from lcpcli.linalg.doubles import EPS, are_moderate, is_finite
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem, conditions_of
from lcpcli.model.program import Conditions, Program
from lcpcli.report.wording import finite
from lcpcli.typing import Vector
from lcpcli.verify.digits import MOST_INVERTED, sensitivity
from lcpcli.verify.krawczyk import NonlinearCriterion
from lcpcli.verify.point import Criterion, Point

ABSOLUTE, RELATIVE, NATURAL = "absolute", "relative", "natural"
LEAST_TERMS = 1e-6  # of the largest of the three: smaller terms are mere rounding of the solvers' tolerances


class Checker:
    """Verifies the answers to one problem.

    A claimed solution is accepted if its scaled residual is at most `accept` and the problem is not known to have none.
    The claim is false if even the natural residual, in the problem's own units, exceeds `accept` times the largest term
    of w, in |M| |z| or |q|; in between, the claim is inexact: z meets a common stopping criterion, but small rows may
    have no correct digit. A claim that there is no solution succeeds if that is known, is false if a solution is known,
    and is neither of these if nothing is known.
    """

    def __init__(self, problem: Problem | NonlinearProblem, accept: float) -> None:
        self._nonlinear = None
        if isinstance(problem, NonlinearProblem):
            z = problem.solutions[0] if problem.solutions else problem.x0
            self._nonlinear = NonlinearCriterion(Evaluations(problem), accept)
            problem = self._nonlinear.linearization(z, problem.values(z))
        self._problem, self._accept = problem, accept
        one = len(problem.solutions) == 1 and problem.n <= MOST_INVERTED
        self._sensitivity = sensitivity(problem, problem.solutions[0]) if one else None

    @np.errstate(over="ignore", invalid="ignore")  # overflow counts as infinite
    def check(self, answer: TimedAnswer) -> dict[str, Any]:
        """Return the verified facts on the answer, by their names in a `record.Measurement`.

        `success` is true for an accepted claim, `false_success` for a claim that is wrong by every measure; other
        claims are inexact. Numbers that are not finite are None.
        """
        problem, claimed = self._problem, answer.claim == SOLUTION
        hopeless = problem.verdict in WITHOUT_SOLUTION
        if answer.claim == NONE or answer.z is None:
            false = claimed or (answer.claim == NONE and bool(problem.solutions))
            proved = answer.status in WITHOUT_SOLUTION and not false
            success = answer.claim == NONE and (hopeless or proved)
            return {"success": success, "false_success": false, "optimality": optimality(problem, None)}
        z = np.asarray(answer.z, dtype=np.float64)
        if self._nonlinear:
            F = self._nonlinear.evaluations.problem.values(z)
            if not is_finite(F):
                return {"success": False, "false_success": claimed}
            problem = self._nonlinear.linearization(z, F)  # which z solves if and only if it solves the problem
        point = Point(Criterion(problem), z, is_admissible=False)
        terms = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
        success = claimed and point.scaled_residual <= self._accept and not hopeless
        is_nearly_true = point.residual <= self._accept * float(terms.max(initial=0.0)) < np.inf and not hopeless
        error = problem.error(z)
        numbers = {"residual": point.residual, "scaled_residual": point.scaled_residual, "error": error}
        if self._sensitivity and error is not None:
            numbers["condition"] = self._sensitivity / problem.size_of_solutions
            numbers["forward_error"] = error / EPS / self._sensitivity
        found = {name: finite(value) for name, value in numbers.items()}
        false = claimed and not success and not is_nearly_true
        return {"success": success, "false_success": false, "optimality": optimality(problem, z), **found}


@np.errstate(over="ignore", invalid="ignore")
def optimality(problem: Problem, z: Vector | None) -> dict[str, float] | None:
    """Return how well an answer satisfies the optimality conditions of the problem's program.

    The measures are the largest violation of a constraint, component of the gradient of the Lagrangian, or duality gap,
    absolute and relative to its own terms, and the natural residual relative to the terms of w. The result is None if
    the problem is not made from a program, and empty if there is no z, or if numbers are out of range.

    The measures follow qpbenchmark (S. Caron et al., qpbenchmark: Benchmark for quadratic programming solvers available
    in Python). z = (x, y, s), shape (n,). The multiplier of a bound is w if the bound is near; otherwise w is left
    over, as a residual. w is rounded once, and the gap is the sum of the products of distances and multipliers, which
    is the difference of the objectives without its cancellation.
    """
    if not isinstance(problem.origin, Program):
        return None
    if z is None or not np.isfinite(z).all():
        return {}
    given = conditions_of(problem)
    M, q = given.M, given.q
    terms = matrices.absolute_product(M, np.abs(z)) + np.abs(q)
    moderate = all(map(are_moderate, (M.data if is_sparse(M) else M, q, z)))
    w = accurate_residual(M, -z, q) if moderate else problem.w(z)
    residuals, sizes = _residuals(problem.origin, given, z, w, terms)
    floor = LEAST_TERMS * max(sizes)
    found = {
        ABSOLUTE: max(residuals),
        RELATIVE: max(_over(residual, max(size, floor)) for residual, size in zip(residuals, sizes, strict=True)),
        NATURAL: _over(_largest(problem.box.gaps(z, w)), float(terms.max(initial=0.0)) or max(sizes)),
    }
    return found if np.isfinite(list(found.values())).all() else {}


def _residuals(
    origin: Program, given: Conditions, z: Vector, w: Vector, terms: Vector
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the primal and the dual residual and the duality gap, and the largest terms of each."""
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
    return residuals, sizes


def _largest(*parts: Vector) -> float:
    return max(float(np.abs(part).max(initial=0.0)) for part in parts)


def _over(size: float, terms: float) -> float:
    return 0.0 if size == 0 else size / terms if terms else np.inf
