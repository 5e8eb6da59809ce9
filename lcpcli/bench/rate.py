"""The convergence factor of fixed-point: measured, and from theory."""

from __future__ import annotations

from lcpcli.bench.answer import Curve
from lcpcli.inspection.theory import contraction, measured
from lcpcli.model.problem import Problem

METHOD = "fixed-point"
LARGEST_ERROR, SMALLEST_ERROR = 1e-2, 1e-9  # errors, relative to the solution, between which the rate is measured
MOST = 400  # unknowns up to which the theoretical factors are computed


def of(problem: Problem, curve: Curve) -> dict[str, float] | None:
    """The measured factor, the local one if it exists, and the bound.

    None if the run shows no rate, if several solutions are known, or beyond MOST unknowns.
    """
    if len(problem.solutions) != 1 or problem.n > MOST:
        return None
    size, z = problem.size_of_solutions, problem.solutions[0]
    errors = [error if error is not None else 0.0 for _, _, error in curve]
    factor = measured([k for k, _, _ in curve], errors, LARGEST_ERROR * size, SMALLEST_ERROR * size)
    theory = contraction(problem, problem.box.x_of(z, problem.w(z))) if factor is not None else None
    if factor is None or theory is None:
        return None
    local = {} if theory.local is None else {"local": theory.local}
    return {"measured": factor, **local, "bound": theory.bound}
