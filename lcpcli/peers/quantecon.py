"""QuantEcon.py's Lemke method with the lexicographic minimum ratio test, compiled by numba.

It has no tolerance and no time limit.
"""

from __future__ import annotations

import numpy as np

from lcpcli import clock
from lcpcli.model.problem import Problem
from lcpcli.peers import storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "quantecon"
STATUS = {0: "solved", 1: "iteration limit", 2: "ray"}


def version() -> str | None:
    return distribution_version(PACKAGE)


def excludes(problem: Problem) -> str:
    return storage.bounded(problem) or storage.not_dense(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:  # noqa: ARG001 (this pivoting method has neither)
    lcp_lemke = library("quantecon.optimize").lcp_lemke
    # a first call compiles it for writable arrays in row-major order, as M and q are
    lcp_lemke(np.eye(2), -np.ones(2), max_iter=10**6)
    began = clock.seconds()
    M, q = storage.dense(problem.M), problem.q.copy()
    result = lcp_lemke(M, q, max_iter=10**6)
    seconds = clock.seconds() - began
    return Claim(result.z, bool(result.success), seconds, STATUS.get(result.status, f"status {result.status}"))
