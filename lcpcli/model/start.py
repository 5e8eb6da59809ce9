"""Where a run on a problem starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from lcpcli.errors import ParameterError, ProblemError, count, quoted
from lcpcli.model.arrays import FROM_0, as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

STATES = ("lower", "basic", "upper")


def starting_point(
    problem: Problem, x0: ArrayLike | None, z0: ArrayLike | None, basis: Sequence[str] | None = None
) -> Vector:
    """x0, or the x of z0 and w = M z0 + q, or of states, or the problem's own starting point, or the origin."""
    if basis is not None:
        if x0 is not None or z0 is not None:
            other = "z0" if x0 is None else "x0"
            raise ParameterError("basis", f"gives the starting point, and so does {other}", "leave one out")
        return x_of_states(problem, basis)
    if z0 is not None:
        if x0 is not None:
            raise ParameterError("z0", "gives the starting point, and so does x0", "leave one out")
        z = as_vector("z0", z0, problem.n)
        return as_vector("M z0 + q", problem.box.x_of(z, problem.w(z)))
    if x0 is not None:
        return as_vector("x0", x0, problem.n)
    return np.zeros(problem.n) if problem.x0 is None else problem.x0


def x_of_states(problem: Problem, basis: Sequence[str]) -> Vector:
    """An x with these states, one of STATES for each variable: a bound and w of size one, or z inside the bounds."""
    n = problem.n
    if isinstance(basis, str) or len(basis) != n:
        held = quoted(basis) if isinstance(basis, str) else f"has {count(len(basis), 'entry')} for"
        raise ProblemError("basis", f"{held} {count(n, 'unknown')}", "give one state for each")
    low, high = (np.broadcast_to(bound, n).tolist() for bound in (problem.box.lower, problem.box.upper))
    return np.array([_x_of_state(*each) for each in zip(range(n), basis, low, high, strict=True)])


def _x_of_state(i: int, state: str, low: float, high: float) -> float:
    if state not in STATES:
        shown = quoted(state) if isinstance(state, str) else "no text"
        raise ProblemError(f"basis[{i}]", f"is {shown}", f"write {', '.join(STATES)} {FROM_0}")
    if state == "basic" and low == high:
        raise ProblemError(f"basis[{i}]", "is basic, but that variable is fixed", f"write lower {FROM_0}")
    bound = low if state == "lower" else high
    if state != "basic" and np.isinf(bound):
        raise ProblemError(f"basis[{i}]", f"is {state}, but there is no such bound", f"write another state {FROM_0}")
    if state != "basic":
        return 0.5 * (bound - 1 if state == "lower" else bound + 1)
    if np.isinf(low) or np.isinf(high):
        return 0.5 * (low + 1 if np.isfinite(low) else high - 1 if np.isfinite(high) else 0.0)
    return 0.25 * low + 0.25 * high
