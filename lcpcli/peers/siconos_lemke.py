"""Siconos' Lemke method with the lexicographic minimum ratio test.

It has no tolerance; the driver's check of its answer has.
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
    return siconos.solve(problem, "SICONOS_LCP_LEMKE", tol, time_limit)
