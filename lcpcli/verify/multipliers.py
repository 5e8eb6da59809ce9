"""Multipliers for an x alone: the multipliers of the linear program that approximates a program near x.

Within rows and bounds and a box around x, the derivative g = Qx + c of the objective is minimized over steps d. If x
satisfies the first-order conditions, d = 0 is a minimizer and the multipliers of the rows are those of the program; if
not, d is a step to a lower objective.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.linalg.linear_program import minimized
from lcpcli.linalg.matrices import absolute_product, product, row_maxima, scaled
from lcpcli.model.program import ProgramData
from lcpcli.typing import Vector

BOX_SIZE = 0.1  # relative to x: small enough for the linear program to be a model of the objective
LEAST_BOX_SIZE = 1e-3  # of the largest |x_i|: the least that the box is relative to, so that zeros may move


class MultiplierStep(NamedTuple):
    """The multipliers y of the rows, shape (m,), and by how much the step that belongs to them lowers the objective."""

    y: Vector
    gain: float


@np.errstate(all="ignore")
def step_from(data: ProgramData, x: Vector) -> MultiplierStep | None:
    """Return the multipliers at x of a program to be minimized, and what a step from x gains; None if there are none
    in the range of doubles."""
    g = product(data.Q, x) + data.c
    largest = float(np.abs(x).max())
    sizes = BOX_SIZE * np.maximum(np.abs(x), LEAST_BOX_SIZE * largest) if largest else np.ones(x.size)
    A, heights = data.A, np.ones(data.row_lower.size)
    if heights.size:
        heights = row_maxima(scaled(A, heights, sizes))
        heights[heights == 0] = 1.0
        A = scaled(A, 1 / heights, sizes)
    ends = _around(product(data.A, x), data.row_lower, data.row_upper)
    low, high = _around(x, data.lower, data.upper)
    bounds = np.maximum(low / sizes, -1.0), np.minimum(high / sizes, 1.0)
    unit = float(np.abs(g * sizes).max()) or 1.0
    found = minimized(g * sizes / unit, A, (ends[0] / heights, ends[1] / heights), bounds)
    if found is None or not np.isfinite(found.y).all():
        return None
    d = found.x * sizes
    slope, curvature = float(g @ d), float(d @ product(data.Q, d))
    t = min(1.0, -slope / curvature) if curvature > 0 else 1.0
    return MultiplierStep(found.y * unit / heights, -t * (slope + t * curvature / 2))


@np.errstate(over="ignore", invalid="ignore")
def objective(data: ProgramData, x: Vector) -> float:
    """Return x'Qx / 2 + c'x."""
    return float(x @ product(data.Q, x) / 2 + data.c @ x)


@np.errstate(all="ignore")
def terms_of_objective(data: ProgramData, x: Vector) -> float:
    """Return the sum of the sizes of the terms of x'Qx / 2 + c'x."""
    return float(np.abs(x) @ (absolute_product(data.Q, np.abs(x)) / 2 + np.abs(data.c)))


def _around(value: Vector, lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """Return how far a value may move down and up; beyond a bound it may move no farther."""
    equal = lower == upper
    return np.where(equal, 0.0, np.minimum(lower - value, 0.0)), np.where(equal, 0.0, np.maximum(upper - value, 0.0))
