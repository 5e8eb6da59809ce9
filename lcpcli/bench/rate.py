"""By what factor an iteration of fixed-point shrinks the error, beside what theory says about it."""

from __future__ import annotations

from lcpcli.bench.answer import Curve
from lcpcli.diagnosis.contraction import contraction, measured
from lcpcli.model.modulus import x_of
from lcpcli.model.problem import Problem
from lcpcli.verify.accuracy import size_of_solutions

METHOD = "fixed-point"
LARGEST_ERROR, SMALLEST_ERROR = 1e-2, 1e-9  # errors, relative to the solution, between which the rate is measured
MOST = 400  # unknowns, up to which the theory is evaluated


def of(problem: Problem, curve: Curve) -> dict[str, float] | None:
    """The measured factor, the local one where there is one, and the bound.

    None where the run does not show a rate, where the solution is not the only one known, and beyond MOST unknowns.
    """
    if len(problem.solutions) != 1 or problem.n > MOST:
        return None
    size, z = size_of_solutions(problem), problem.solutions[0]
    errors = [error if error is not None else 0.0 for _, _, error in curve]
    factor = measured([k for k, _, _ in curve], errors, LARGEST_ERROR * size, SMALLEST_ERROR * size)
    theory = contraction(problem, x_of(z, problem.w(z))) if factor is not None else None
    if factor is None or theory is None:
        return None
    local = {} if theory.local is None else {"local": theory.local}
    return {"measured": factor, **local, "bound": theory.bound}
