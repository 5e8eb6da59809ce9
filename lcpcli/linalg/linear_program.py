"""Linear programs, solved by HiGHS in scipy, which is kept from printing and from delaying Ctrl-C and time limits."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from lcpcli.interrupts import TimeIsUp, interruptibly, remaining, silence
from lcpcli.linalg.matrices import stack
from lcpcli.typing import Matrix, Vector

LIMIT_REACHED = 1  # the status that scipy's result then has
FEW_ENTRIES = 20_000  # so many take milliseconds, for which Ctrl-C may wait: a thread would take as long
EARLIER = 0.9  # of the time that remains, for the solver: if it ends by itself, its output is silenced
TOLERANCES = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def linprog(
    objective: Vector,
    A: Matrix,
    b: Vector,
    seconds: float = math.inf,
    upper: Vector | float = math.inf,
    equal: tuple[Matrix, Vector] | tuple[None, None] = (None, None),
    lower: Vector | float = 0.0,
) -> Any:
    """Minimize objective'x subject to A x <= b, equal, lower <= x <= upper: return scipy's result or None.

    None means that no minimizer was found. The solver takes at most `seconds`, and no more than remain for the run.
    """
    from scipy.optimize import linprog as solve

    bounds = np.column_stack([np.broadcast_to(bound, objective.size) for bound in (lower, upper)])
    seconds = max(min(seconds, EARLIER * remaining()), 0.0)
    options = TOLERANCES | ({"time_limit": seconds} if seconds < math.inf else {})

    def solved() -> Any:
        with np.errstate(all="ignore"):
            return solve(objective, A, b, *equal, bounds=bounds, method="highs-ds", options=options)

    with silence():  # the solver prints if numbers are far from 1
        found = solved() if A.shape[0] * A.shape[1] <= FEW_ENTRIES else interruptibly(solved)
    if found.status == LIMIT_REACHED and remaining() <= 0:  # where calls are direct, the solver's limit is the only one
        raise TimeIsUp
    return found if found.status == 0 else None


class Optimum(NamedTuple):
    """A minimizer x, the multipliers y of the rows, which are the derivatives of the minimum with respect to their
    bounds, and the minimum."""

    x: Vector
    y: Vector
    value: float


def minimized(
    objective: Vector, A: Matrix, ends: tuple[Vector, Vector], bounds: tuple[Vector, Vector], seconds: float = math.inf
) -> Optimum | None:
    """Return the minimum of objective'x with row_lower <= A x <= row_upper and lower <= x <= upper, if one is found.

    ends, bounds : the pairs row_lower, row_upper and lower, upper; infinite where there is no bound.
    """
    low, high = ends
    equal = np.flatnonzero(low == high)
    below, above = (np.flatnonzero(np.isfinite(end) & (low != high)) for end in ends)
    inequalities = stack([[-A[below]], [A[above]]]), np.concatenate((-low[below], high[above]))
    lower, upper = bounds
    found = linprog(objective, *inequalities, seconds, equal=(A[equal], low[equal]), lower=lower, upper=upper)
    if found is None:
        return None
    y = np.zeros(low.size)
    y[equal] = found.eqlin.marginals
    y[below] -= found.ineqlin.marginals[: below.size]
    y[above] += found.ineqlin.marginals[below.size :]
    return Optimum(found.x, y, float(found.fun))
