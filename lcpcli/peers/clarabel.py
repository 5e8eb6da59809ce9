"""Clarabel: P. J. Goulart and Y. Chen, Clarabel: an interior-point solver for conic programs with quadratic objectives,
arXiv:2405.12762 (2024).

The tolerance applies to feasibility and to the duality gap, absolute and relative. "AlmostSolved", which refers to
looser tolerances of its own, does not count as solved.
"""

from __future__ import annotations

import numpy as np

from lcpcli import clock
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
    from scipy.sparse import eye

    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.time_limit = time_limit
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tol
    program = quadratic.program_of(problem)
    began, one = clock.seconds(), eye(program.c.size).tocsr()
    low, high = np.isfinite(program.lower), np.isfinite(program.upper)
    equal = program.row_lower == program.row_upper
    below, above = np.isfinite(program.row_lower) & ~equal, np.isfinite(program.row_upper) & ~equal
    A = storage.rows(program.A[equal], -program.A[below], program.A[above], -one[low], one[high])
    ends = -program.row_lower[below], program.row_upper[above], -program.lower[low], program.upper[high]
    b = np.concatenate((program.row_lower[equal], *ends))
    cones = [clarabel.ZeroConeT(int(equal.sum()))] if equal.any() else []
    cones.append(clarabel.NonnegativeConeT(b.size - int(equal.sum())))
    P, q = storage.upper_triangle(program.Q), program.c.copy()
    solution = clarabel.DefaultSolver(P, q, A, b, cones, settings).solve()
    seconds = clock.seconds() - began
    y, dual = np.zeros(equal.size), np.split(np.array(solution.z), np.cumsum([equal.sum(), below.sum(), above.sum()]))
    y[equal] = -dual[0]
    y[below] += dual[1]
    y[above] -= dual[2]
    z = quadratic.z_of(problem, solution.x, y)
    return Claim(z, solution.status == clarabel.SolverStatus.Solved, seconds, str(solution.status))
