"""Linear programs, solved by HiGHS, which is kept from delaying Ctrl-C and time limits: in its own package where it is
installed, else in scipy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, interruptibly, remaining
from lcpcli.linalg.matrices import is_sparse, stack
from lcpcli.typing import Matrix, Vector

LIMIT_REACHED = 1  # the status that scipy's result then has
FEW_ENTRIES = 20_000  # so many take milliseconds, for which Ctrl-C may wait: a thread would take as long
EARLIER = 0.9  # of the time that remains, for the solver: if it ends by itself, no thread is left behind
# What an iteration of the simplex method usually takes, in seconds, besides for each entry and each row and column.
OF_ITERATION, OF_ENTRY, OF_LINE = 1e-5, 5e-9, 4e-8
Pair = tuple[Vector, Vector]
TOLERANCES = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def linprog(
    objective: Vector,
    A: Matrix,
    b: Vector,
    effort: float = math.inf,
    upper: Vector | float = math.inf,
    equal: tuple[Matrix, Vector] | tuple[None, None] = (None, None),
    lower: Vector | float = 0.0,
) -> Any:
    """Minimize objective'x subject to A x <= b, equal, lower <= x <= upper: return scipy's result or None.

    None means that no minimizer was found. The solver takes no longer than remains for the run.

    effort : so many iterations are done as usually take so many seconds; their number depends on the size of A alone.
    """
    with imports:
        from scipy.optimize import linprog as solve
    bounds = np.column_stack([np.broadcast_to(bound, objective.size) for bound in (lower, upper)])
    options = TOLERANCES | _limits(A, effort, "maxiter")

    def solved() -> Any:
        with np.errstate(all="ignore"):
            return solve(objective, A, b, *equal, bounds=bounds, method="highs-ds", options=options)

    found = solved() if A.shape[0] * A.shape[1] <= FEW_ENTRIES else interruptibly(solved)
    if found.status == LIMIT_REACHED and remaining() <= 0:  # where calls are direct, the solver's limit is the only one
        raise TimeIsUp
    return found if found.status == 0 else None


def _limits(A: Matrix, effort: float, name: str) -> dict[str, float]:
    """Return the options for the limits: the iterations, under this name, and the time that remains."""
    limits, seconds = dict[str, float](), max(EARLIER * remaining(), 0.0)
    if seconds < math.inf:
        limits["time_limit"] = seconds
    if effort < math.inf:
        entries = A.nnz if is_sparse(A) else A.size
        limits[name] = 1 + int(effort / (OF_ITERATION + OF_ENTRY * entries + OF_LINE * sum(A.shape)))
    return limits


class Optimum(NamedTuple):
    """A minimizer x, the multipliers y of the rows, which are derivatives by their bounds, and the minimum."""

    x: Vector
    y: Vector
    value: float


def minimized(objective: Vector, A: Matrix, ends: Pair, bounds: Pair, effort: float = math.inf) -> Optimum | None:
    """Return the minimum of objective'x with row_lower <= A x <= row_upper and lower <= x <= upper, if one is found.

    ends, bounds : the pairs row_lower, row_upper and lower, upper; infinite where there is no bound. effort : as for
    `linprog`, to which more is copied than to HiGHS in its own package.
    """
    with imports:
        highspy = import_module("highspy") if find_spec("highspy") else None
    if highspy is not None:
        limits = _limits(A, effort, "simplex_iteration_limit")
        if (highs := highs_with(highspy, objective, A, ends, bounds, TOLERANCES | limits)) is None:
            return None
        highs.run() if A.shape[0] * A.shape[1] <= FEW_ENTRIES else interruptibly(highs.run)
        status, known, solution = highs.getModelStatus(), highspy.HighsModelStatus, highs.getSolution()
        if status == known.kTimeLimit and remaining() <= 0:
            raise TimeIsUp
        found = Optimum(np.array(solution.col_value), np.array(solution.row_dual), highs.getObjectiveValue())
        return found if status == known.kOptimal else None
    low, high = ends
    equal = np.flatnonzero(low == high)
    below, above = (np.flatnonzero(np.isfinite(end) & (low != high)) for end in ends)
    inequalities = stack([[-A[below]], [A[above]]]), np.concatenate((-low[below], high[above]))
    lower, upper = bounds
    found = linprog(objective, *inequalities, effort, equal=(A[equal], low[equal]), lower=lower, upper=upper)
    if found is None:
        return None
    y = np.zeros(low.size)
    y[equal] = found.eqlin.marginals
    y[below] -= found.ineqlin.marginals[: below.size]
    y[above] += found.ineqlin.marginals[below.size :]
    return Optimum(found.x, y, float(found.fun))


def highs_with(
    highspy: Any, c: Vector, A: Matrix, ends: Pair, bounds: Pair, options: Mapping[str, Any], lower_triangle: Any = None
) -> Any:
    """Return HiGHS with a program, the lower triangle of whose Hessian is sparse or None; None if it is refused."""
    with imports:
        from scipy.sparse import csc_array
    highs, model = solver(highspy, {"output_flag": False} | dict(options)), highspy.HighsModel()
    lp, hessian, columns = model.lp_, model.hessian_, csc_array(A)
    lp.num_row_, lp.num_col_ = columns.shape
    lp.col_cost_, (lp.col_lower_, lp.col_upper_), (lp.row_lower_, lp.row_upper_) = c, bounds, ends
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = columns.indptr, columns.indices, columns.data
    if lower_triangle is not None:
        triangle = csc_array(lower_triangle)
        hessian.dim_, hessian.format_ = c.size, highspy.HessianFormat.kTriangular
        hessian.start_, hessian.index_, hessian.value_ = triangle.indptr, triangle.indices, triangle.data
    return None if highs.passModel(model) == highspy.HighsStatus.kError else highs


def solver(highspy: Any, options: Mapping[str, Any]) -> Any:
    """Return HiGHS with some options, which prints nothing; from version 1.16 on it has a banner when callbacks are
    enabled, before options can be set from outside."""

    class Silent(highspy.Highs):  # type: ignore[misc]
        def enableCallbacks(self) -> None:
            self.setOptionValue("log_to_console", False)
            super().enableCallbacks()

    highs = Silent()
    for name, value in options.items():
        highs.setOptionValue(name, value)
    return highs
