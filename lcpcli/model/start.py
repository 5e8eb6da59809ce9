"""Where a run on a problem starts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lcpcli.errors import ParameterError, ProblemError, count, kind
from lcpcli.linalg.doubles import is_finite
from lcpcli.model.arrays import FROM_0, as_vector
from lcpcli.model.box import Basis
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector, VectorLike

STATES = ("lower", "basic", "upper")


def starting_point(
    problem: Problem, x0: VectorLike | None, z0: VectorLike | None, basis: Sequence[str] | None = None
) -> Vector:
    """Return the start x that is given: x0, the x of z0 and w = M z0 + q, or an x with the states of a basis."""
    given = [name for name, value in (("basis", basis), ("z0", z0), ("x0", x0)) if value is not None]
    if len(given) > 1:
        raise ParameterError(given[0], f"gives the starting point, and so does {given[-1]}", "leave one out")
    if basis is not None:
        return x_of_states(problem, basis)
    if z0 is not None:
        z = as_vector("z0", z0, problem.n)
        x = problem.box.x_of(z, problem.w(z))
        return x if is_finite(x) else as_vector("M z0 + q", x)
    return as_vector("x0", x0, problem.n)


@np.errstate(all="ignore")
def states_of(problem: Problem, z: Vector, w: Vector) -> list[str]:
    """Return the state of each variable of a solution z, one of STATES; fixed variables are "lower"."""
    return words_for(problem.box.basis_at(z, w))


def words_for(basis: Basis) -> list[str]:
    """Return the state of each variable, one of STATES."""
    upper = np.False_ if basis.upper is None else basis.upper
    named: list[str] = np.where(basis.basic, "basic", np.where(upper, "upper", "lower")).tolist()
    return named


def x_of_states(problem: Problem, basis: Sequence[str]) -> Vector:
    """Return an x with these states, one of STATES for each variable: at a bound with w of size one, or inside the
    bounds."""
    n = problem.n
    if not isinstance(basis, (list, tuple, np.ndarray)):
        raise ProblemError("basis", f"is {kind(basis)}", f"give a list of the words {', '.join(STATES)}")
    if len(basis) != n:
        raise ProblemError("basis", f"has {count(len(basis), 'entry')} for {count(n, 'unknown')}", "make them agree")
    if problem.box.is_orthant and type(basis) is list and basis.count("basic") + basis.count("lower") == n:
        return np.array([0.5 if state == "basic" else -0.5 for state in basis])
    bounds = (bound.tolist() for bound in problem.box.vectors(n))
    return np.array([_x_of_state(f"basis[{i}]", *each) for i, each in enumerate(zip(basis, *bounds, strict=True))])


def _x_of_state(field: str, state: str, low: float, high: float) -> float:
    if not isinstance(state, str) or state not in STATES:
        raise ProblemError(field, f"is {kind(state)}", f"write lower, basic or upper {FROM_0}")
    if state != "basic":
        bound, beyond = (low, -1) if state == "lower" else (high, 1)
        if math.isinf(bound):
            raise ProblemError(field, f"is {state}, but there is no such bound", f"write another state {FROM_0}")
        return 0.5 * (bound + beyond)
    if low == high:
        raise ProblemError(field, "is basic, but that variable is fixed", f"write lower {FROM_0}")
    if math.isfinite(low) and math.isfinite(high):
        return 0.25 * low + 0.25 * high
    if math.isfinite(low):
        return 0.5 * (low + max(1.0, math.ulp(low)))  # 1, or for large numbers what makes a difference
    return 0.5 * (high - max(1.0, math.ulp(high))) if math.isfinite(high) else 0.0
