"""How far the objective of a convex program may be from its minimum, at a solution of
its first-order conditions.

The residual compares each row of the conditions with the terms of that row. With
multipliers of 1e11 it does not detect that a violation of 1e-14 costs 1e-3 of the
objective. The duality gap does: for min x'Qx / 2 + c'x with multipliers y, it is the
sum of z_i w_i, or (z_i - b_i) w_i for the bound b_i that the sign of w_i requires, over
x, y and s (see `model.block_form`). Positive terms bound by how much the objective may
exceed the minimum, and negative ones, of violated rows, by how much it may be below it:
W. S. Dorn, Duality in quadratic programming, Quarterly of Applied Mathematics 18 (1960)
155-162.

If there is no such bound, or one so large that it means infinity, the gap is infinite
unless w_i is exactly 0. The term is then z_i w_i: the cost of the rounding error w_i if
the minimizer has a z_i of this size.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.errors import count
from lcpcli.linalg.matrices import absolute_product
from lcpcli.model.block_form import BlockForm
from lcpcli.model.box import MIN_FAR
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Vector
from lcpcli.verify.point import Point

# The objective is compared with at least this fraction of its terms, as it may cancel.
CANCELLED = 1e-6
NEGLIGIBLE = 1e-9  # relative errors of the objective up to this are not reported


def objective_error_at(problem: Problem, point: Point) -> float:
    """Return by how much the objective at a solution of the conditions of a convex
    program may differ from the minimum, relative to its size, without the part that
    rounding errors of w contribute.
    """
    error = objective_error(problem, point.z, point.plain_w)
    if error > NEGLIGIBLE:
        error = objective_error(problem, point.z, point.w)
    return error


@np.errstate(all="ignore")
def objective_error(problem: Problem, z: Vector, w: Vector) -> float:
    """Return the relative error of the objective for a z and its w = M z + q: the size
    of the gap, relative to the objective, or to a fraction of its terms if they cancel.

    Where no bound is met, the term of the gap is z_i w_i. The error is infinite if the
    data of the program are not known, or if all terms of the objective are 0 in spite
    of linear ones.
    """
    form, box = problem.block_form, problem.box
    assert form is not None
    side = np.where(w > 0, box.lower, box.upper)
    is_met = np.isfinite(side)
    if box.is_far:
        is_met &= (np.abs(side) < MIN_FAR) | (side == z)
    terms = w * (z - np.where(is_met, side, 0.0))
    total, size = float(np.add.reduce(terms)), float(np.add.reduce(np.abs(terms)))
    # The larger one of the sums of the positive terms and of the negative ones.
    error = (size + abs(total)) / 2
    objective = abs(_objective(form, problem.q, z, w))
    if not error > NEGLIGIBLE * objective:
        return error / objective if objective else 0.0
    data = form.blocks(conditions_of(problem))
    if data is None or not math.isfinite(error):
        return math.inf
    x = np.abs(z[: form.variables])
    of_x = float(np.abs(data.c) @ x + x @ absolute_product(data.Q, x) / 2)
    whole = max(objective, CANCELLED * (of_x + abs(form.constant)))
    if not (whole or data.c.any()):
        # There are no linear terms, and x'Qx / 2 is 0, which is its minimum.
        return 0.0
    return error / whole if whole else math.inf


def statement(error: float) -> str:
    """Return how many digits of the objective a relative error leaves correct, as a
    clause; "" if the error is negligible.
    """
    if not error > NEGLIGIBLE:
        return ""
    digits = max(0, math.floor(-math.log10(error))) if error < math.inf else 0
    return f"objective known to {count(digits, 'digit') if digits else 'no digit'}"


def _objective(form: BlockForm, q: Vector, z: Vector, w: Vector) -> float:
    """Return the objective to be minimized from z'w, without products with the data, as
    w consists of Qx + c - A'y in the rows of x, Ax - b or Ax - s in those of y, and y
    in those of s.
    """
    k, end = form.variables, z.size - form.ranges
    doubled = z @ w + z[:k] @ q[:k] - z[k:end] @ q[k:end]
    return float(doubled) / 2 + form.sign * form.constant
