"""Where a run on a problem starts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lcpcli.errors import ParameterError, ProblemError, count, kind
from lcpcli.model.arrays import FROM_0, as_vector
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector, VectorLike

STATES = ("lower", "basic", "upper")


def starting_point(
    problem: Problem, x0: VectorLike | None, z0: VectorLike | None, basis: Sequence[str] | None = None
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


@np.errstate(over="ignore", invalid="ignore")
def states_of(problem: Problem, z: Vector, w: Vector) -> list[str]:
    """The state of each variable of a solution z, one of STATES; of fixed ones "lower"."""
    basis = problem.box.basis_of(problem.box.x_of(z, w))
    upper = np.False_ if basis.upper is None else basis.upper
    named: list[str] = np.where(basis.basic, "basic", np.where(upper, "upper", "lower")).tolist()
    return named


def x_of_states(problem: Problem, basis: Sequence[str]) -> Vector:
    """An x with these states, one of STATES for each variable: a bound and w of size one, or z inside the bounds."""
    n = problem.n
    if not isinstance(basis, (list, tuple, np.ndarray)):
        raise ProblemError("basis", f"is {kind(basis)}", f"give a list of {', '.join(STATES)}")
    if len(basis) != n:
        raise ProblemError("basis", f"has {count(len(basis), 'entry')} for {count(n, 'unknown')}", "make them agree")
    low, high = (np.broadcast_to(bound, n).tolist() for bound in (problem.box.lower, problem.box.upper))
    return np.array([_x_of_state(*each) for each in zip(range(n), basis, low, high, strict=True)])


def _x_of_state(i: int, state: str, low: float, high: float) -> float:
    if not isinstance(state, str) or state not in STATES:
        raise ProblemError(f"basis[{i}]", f"is {kind(state)}", f"write lower, basic or upper {FROM_0}")
    if state == "basic" and low == high:
        raise ProblemError(f"basis[{i}]", "is basic, but that variable is fixed", f"write lower {FROM_0}")
    bound = low if state == "lower" else high
    if state != "basic" and np.isinf(bound):
        raise ProblemError(f"basis[{i}]", f"is {state}, but there is no such bound", f"write another state {FROM_0}")
    if state != "basic":
        return 0.5 * (bound - 1 if state == "lower" else bound + 1)
    if np.isfinite(low) and np.isfinite(high):
        return 0.25 * low + 0.25 * high
    return 0.5 * (low + _beyond(low) if np.isfinite(low) else high - _beyond(high) if np.isfinite(high) else 0.0)


def _beyond(bound: float) -> float:
    """1, or for large numbers what makes a difference."""
    return max(1.0, math.ulp(bound))
