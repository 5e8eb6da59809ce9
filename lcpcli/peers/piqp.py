"""PIQP: R. Schwan, Y. Jiang, D. Kuhn and C. N. Jones, PIQP: a proximal interior-point quadratic programming solver,
62nd IEEE Conference on Decision and Control (2023) 1088-1093.

The tolerance applies to its residuals and to the duality gap: relative, and absolute in units of the largest |q_i|.
It has no time limit, but stops after 250 iterations.
"""

from __future__ import annotations

import numpy as np

from lcpcli import clock
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
    program = quadratic.program_of(problem)
    stored = storage.columns if is_sparse(problem.M) else storage.dense
    began = clock.seconds()
    bounds = {"x_l": program.lower} | ({"x_u": program.upper} if np.isfinite(program.upper).any() else {})
    equal = program.row_lower == program.row_upper
    if equal.any():
        bounds |= {"A": stored(program.A[equal]), "b": program.row_lower[equal]}
    if not equal.all():
        others = program.row_lower[~equal], program.row_upper[~equal]
        bounds |= {"G": stored(program.A[~equal]), "h_l": others[0], "h_u": others[1]}
    solver.setup(stored(program.Q), program.c.copy(), **bounds)
    status = solver.solve()
    seconds = clock.seconds() - began
    found, y = solver.result, np.zeros(equal.size)
    y[equal], y[~equal] = -np.array(found.y), np.array(found.z_l) - np.array(found.z_u)
    return Claim(quadratic.z_of(problem, found.x, y), status == piqp.PIQP_SOLVED, seconds, status.name)
