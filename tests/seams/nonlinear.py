"""Nonlinear problems with a known solution or none, with J, with a wrong J, and
without."""

from collections.abc import Callable
from functools import partial
from itertools import cycle, product
from typing import Any, NamedTuple

import numpy as np
from record import GENEROUS_SECONDS, Case, main, nonlinear_problems, of_result

from lcpcli import solve_mcp
from lcpcli.model.nonlinear import NonlinearProblem

NUMBER = 240
KINDS = (*nonlinear_problems.KINDS, "none")
# 1 + exp(-z) is positive for all z, which are free: no solution.
NONE = NonlinearProblem(
    lambda z: 1 + np.exp(-z), lambda z: np.diag(-np.exp(-z)), lower=None, x0=[0.5, 1.0]
)
JACOBIANS = ("right", "wrong", "missing")
NOT_SOLVED = 1e-6  # a natural residual, in the units of F, that no solution has


class Model(NamedTuple):
    """A problem, how F and J are given, and the unit of F."""

    problem: Any
    F: Callable[[Any], Any]
    J: Callable[[Any], Any] | None
    unit: float


def cases(seed):
    """Return models of all kinds, in units from 1e-9 to 1e9."""
    kinds = zip(range(NUMBER), cycle(product(KINDS, JACOBIANS)), strict=False)
    return [
        Case(f"{kind} {jacobian} {k}", partial(_model, kind, jacobian, 1000 * seed + k))
        for k, (kind, jacobian) in kinds
    ]


def _model(kind, jacobian, seed):
    random = np.random.default_rng(seed)
    # Those of odd seeds have a J.
    own = NONE if kind == "none" else nonlinear_problems.planted(kind, 2 * seed + 1)
    unit = 10.0 ** random.integers(-9, 10)
    factor = 10.0 ** random.integers(3, 13) if jacobian == "wrong" else 1.0
    J = None if jacobian == "missing" else lambda z: factor * unit * own.J(z)
    return Model(own, lambda z: unit * own.F(z), J, unit)


def outcome(_, model):
    """Return what is compared; a solution is false if F at z violates a sign by far
    more than the tolerance."""
    problem = model.problem
    result = solve_mcp(
        model.F,
        model.J,
        lower=problem.lower,
        upper=problem.upper,
        x0=problem.x0,
        time_limit=GENEROUS_SECONDS,
    )
    entry = of_result(result) | {"evaluations": result.evaluations}
    residual = nonlinear_problems.natural_residual(problem, result.z)
    if result.solved and not residual <= NOT_SOLVED:
        entry["false"] = f"the natural residual is {residual:.1e} in the units of F"
    return entry


if __name__ == "__main__":
    main(cases, outcome)
