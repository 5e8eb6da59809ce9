"""PIQP: R. Schwan, Y. Jiang, D. Kuhn and C. N. Jones, PIQP: a proximal interior-point quadratic programming solver,
62nd IEEE Conference on Decision and Control (2023) 1088-1093.

The tolerance applies to its residuals and to the duality gap: relative, and absolute in units of the largest |q_i|.
It has no time limit, but stops after 250 iterations.
"""

from __future__ import annotations

import time

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.peers import quadratic, storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "piqp"


def version() -> str | None:
    return distribution_version(PACKAGE)


def excludes(problem: Problem) -> str:
    return quadratic.not_convex(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:  # noqa: ARG001 (it has no time limit)
    piqp = library("piqp")
    solver = piqp.SparseSolver() if is_sparse(problem.M) else piqp.DenseSolver()
    settings = solver.settings
    settings.eps_rel = settings.eps_duality_gap_rel = tol
    settings.eps_abs = settings.eps_duality_gap_abs = tol * (float(np.abs(problem.q).max()) or 1.0)
    began = time.perf_counter()
    M = storage.columns(problem.M) if is_sparse(problem.M) else storage.dense(problem.M)
    q, (lower, upper) = problem.q.copy(), quadratic.bounds(problem)
    bounds = {"x_l": lower, "x_u": upper} if problem.is_mixed else {"x_l": lower}
    solver.setup(M, q, **bounds)
    status = solver.solve()
    seconds = time.perf_counter() - began
    return Claim(np.array(solver.result.x), status == piqp.PIQP_SOLVED, seconds, status.name)
