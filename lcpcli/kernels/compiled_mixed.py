"""The compiled form of the first stages of `auto` on mixed problems of few unknowns, by the extra `fast`, with the
kernels that LCPs do not need; to import it takes time as `kernels.compiled` does."""

from __future__ import annotations

import numpy as np

from lcpcli.basis import free_variables, tableau
from lcpcli.kernels.announcement import announced
from lcpcli.kernels.compiled import COVER, judged, rows_of
from lcpcli.linalg.matrices import dense
from lcpcli.methods.direct import DirectAnswer
from lcpcli.methods.lemke import LEAST_REFRESHED
from lcpcli.model.problem import Problem

with announced():
    from lcpcli.kernels.kernels import pivot_blocks
    from lcpcli.kernels.measure_kernels import reference_of, surely_solves
    from lcpcli.kernels.mixed_kernels import given_states, kept, reduced
    from lcpcli.kernels.pivoting_kernels import basic_solution, exponents, path


def mixed(problem: Problem, tol: float) -> DirectAnswer | None:
    """Return the solution of a mixed problem at which newton or Lemke's path ends; None where neither is one beyond
    doubt, or a bound is far from 0."""
    rows, q = rows_of(problem), problem.q
    box = lower, upper = np.ascontiguousarray(problem.lower), np.ascontiguousarray(problem.upper)
    is_solution, reference, t = reference_of(*rows, q, lower, upper)
    if not t.size:
        return None
    if is_solution and surely_solves(*rows, q, lower, upper, tol, reference):
        return DirectAnswer(reference, True, 0)
    steps, z = pivot_blocks(*rows, q, lower, upper, t)
    found = judged(problem, rows, box, z, tol) if z.size else None
    if found is not None:
        return DirectAnswer(found.z, True, steps)
    M = np.ascontiguousarray(dense(problem.M))
    own = kept(M, lower, upper)
    try:
        K, k, d = reduced(M, q, lower, upper, own, *free_variables.scaled(own.A, exponents(own.A)))
    except np.linalg.LinAlgError:
        return None
    steps = min(steps, 0)
    end, pivots, states = path(K, k, d, COVER[: k.size], max(LEAST_REFRESHED, k.size))
    if end != tableau.SOLVED:
        return None
    states = given_states(own, q.size, states)
    found = judged(problem, rows, box, basic_solution(M, q, lower, upper, states), tol, states)
    return None if found is None else DirectAnswer(found.z, True, 1 - steps, "lemke", pivots - steps, found.basis)
