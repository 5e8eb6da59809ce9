"""QuantEcon.py's Lemke method with the lexicographic minimum ratio test, compiled by numba."""

from __future__ import annotations

import time
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of

import numpy as np

from lcpcli.peers import Claim
from lcpcli.problem import Problem, is_sparse

PACKAGE = "quantecon"


def version() -> str | None:
    try:
        return version_of(PACKAGE)
    except PackageNotFoundError:
        return None


def excludes(problem: Problem) -> str:
    return "takes dense matrices only" if is_sparse(problem.M) else ""


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:  # noqa: ARG001 (a pivoting method has neither)
    from quantecon.optimize import lcp_lemke

    lcp_lemke(np.eye(2), -np.ones(2))  # compiles
    began = time.perf_counter()
    result = lcp_lemke(problem.M, problem.q, max_iter=10**6)
    seconds = time.perf_counter() - began
    return Claim(result.z, bool(result.success), seconds, f"status {result.status}")
