"""Siconos' projected Gauss-Seidel method (C. W. Cryer, The solution of a quadratic programming problem using systematic
overrelaxation, SIAM J. Control 9 (1971) 385-392).

The time limit is the one that counts: its own limit of 1000 sweeps is too small for the tolerances asked here.
"""

from __future__ import annotations

from lcpcli.peers import Claim, siconos, storage
from lcpcli.problem import Problem

PACKAGE = siconos.PACKAGE
SWEEPS = 10**9


def version() -> str | None:
    return siconos.version()


def excludes(problem: Problem) -> str:
    return storage.not_dense(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:
    return siconos.solve(problem, "SICONOS_LCP_PGS", tol, time_limit, SWEEPS)
