"""OSQP: B. Stellato, G. Banjac, P. Goulart, A. Bemporad and S. Boyd, OSQP: an operator splitting solver for quadratic
programs, Math. Program. Comput. 12 (2020) 637-672.

The tolerance applies to its primal and dual residuals, absolute and relative. Only time limits it, not iterations.
"""

from __future__ import annotations

import numpy as np

from lcpcli import clock
from lcpcli.interrupts import silence
from lcpcli.model.problem import Problem
from lcpcli.peers import quadratic, storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "osqp"
NO_LIMIT = 2 * 10**9  # iterations
LONGEST = 1e10  # seconds; its own default


def version() -> str | None:
    return distribution_version(PACKAGE)


def excludes(problem: Problem) -> str:
    return storage.not_sparse(problem) or quadratic.not_convex(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:
    osqp = library("osqp")
    from scipy.sparse import eye

    program, solver = quadratic.program_of(problem), osqp.OSQP()
    limits = {"max_iter": NO_LIMIT, "time_limit": min(time_limit, LONGEST)}
    with silence():  # OSQP prints a message when a factorization fails
        began = clock.seconds()
        P, q = storage.upper_triangle(program.Q), program.c.copy()
        A = storage.rows(program.A, eye(q.size))
        lower = np.concatenate((program.row_lower, program.lower))
        upper = np.concatenate((program.row_upper, program.upper))
        try:
            solver.setup(P, q, A, lower, upper, eps_abs=tol, eps_rel=tol, verbose=False, **limits)
            result = solver.solve(raise_error=False)
        except osqp.OSQPException as error:
            return Claim(None, False, clock.seconds() - began, f"refused the problem with error {error}")
        seconds = clock.seconds() - began
    known = osqp.SolverStatus
    if result.info.status_val == known.OSQP_SIGINT:
        raise KeyboardInterrupt  # Ctrl-C, which OSQP has intercepted
    with_z = (
        known.OSQP_SOLVED,
        known.OSQP_SOLVED_INACCURATE,
        known.OSQP_MAX_ITER_REACHED,
        known.OSQP_TIME_LIMIT_REACHED,
    )
    z = None
    if result.info.status_val in with_z:
        z = quadratic.z_of(problem, result.x, -np.array(result.y)[: program.row_lower.size])
    return Claim(z, result.info.status_val == known.OSQP_SOLVED, seconds, result.info.status)
