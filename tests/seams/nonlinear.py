"""Nonlinear problems with a known solution or none, with J, with a wrong J, and
without."""

from collections.abc import Callable
from functools import partial
from itertools import cycle, product
from typing import Any, NamedTuple

import numpy as np
from record import GENEROUS_SECONDS, Case, main, of_result

from lcpcli import solve_mcp

NUMBER = 240
# N and its slopes, component by component.
TERMS = {
    "cubic": (lambda z: z**3, lambda z: 3 * z**2),
    "exponential": (lambda z: np.exp(z / 2), lambda z: np.exp(z / 2) / 2),
    "logarithm": (lambda z: 2 * np.log(z + 1), lambda z: 2 / (z + 1)),
    # Of free variables alone, with M = 0: no solution.
    "none": (lambda z: 1 + np.exp(-z), lambda z: -np.exp(-z)),
}
JACOBIANS = ("right", "wrong", "missing")
NOT_SOLVED = 1e-6  # a natural residual, in the units of F, that no solution has


class Model(NamedTuple):
    """F, J or None, the lower bounds, a start, and the unit of F."""

    F: Callable[[Any], Any]
    J: Callable[[Any], Any] | None
    lower: Any
    start: Any
    unit: float


def cases(seed):
    """Return models of all kinds, in units from 1e-9 to 1e9."""
    kinds = zip(range(NUMBER), cycle(product(TERMS, JACOBIANS)), strict=False)
    return [
        Case(
            f"{terms} {jacobian} {k}",
            partial(_model, terms, jacobian, 1000 * seed + k),
        )
        for k, (terms, jacobian) in kinds
    ]


def _model(terms, jacobian, seed):
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 8))
    unit = 10.0 ** random.integers(-9, 10)
    has_root = terms != "none"
    N, slopes = TERMS[terms]
    A = random.standard_normal((n, n)) / n**0.5
    M = A @ A.T + A - A.T + 0.1 * np.eye(n) if has_root else np.zeros((n, n))
    z = random.random(n) * (random.random(n) < 0.6)
    w = np.where(z > 0, 0.0, random.random(n))
    c = w - M @ z - N(z) if has_root else np.zeros(n)
    factor = 10.0 ** random.integers(3, 13) if jacobian == "wrong" else 1.0
    J = (
        None
        if jacobian == "missing"
        else lambda z: factor * unit * (M + np.diag(slopes(z)))
    )
    lower = np.zeros(n) if has_root else np.full(n, -np.inf)
    return Model(lambda z: unit * (M @ z + N(z) + c), J, lower, random.random(n), unit)


def outcome(_, model):
    """Return what is compared; a solution is false if F at z violates a sign by far
    more than the tolerance."""
    result = solve_mcp(
        model.F, model.J, lower=model.lower, x0=model.start, time_limit=GENEROUS_SECONDS
    )
    entry = of_result(result) | {"evaluations": result.evaluations}
    w = model.F(result.z) / model.unit
    residual = float(
        np.abs(
            np.where(np.isinf(model.lower), w, np.minimum(result.z - model.lower, w))
        ).max()
    )
    if result.solved and not residual <= NOT_SOLVED:
        entry["false"] = f"the natural residual is {residual:.1e} in the units of F"
    return entry


if __name__ == "__main__":
    main(cases, outcome)
