"""DAQP: D. Arnström, A. Bemporad and D. Axehill, A dual active-set solver for embedded quadratic programming using
recursive LDL' updates, IEEE Trans. Automat. Control 67 (2022) 4362-4369.

A nonsymmetric M is treated as an affine variational inequality, provided that v'Mv >= 0 for all v. The tolerance is
the primal one; the dual tolerance stays at 1e-12.
"""

from __future__ import annotations

import time

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.peers import quadratic, storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "daqp"
INFINITE = 1e30
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
    settings = {
        "is_avi": not matrices.is_symmetric(problem.M),
        "primal_tol": tol,
        "time_limit": min(time_limit, INFINITE),
    }
    began, n = time.perf_counter(), problem.n
    M, q, A = storage.dense(problem.M), problem.q.copy(), np.zeros((0, n))
    (lower, upper), sense = quadratic.bounds(problem, INFINITE), np.zeros(n, dtype=np.int32)
    z, _, flag, _ = daqp.solve(M, q, A, upper, lower, sense, **settings)
    seconds = time.perf_counter() - began
    return Claim(np.array(z), flag == 1, seconds, STATUS.get(flag, f"exit flag {flag}"))
