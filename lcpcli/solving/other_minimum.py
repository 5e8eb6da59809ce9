"""Whether a convex program has other minimizers than one that is known.

x and x + d are both minimizers if d keeps rows and bounds, and Qd = 0 and c'd = 0: O. L. Mangasarian, A simple
characterization of solution sets of convex programs, Operations Research Letters 7 (1988) 21-26.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.linalg.linear_program import minimized
from lcpcli.linalg.matrices import dense, stack
from lcpcli.model.reductions.program import Program, ProgramData
from lcpcli.solving.result import Result
from lcpcli.typing import Mask, Vector
from lcpcli.verify.point import Criterion, Point

LARGEST = 500  # unknowns: an LP for more would take longer than many a solution
SECONDS = 0.5  # for each of two LPs
APART = 1e-3  # of the largest |x_i|, by which another minimizer has to differ
MOST_FREE = 100  # variables that are not at a bound, for a linear system that is solved exactly in a second


def has_other_minimum(result: Result, data: ProgramData) -> bool:
    """Whether another minimizer is found by an LP and verified as a solution of the conditions, as x was, and whether
    exact arithmetic confirms that there are more than one.
    """
    program, problem = result.problem.origin, result.problem
    assert isinstance(program, Program)
    if problem.n > LARGEST:
        return False
    x, y = program.parts(result.z)
    least = APART * max(1.0, float(np.abs(x).max()))
    along = np.random.default_rng(x.size).standard_normal(x.size)  # ±1 may be orthogonal to the minimizers
    for objective in (along, -along):
        other = _farthest(objective, x, data)
        if other is None or not np.abs(other - x).max() > least:
            continue
        z = program.z_of(other, y, data)
        if Point(Criterion(problem, result.tol), z).solves():
            return _may_move((x + other) / 2, data)
    return False


def _may_move(x: Vector, data: ProgramData) -> bool:
    """Whether Qd = 0, c'd = 0 and the active rows and bounds at x leave a d that is not 0, for the decimals of the data
    in rational arithmetic. Then no rounding makes x one of several minimizers."""
    from lcpcli.rational import linear
    from lcpcli.rational.numbers import over_one_denominator, shortest_decimal
    from lcpcli.rational.problem import rows_of

    free = np.flatnonzero(~_active(x, data.lower, data.upper))
    rows = np.flatnonzero(_active(data.A @ x, data.row_lower, data.row_upper))
    if not 0 < free.size <= MOST_FREE:
        return False
    parts = (dense(data.Q)[:, free], data.c[np.newaxis, free], dense(data.A[rows])[:, free])
    system = [row for part in parts for row in rows_of(part, shortest_decimal) if row]
    whole = [over_one_denominator([row.get(j, Fraction(0)) for j in range(free.size)])[0] for row in system]
    return len(whole) < free.size or bool(linear.solve(whole, [0] * len(whole)).null_space)


def _active(values: Vector, low: Vector, high: Vector) -> Mask:
    """Which values are at an end, to the tolerance by which a point is told from another."""
    near = APART**2 * np.maximum(1.0, np.abs(values))
    active: Mask = (values - low <= near) | (high - values <= near)
    return active


def _farthest(objective: Vector, x: Vector, data: ProgramData) -> Vector | None:
    """The minimizer with the least objective'x among those that differ by at most about |x|."""
    reach = 1.0 + np.abs(x).max()
    low, high = np.maximum(data.lower - x, -reach), np.minimum(data.upper - x, reach)
    Ax, nothing = data.A @ x, np.zeros(x.size + 1)
    rows = stack([[data.Q], [data.c[np.newaxis]], [data.A]])
    ends = tuple(np.concatenate((nothing, end - Ax)) for end in (data.row_lower, data.row_upper))
    bounds = np.minimum(low, 0.0), np.maximum(high, 0.0)
    found = minimized(objective, rows, (np.minimum(ends[0], 0.0), np.maximum(ends[1], 0.0)), bounds, SECONDS)
    return None if found is None else np.clip(x + found.x, data.lower, data.upper)
