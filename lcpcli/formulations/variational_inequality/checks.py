"""The verification of x, with or without multipliers, as a solution of a variational
inequality.

x is a solution if and only if d = 0 minimizes (Hx + h)'d over the x + d in C; the
multipliers of this linear program are those of x.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.formulations.variational_inequality.inequality import Inequality
from lcpcli.linalg.matrices import product
from lcpcli.linalg.programs import minimized
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import conditions_of
from lcpcli.rational.elimination import Effort
from lcpcli.rational.numbers import rounded
from lcpcli.typing import Vector
from lcpcli.verify.exact_solution import from_point
from lcpcli.verify.verification import Proposed, Verification

EFFORT = 60.0  # for exact multipliers: as for exact proofs


@np.errstate(all="ignore")
def verified(origin: Inequality, proposed: Proposed) -> Verification:
    """Verify z, x and y, or x alone, for which multipliers are sought."""
    n, k, values = proposed.problem.n, origin.variables, list(proposed.values)
    if len(values) == n:
        return proposed.of_z(proposed.values)
    x, y = values[:k], values[k:]
    is_sought = not y
    if is_sought:
        y = _multipliers(origin, proposed)
    z = _with_slacks(origin, proposed, [*x, *y])
    found = proposed.of_z(z if proposed.data is not None else np.array(z))
    multipliers = rounded(map(Fraction, y)) if is_sought else None
    return replace(found, multipliers=multipliers)


def _with_slacks(origin: Inequality, proposed: Proposed, both: list[Any]) -> list[Any]:
    """Return z for x and y: s is the value of its row, or the nearer side."""
    data, problem = proposed.data, proposed.problem
    zeros = [0 * both[0]] * origin.ranges
    if data is None:
        w = (product(problem.M, np.array([*both, *zeros])) + problem.q).tolist()
        bounds = [each[len(both) :].tolist() for each in conditions_of(problem)[2:]]
    else:
        w = data.w([*both, *zeros])
        bounds = [data.lower[len(both) :], data.upper[len(both) :]]
    places, columns = problem.M[: len(both), len(both) :].nonzero()
    rows = dict(zip(columns.tolist(), places.tolist(), strict=True))
    slacks = (
        min(max(w[rows[i]], low), high)
        for i, (low, high) in enumerate(zip(*bounds, strict=True))
    )
    return [*both, *slacks]


def _multipliers(origin: Inequality, proposed: Proposed) -> list[Any]:
    """Return multipliers of the rows at x, zeros if there are none in the range of
    doubles; exact ones for exact data, if they are known."""
    k, m = origin.variables, proposed.problem.n - origin.variables - origin.ranges
    blocks = origin.blocks(conditions_of(proposed.problem))
    assert blocks is not None
    x = rounded(map(Fraction, proposed.values))
    y = _of_program(blocks, x)
    if proposed.data is None:
        return list(y.tolist())
    near = origin.z_of(x, y, blocks)
    z = from_point(proposed.data, near, Effort(EFFORT))
    return [Fraction(value) for value in y] if z is None else z[k : k + m]


def _of_program(blocks: Blocks, x: Vector) -> Vector:
    g, Ax = product(blocks.Q, x) + blocks.c, product(blocks.A, x)
    # A box keeps the program bounded where x is no solution.
    reach = 1.0 + np.abs(x)
    bounds = (
        np.clip(blocks.lower - x, -reach, 0.0),
        np.clip(blocks.upper - x, 0.0, reach),
    )
    sides = (
        np.minimum(blocks.row_lower - Ax, 0.0),
        np.maximum(blocks.row_upper - Ax, 0.0),
    )
    found = minimized(g, blocks.A, sides, bounds)
    if found is None or not np.isfinite(found.y).all():
        return np.zeros(Ax.size)
    return found.y
