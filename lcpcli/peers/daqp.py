"""DAQP: D. Arnström, A. Bemporad and D. Axehill, A dual active-set solver for embedded quadratic programming using
recursive LDL' updates, IEEE Trans. Automat. Control 67 (2022) 4362-4369.

A nonsymmetric M is treated as an affine variational inequality, provided that v'Mv >= 0 for all v. The tolerance is
the primal one; the dual tolerance stays at 1e-12.
"""

from __future__ import annotations

import numpy as np

from lcpcli import clock
from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.peers import quadratic, storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "daqp"
INFINITE = 1e30
EQUATION = 5  # the sense of a row that is always active
STATUS = {
    2: "soft optimal",
    1: "optimal",
    -1: "infeasible",
    -2: "cycling",
    -3: "unbounded",
    -4: "iteration limit",
    -5: "not convex",
    -6: "initial working set overdetermined",
    -7: "time limit",
}


def version() -> str | None:
    return distribution_version(PACKAGE)


def excludes(problem: Problem) -> str:
    return storage.not_dense(problem) or ("" if quadratic.is_monotone(problem) else "needs v'Mv >= 0 for all v")


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:
    daqp = library("daqp")
    program = quadratic.program_of(problem, INFINITE)
    settings = {
        "is_avi": not matrices.is_symmetric(program.Q),
        "primal_tol": tol,
        "time_limit": min(time_limit, INFINITE),
    }
    began, k = clock.seconds(), program.c.size
    Q, c, A = storage.dense(program.Q), program.c.copy(), storage.dense(program.A)
    lower = np.concatenate((program.lower, program.row_lower))
    upper = np.concatenate((program.upper, program.row_upper))
    sense = np.where((lower == upper) & (np.arange(lower.size) >= k), EQUATION, 0).astype(np.int32)
    x, _, flag, told = daqp.solve(Q, c, A, upper, lower, sense, **settings)
    seconds = clock.seconds() - began
    z = quadratic.z_of(problem, x, -np.array(told["lam"])[k:])
    return Claim(z, flag == 1, seconds, STATUS.get(flag, f"exit flag {flag}"))
