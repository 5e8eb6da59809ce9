"""Linear programs, solved by HiGHS, in its own package or in scipy, kept from delaying
Ctrl-C and time limits.

And convex quadratic ones, solved by PIQP, where it is installed: R. Schwan, Y. Jiang,
D. Kuhn and C. N. Jones, PIQP: a proximal interior-point quadratic programming solver,
62nd IEEE Conference on Decision and Control (2023) 1088-1093.
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

LIMIT_REACHED = 1  # the status that scipy's result then has
# Rows, as at least FEW_ROWS, times entries: so many take milliseconds, for which Ctrl-C
# may wait as for a thread.
MAX_BRIEF, FEW_ROWS = 3e6, 100
# Of the time that remains, for the solver: if it ends by itself, no thread is left
# behind.
EARLIER = 0.9
# What an iteration of the simplex method usually takes, in seconds, besides for each
# entry and each row and column.
OF_ITERATION, OF_ENTRY, OF_LINE = 1e-5, 5e-9, 4e-8
Pair = tuple[Vector, Vector]
TOLERANCES = {
    "primal_feasibility_tolerance": 1e-10,
    "dual_feasibility_tolerance": 1e-10,
}


def _limits(A: Matrix, effort: float, name: str) -> dict[str, float]:
    """Return the options for the limits: the iterations, under this name, and the time
    that remains."""
    limits, seconds = dict[str, float](), max(EARLIER * remaining(), 0.0)
    if seconds < math.inf:
        limits["time_limit"] = seconds
    if effort < math.inf:
        limits[name] = 1 + int(
            effort / (OF_ITERATION + OF_ENTRY * _entries(A) + OF_LINE * sum(A.shape))
        )
    return limits


def _entries(A: Matrix) -> int:
    return int(A.nnz if is_sparse(A) else A.size)


class Optimum(NamedTuple):
    """A minimizer x, the multipliers y of the rows, which are derivatives by their
    bounds, and the minimum."""

    x: Vector
    y: Vector
    value: float


def minimized(
    objective: Vector, A: Matrix, ends: Pair, bounds: Pair, effort: float = math.inf
) -> Optimum | None:
    """Return the minimum of objective'x with row_lower <= A x <= row_upper and lower <=
    x <= upper, if one is found. The solver takes no longer than remains for the run.

    ends, bounds : the pairs row_lower, row_upper and lower, upper; infinite where there
    is no bound. effort : so many iterations are done as usually take so many seconds;
    their number depends on the size of A alone.
    """
    with imports:
        highspy = import_module("highspy") if find_spec("highspy") else None
    run = (
        interruptibly
        if max(A.shape[0], FEW_ROWS) * _entries(A) > MAX_BRIEF
        else lambda call: call()
    )
    if highspy is None:
        found, is_late = _by_scipy(
            run, objective, A, ends, bounds, _limits(A, effort, "maxiter")
        )
    else:
        limits = _limits(A, effort, "simplex_iteration_limit")
        if (
            highs := highs_with(
                highspy, objective, A, ends, bounds, TOLERANCES | limits
            )
        ) is None:
            return None
        run(highs.run)
        status, known, solution = (
            highs.getModelStatus(),
            highspy.HighsModelStatus,
            highs.getSolution(),
        )
        optimum = Optimum(
            np.array(solution.col_value),
            np.array(solution.row_dual),
            highs.getObjectiveValue(),
        )
        found, is_late = (
            optimum if status == known.kOptimal else None,
            status == known.kTimeLimit,
        )
    # Where calls are direct, the solver's limit is the only one.
    if is_late and remaining() <= 0:
        raise TimeIsUp
    return found


def _by_scipy(
    run: Callable[[Callable[[], Any]], Any],
    objective: Vector,
    A: Matrix,
    ends: Pair,
    bounds: Pair,
    limits: Any,
) -> tuple[Optimum | None, bool]:
    """Return the minimum by the HiGHS of scipy, or None, and whether one of these
    limits has ended it."""
    with imports:
        from scipy.optimize import linprog
    low, high = ends
    equal = np.flatnonzero(low == high)
    below, above = (np.flatnonzero(np.isfinite(end) & (low != high)) for end in ends)
    rows = stack([[-A[below]], [A[above]]]), np.concatenate((-low[below], high[above]))
    how = {
        "bounds": np.column_stack(bounds),
        "method": "highs-ds",
        "options": TOLERANCES | limits,
    }
    with np.errstate(all="ignore"):
        found = run(partial(linprog, objective, *rows, A[equal], low[equal], **how))
    if found.status != 0:
        return None, found.status == LIMIT_REACHED
    y = np.zeros(low.size)
    y[equal] = found.eqlin.marginals
    y[below] -= found.ineqlin.marginals[: below.size]
    y[above] += found.ineqlin.marginals[below.size :]
    return Optimum(found.x, y, float(found.fun)), False


def highs_with(
    highspy: Any,
    c: Vector,
    A: Matrix,
    ends: Pair,
    bounds: Pair,
    options: Mapping[str, Any],
    lower_triangle: Any = None,
) -> Any:
    """Return HiGHS with a program, the lower triangle of whose Hessian is sparse or
    None; None if it is refused."""
    with imports:
        from scipy.sparse import csc_array
    highs, model = (
        solver(highspy, {"output_flag": False} | dict(options)),
        highspy.HighsModel(),
    )
    lp, hessian, columns = model.lp_, model.hessian_, csc_array(A)
    lp.num_row_, lp.num_col_ = columns.shape
    lp.col_cost_, (lp.col_lower_, lp.col_upper_), (lp.row_lower_, lp.row_upper_) = (
        c,
        bounds,
        ends,
    )
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = (
        columns.indptr,
        columns.indices,
        columns.data,
    )
    if lower_triangle is not None:
        triangle = csc_array(lower_triangle)
        hessian.dim_, hessian.format_ = c.size, highspy.HessianFormat.kTriangular
        hessian.start_, hessian.index_, hessian.value_ = (
            triangle.indptr,
            triangle.indices,
            triangle.data,
        )
    return None if highs.passModel(model) == highspy.HighsStatus.kError else highs


def solver(highspy: Any, options: Mapping[str, Any]) -> Any:
    """Return HiGHS with some options, which prints nothing; from version 1.16 on it has
    a banner when callbacks are enabled, before options can be set from outside."""

    class Silent(highspy.Highs):  # type: ignore[misc]
        def enableCallbacks(self) -> None:
            self.setOptionValue("log_to_console", False)
            super().enableCallbacks()

    highs = Silent()
    for name, value in options.items():
        highs.setOptionValue(name, value)
    return highs


class Ended(NamedTuple):
    """How PIQP ended: x, the multipliers of the equations, of the other rows and of the
    bounds, which are the derivatives of the minimum with respect to these, and its
    status, `PIQP_SOLVED` if the tolerance is reached."""

    x: Vector
    of_equations: Vector
    of_rows: Vector
    of_bounds: Vector
    status: str


@cache
def has_piqp() -> bool:
    """Return whether PIQP is installed, and QDLDL, which tells how much work it has,
    without loading them."""
    with imports:
        return all(map(find_spec, ("piqp", "qdldl")))


def convex_minimum(
    Q: Any,
    c: Vector,
    equations: tuple[Any, Vector],
    rows: tuple[Any, Vector, Vector],
    bounds: tuple[Vector, Vector],
    tol: float,
    most_steps: int = 250,
    most_gap: float | None = None,
) -> Ended:
    """Minimize x'Qx / 2 + c'x with A x = b, low <= G x <= high and lower <= x <= upper.

    Q, equations, rows, bounds : Q; A, b; G, low, high; lower, upper. The matrices are
        all dense, or all csc_matrices.
    tol : for PIQP's residuals and the duality gap: relative, and absolute in units of
        the largest |c_i| and |b_i|.
    most_steps : by default PIQP's own limit; it has no limit of time, and cannot be
        interrupted.
    most_gap : the tolerance of the duality gap, by default `tol`.
    """
    with imports:
        piqp = import_module("piqp")
    (A, b), (G, low, high), (lower, upper) = equations, rows, bounds
    solver = piqp.DenseSolver() if isinstance(Q, np.ndarray) else piqp.SparseSolver()
    settings = solver.settings
    ends = [v[np.isfinite(v)] for v in (c, b, low, high)]
    largest, gap = (
        max(float(np.abs(v).max(initial=0.0)) for v in ends) or 1.0,
        tol if most_gap is None else most_gap,
    )
    settings.eps_rel, settings.eps_abs = tol, tol * largest
    settings.eps_duality_gap_rel, settings.eps_duality_gap_abs = gap, gap * largest
    settings.max_iter = most_steps
    constraints: dict[str, Any] = {"x_l": lower} | (
        {"x_u": upper} if np.isfinite(upper).any() else {}
    )
    constraints |= {"A": A, "b": b} if b.size else {}
    constraints |= {"G": G, "h_l": low, "h_u": high} if low.size else {}
    solver.setup(Q, c, **constraints)
    status, result = solver.solve(), solver.result
    return Ended(
        np.array(result.x),
        -np.array(result.y),
        np.array(result.z_l) - np.array(result.z_u),
        np.array(result.z_bl) - np.array(result.z_bu),
        str(status.name),
    )
