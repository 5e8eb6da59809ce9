"""HiGHS, the simplex method for linear and an active-set method for convex quadratic programs: Q. Huangfu and J. A. J.
Hall, Parallelizing the dual revised simplex method, Math. Program. Comput. 10 (2018) 119-142; https://highs.dev.

The tolerance applies to all its optimality conditions; HiGHS accepts none below 1e-10. Its regularization, which adds
1e-7 to the diagonal of M, is switched off, since with it no smaller tolerance could be met.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli import clock
from lcpcli.model.problem import Problem
from lcpcli.model.program import ProgramData
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
    program = quadratic.program_of(problem, highspy.kHighsInf)
    began = clock.seconds()
    accepted = highs.passModel(_model(highspy, program)) != highspy.HighsStatus.kError
    if accepted:
        highs.run()
    seconds = clock.seconds() - began
    if not accepted:
        return Claim(None, False, seconds, "refused the model")
    status, solution = highs.getModelStatus(), highs.getSolution()
    z = None
    if solution.value_valid:
        z = quadratic.z_of(problem, solution.col_value, solution.row_dual[: program.row_lower.size])
    return Claim(z, status == highspy.HighsModelStatus.kOptimal, seconds, highs.modelStatusToString(status))


def _model(highspy: Any, program: ProgramData) -> Any:
    """The program; without any row, with the bounds of x_1 as one, as HiGHS 1.15.1 may otherwise stop at a point that
    is not optimal and call it optimal, even for a small positive definite Q.
    """
    k, m = program.c.size, program.row_lower.size
    model = highspy.HighsModel()
    lp, hessian = model.lp_, model.hessian_
    rows = storage.columns(program.A if m else np.eye(1, k))
    lp.num_col_, lp.num_row_ = k, rows.shape[0]
    lp.col_cost_, lp.col_lower_, lp.col_upper_ = program.c, program.lower, program.upper
    lp.row_lower_ = program.row_lower if m else program.lower[:1]
    lp.row_upper_ = program.row_upper if m else program.upper[:1]
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = rows.indptr, rows.indices, rows.data
    if (program.Q != 0).sum():
        triangle = storage.lower_triangle(program.Q)
        hessian.dim_, hessian.format_ = k, highspy.HessianFormat.kTriangular
        hessian.start_, hessian.index_, hessian.value_ = triangle.indptr, triangle.indices, triangle.data
    return model
