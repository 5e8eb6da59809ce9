"""Linear programs, solved by HiGHS from its package or from scipy, such that Ctrl-C and
time limits take effect without delay; and convex quadratic programs, solved by PIQP if
it is installed.

R. Schwan, Y. Jiang, D. Kuhn and C. N. Jones, PIQP: a proximal interior-point quadratic
programming solver, 62nd IEEE Conference on Decision and Control (2023) 1088-1093.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache, partial
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, interruptibly, remaining
from lcpcli.linalg.matrices import is_sparse, stack
from lcpcli.typing import Matrix, Vector

LIMIT_REACHED = 1  # scipy's status when a limit on iterations or time is reached
# Rows (at least MIN_COUNTED_ROWS) times entries of A up to which a solver takes
# milliseconds: a thread that Ctrl-C can interrupt would delay it as much.
MAX_UNINTERRUPTED_WORK, MIN_COUNTED_ROWS = 3e6, 100
# Fraction of the remaining time that is passed to the solver as its limit: it then
# stops before the run does, and no thread continues afterwards.
EARLIER = 0.9
# The usual time of an iteration of the simplex method in seconds: a constant, and
# additional times for each entry and for each row or column of A.
OF_ITERATION = 1e-5
OF_ENTRY = 5e-9
OF_LINE = 4e-8
Pair = tuple[Vector, Vector]
TOLERANCES = {
    "primal_feasibility_tolerance": 1e-10,
    "dual_feasibility_tolerance": 1e-10,
}


def _limits(A: Matrix, max_seconds: float, name: str) -> dict[str, float]:
    """Return the options of HiGHS for its limits: the time that remains, and the number
    of iterations under this name, as many as usually take `max_seconds`.
    """
    limits, seconds = dict[str, float](), max(EARLIER * remaining(), 0.0)
    if seconds < math.inf:
        limits["time_limit"] = seconds
    if max_seconds < math.inf:
        limits[name] = 1 + int(
            max_seconds
            / (OF_ITERATION + OF_ENTRY * _entries(A) + OF_LINE * sum(A.shape))
        )
    return limits


def _entries(A: Matrix) -> int:
    return int(A.nnz if is_sparse(A) else A.size)


class Optimum(NamedTuple):
    """A minimizer x of a linear program, the multipliers y of its rows, which are the
    derivatives of the minimum with respect to their bounds, and the minimum.
    """

    x: Vector
    y: Vector
    value: float


def minimized(
    objective: Vector,
    A: Matrix,
    row_bounds: Pair,
    bounds: Pair,
    max_seconds: float = math.inf,
) -> Optimum | None:
    """Return the minimum of objective'x subject to row_lower <= A x <= row_upper and
    lower <= x <= upper; None if there is none, or if the solver reaches its iteration
    limit. It raises TimeIsUp when the time of the run is over.

    row_bounds, bounds : the pairs row_lower, row_upper and lower, upper; infinite where
        there is no bound.
    max_seconds : a limit on the iterations, as many as usually take this time; their
        number depends on the size of A alone, so that results are reproducible.
    """
    with imports:
        highspy = import_module("highspy") if find_spec("highspy") else None
    run = (
        interruptibly
        if max(A.shape[0], MIN_COUNTED_ROWS) * _entries(A) > MAX_UNINTERRUPTED_WORK
        else lambda call: call()
    )
    if highspy is None:
        optimum_or_none, is_late = _by_scipy(
            run, objective, A, row_bounds, bounds, _limits(A, max_seconds, "maxiter")
        )
    else:
        limits = _limits(A, max_seconds, "simplex_iteration_limit")
        highs = highs_of_program(objective, A, row_bounds, bounds, TOLERANCES | limits)
        if highs is None:
            return None
        run(highs.run)
        status = highs.getModelStatus()
        model_status = highspy.HighsModelStatus
        solution = highs.getSolution()
        optimum = Optimum(
            np.array(solution.col_value),
            np.array(solution.row_dual),
            highs.getObjectiveValue(),
        )
        optimum_or_none = optimum if status == model_status.kOptimal else None
        is_late = status == model_status.kTimeLimit
    # If the solver was called without a thread, nothing else checks the time limit.
    if is_late and remaining() <= 0:
        raise TimeIsUp
    return optimum_or_none


def _by_scipy(
    run: Callable[[Callable[[], Any]], Any],
    objective: Vector,
    A: Matrix,
    row_bounds: Pair,
    bounds: Pair,
    limits: Any,
) -> tuple[Optimum | None, bool]:
    """Return the minimum by scipy's HiGHS, or None, and whether it reached one of the
    limits.
    """
    with imports:
        from scipy.optimize import linprog
    low, high = row_bounds
    equal = np.flatnonzero(low == high)
    below, above = (
        np.flatnonzero(np.isfinite(bound) & (low != high)) for bound in row_bounds
    )
    rows = stack([[-A[below]], [A[above]]]), np.concatenate((-low[below], high[above]))
    options = {
        "bounds": np.column_stack(bounds),
        "method": "highs-ds",
        "options": TOLERANCES | limits,
    }
    with np.errstate(all="ignore"):
        scipy_result = run(
            partial(linprog, objective, *rows, A[equal], low[equal], **options)
        )
    if scipy_result.status != 0:
        return None, scipy_result.status == LIMIT_REACHED
    y = np.zeros(low.size)
    y[equal] = scipy_result.eqlin.marginals
    y[below] -= scipy_result.ineqlin.marginals[: below.size]
    y[above] += scipy_result.ineqlin.marginals[below.size :]
    return Optimum(scipy_result.x, y, float(scipy_result.fun)), False


def highs_of_program(
    c: Vector,
    A: Matrix,
    row_bounds: Pair,
    bounds: Pair,
    options: Mapping[str, Any],
    lower_triangle: Any = None,
) -> Any:
    """Return HiGHS loaded with the program min c'x + x'Qx / 2, where `lower_triangle`
    is the lower triangle of a sparse Q, or None for a linear program; None if HiGHS
    rejects it.
    """
    with imports:
        highspy = import_module("highspy")
        from scipy.sparse import csc_array
    highs = solver(highspy, {"output_flag": False} | dict(options))
    model = highspy.HighsModel()
    lp = model.lp_
    hessian = model.hessian_
    columns = csc_array(A)
    lp.num_row_, lp.num_col_ = columns.shape
    lp.col_cost_ = c
    lp.col_lower_, lp.col_upper_ = bounds
    lp.row_lower_, lp.row_upper_ = row_bounds
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_ = columns.indptr
    lp.a_matrix_.index_ = columns.indices
    lp.a_matrix_.value_ = columns.data
    if lower_triangle is not None:
        triangle = csc_array(lower_triangle)
        hessian.dim_, hessian.format_ = c.size, highspy.HessianFormat.kTriangular
        hessian.start_ = triangle.indptr
        hessian.index_ = triangle.indices
        hessian.value_ = triangle.data
    return None if highs.passModel(model) == highspy.HighsStatus.kError else highs


def solver(highspy: Any, options: Mapping[str, Any]) -> Any:
    """Return HiGHS with these options, and without output: from version 1.16 on it
    prints a banner when callbacks are enabled, before options can be set.
    """

    class Silent(highspy.Highs):  # type: ignore[misc]
        def enableCallbacks(self) -> None:
            self.setOptionValue("log_to_console", False)
            super().enableCallbacks()

    highs = Silent()
    for name, value in options.items():
        highs.setOptionValue(name, value)
    return highs


class PiqpResult(NamedTuple):
    """The result of PIQP: x, the multipliers of the equations, of the other rows and of
    the bounds, which are the derivatives of the minimum with respect to these, and its
    status, `PIQP_SOLVED` if the tolerance is reached."""

    x: Vector
    of_equations: Vector
    of_rows: Vector
    of_bounds: Vector
    status: str


@cache
def has_piqp() -> bool:
    """Return whether PIQP is installed, and QDLDL, with which its work is estimated,
    without loading them.
    """
    with imports:
        return all(map(find_spec, ("piqp", "qdldl")))


class ConvexProgram(NamedTuple):
    """The problem to minimize x'Qx / 2 + c'x subject to A x = b, low <= G x <= high and
    lower <= x <= upper.

    equations, rows, bounds : A, b; G, low, high; lower, upper. The matrices are all
        dense, or all csc_matrices.
    """

    Q: Any
    c: Vector
    equations: tuple[Any, Vector]
    rows: tuple[Any, Vector, Vector]
    bounds: tuple[Vector, Vector]


def convex_minimum(
    program: ConvexProgram,
    tol: float,
    max_steps: int = 250,
    max_gap: float | None = None,
) -> PiqpResult:
    """Minimize a convex program by PIQP.

    tol : the tolerance for PIQP's residuals and the duality gap: relative, and absolute
        after division by the largest finite number of c, b, low and high.
    max_steps : PIQP's default limit unless it is set; it has no time limit, and cannot
        be interrupted.
    max_gap : the tolerance of the duality gap, by default `tol`.
    """
    with imports:
        piqp = import_module("piqp")
    Q = program.Q
    c = program.c
    A, b = program.equations
    G, low, high = program.rows
    lower, upper = program.bounds
    solver = piqp.DenseSolver() if isinstance(Q, np.ndarray) else piqp.SparseSolver()
    settings = solver.settings
    finite_numbers = [v[np.isfinite(v)] for v in (c, b, low, high)]
    largest = max(float(np.abs(v).max(initial=0.0)) for v in finite_numbers) or 1.0
    gap = tol if max_gap is None else max_gap
    settings.eps_rel, settings.eps_abs = tol, tol * largest
    settings.eps_duality_gap_rel, settings.eps_duality_gap_abs = gap, gap * largest
    settings.max_iter = max_steps
    constraints: dict[str, Any] = {"x_l": lower} | (
        {"x_u": upper} if np.isfinite(upper).any() else {}
    )
    constraints |= {"A": A, "b": b} if b.size else {}
    constraints |= {"G": G, "h_l": low, "h_u": high} if low.size else {}
    solver.setup(Q, c, **constraints)
    status, result = solver.solve(), solver.result
    return PiqpResult(
        np.array(result.x),
        -np.array(result.y),
        np.array(result.z_l) - np.array(result.z_u),
        np.array(result.z_bl) - np.array(result.z_bu),
        str(status.name),
    )
