"""Siconos' generalized Newton method on min(z, Mz + q), with a line search on the Fischer-Burmeister function.

At most 1000 iterations, its own limit.
"""

from __future__ import annotations

from lcpcli.peers import Claim, siconos, storage
from lcpcli.problem import Problem

PACKAGE = siconos.PACKAGE


def version() -> str | None:
    return siconos.version()


def excludes(problem: Problem) -> str:
    return storage.not_dense(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:
    return siconos.solve(problem, "SICONOS_LCP_NEWTON_MIN_FBLSA", tol, time_limit)
