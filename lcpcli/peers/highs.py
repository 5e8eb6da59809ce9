"""The active-set solver for convex quadratic programs in HiGHS: Q. Huangfu and J. A. J. Hall, Parallelizing the dual
revised simplex method, Math. Program. Comput. 10 (2018) 119-142; https://highs.dev.

The tolerance applies to all its optimality conditions; HiGHS accepts none below 1e-10. Its regularization, which adds
1e-7 to the diagonal of M, is switched off, since with it no smaller tolerance could be met.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from lcpcli.model.problem import Problem
from lcpcli.peers import quadratic, storage
from lcpcli.peers.registry import Claim, distribution_version, library

PACKAGE = "highspy"
SMALLEST_TOLERANCE = 1e-10


def version() -> str | None:
    return distribution_version(PACKAGE)


def excludes(problem: Problem) -> str:
    return storage.not_sparse(problem) or quadratic.not_convex(problem)


def solve(problem: Problem, tol: float, time_limit: float) -> Claim:
    highspy = library("highspy")
    highs = highspy.Highs()
    options = {
        "output_flag": False,
        "time_limit": time_limit,
        "kkt_tolerance": max(tol, SMALLEST_TOLERANCE),
        "qp_regularization_value": 0.0,
    }
    for name, value in options.items():
        highs.setOptionValue(name, value)
    began = time.perf_counter()
    accepted = highs.passModel(_model(highspy, problem)) != highspy.HighsStatus.kError
    if accepted:
        highs.run()
    seconds = time.perf_counter() - began
    if not accepted:
        return Claim(None, False, seconds, "refused the model")
    status, solution = highs.getModelStatus(), highs.getSolution()
    z = np.array(solution.col_value) if solution.value_valid else None
    return Claim(z, status == highspy.HighsModelStatus.kOptimal, seconds, highs.modelStatusToString(status))


def _model(highspy: Any, problem: Problem) -> Any:
    """The quadratic program, with the bounds of z_1 as a row too.

    Without any row, HiGHS 1.15.1 may stop at a point that is not optimal and call it optimal, even for a small positive
    definite M.
    """
    n, triangle = problem.n, storage.lower_triangle(problem.M)
    model = highspy.HighsModel()
    lp, hessian = model.lp_, model.hessian_
    lp.num_col_, lp.num_row_ = n, 1
    lp.col_cost_, (lp.col_lower_, lp.col_upper_) = problem.q, quadratic.bounds(problem, highspy.kHighsInf)
    lp.row_lower_, lp.row_upper_ = lp.col_lower_[:1], lp.col_upper_[:1]
    lp.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    lp.a_matrix_.start_, lp.a_matrix_.index_ = np.array([0, 1], dtype=np.int32), np.zeros(1, dtype=np.int32)
    lp.a_matrix_.value_ = np.ones(1)
    hessian.dim_, hessian.format_ = n, highspy.HessianFormat.kTriangular
    hessian.start_, hessian.index_, hessian.value_ = triangle.indptr, triangle.indices, triangle.data
    return model
