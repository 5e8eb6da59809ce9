"""Clarabel: P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives,
arXiv:2405.12762 (2024).

The tolerance applies to feasibility and to the duality gap, absolute and relative. "AlmostSolved", which refers to
looser tolerances of its own, does not count as solved.
"""

from __future__ import annotations

import time

import numpy as np

from lcpcli.model.problem import Problem
from lcpcli.peers import quadratic, storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "clarabel"


def version() -> str | None:
    return distribution_version(PACKAGE)


def excludes(problem: Problem) -> str:
    return storage.not_sparse(problem) or quadratic.not_convex(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:
    clarabel = library("clarabel")
    from scipy.sparse import eye, vstack

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.time_limit = time_limit
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tol
    began, n = time.perf_counter(), problem.n
    P, q, one, (lower, upper) = storage.upper_triangle(problem.M), problem.q.copy(), eye(n), quadratic.bounds(problem)
    low, high = np.isfinite(lower), np.isfinite(upper)
    A = storage.columns(vstack([-one.tocsr()[low], one.tocsr()[high]]) if problem.is_mixed else -one)
    b = np.concatenate((-lower[low], upper[high]))
    cones = [clarabel.NonnegativeConeT(b.size)]
    solution = clarabel.DefaultSolver(P, q, A, b, cones, settings).solve()
    z = np.array(solution.x)
    seconds = time.perf_counter() - began
    return Claim(z, solution.status == clarabel.SolverStatus.Solved, seconds, str(solution.status))
