"""The verification of x, with or without multipliers, for optimality conditions with
rows and bounds, as of a variational inequality.

x is a solution if and only if d = 0 minimizes (Qx + c)'d over all d for which x + d
satisfies the rows and bounds. If a row limits a single player only, it constrains the
components of d of that player alone. The multipliers of this linear program are those
of x.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from lcpcli.linalg.matrices import absolute_product, product
from lcpcli.linalg.programs import minimized
from lcpcli.model.block_form import BlockForm, Blocks
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.rational import elimination
from lcpcli.rational.numbers import over_one_denominator, rounded
from lcpcli.typing import Vector
from lcpcli.verify.verification import Proposed, Verification

# A row whose value is below this relative to its terms is 0 up to rounding.
ZERO = 1e-9


@np.errstate(all="ignore")
def verified(origin: BlockForm, proposed: Proposed) -> Verification:
    """Verify a solution proposed as z, as x and y, or as x alone, for which multipliers
    are then computed.
    """
    n = proposed.problem.n
    k = origin.variables
    values = list(proposed.values)
    if len(values) == n:
        return proposed.of_z(proposed.values)
    x, y = values[:k], values[k:]
    is_sought = not y
    if is_sought:
        y = _multipliers(origin, proposed)
    z = _with_slacks(origin, proposed, [*x, *y])
    verification = proposed.of_z(z if proposed.data is not None else np.array(z))
    multipliers = rounded(map(Fraction, y)) if is_sought else None
    return replace(verification, multipliers=multipliers)


def _with_slacks(origin: BlockForm, proposed: Proposed, both: list[Any]) -> list[Any]:
    """Return z for x and y: each s is the value of its row, or the closest side if the
    value is beyond it.
    """
    data, problem = proposed.data, proposed.problem
    zeros = [0 * both[0] for _ in range(origin.ranges)]
    if data is None:
        w = (product(problem.M, np.array([*both, *zeros])) + problem.q).tolist()
        bounds = [each[len(both) :].tolist() for each in conditions_of(problem)[2:]]
    else:
        w = data.w([*both, *zeros])
        bounds = [data.lower[len(both) :], data.upper[len(both) :]]
    row_numbers, columns = problem.M[: len(both), len(both) :].nonzero()
    rows = dict(zip(columns.tolist(), row_numbers.tolist(), strict=True))
    slacks = (
        min(max(w[rows[i]], low), high)
        for i, (low, high) in enumerate(zip(*bounds, strict=True))
    )
    return [*both, *slacks]


def _multipliers(origin: BlockForm, proposed: Proposed) -> list[Any]:
    """Return multipliers of the rows at x by the linear program, zeros if it has none
    in the range of double precision; for exact data, exact multipliers with the same
    support, if there are any.
    """
    problem, data = proposed.problem, proposed.data
    blocks = origin.blocks(conditions_of(problem))
    assert blocks is not None
    x = rounded(map(Fraction, proposed.values))
    y = _of_program(problem, blocks, x)
    if data is None:
        return list(y.tolist())
    k, support = x.size, np.flatnonzero(y).tolist()
    z = np.concatenate((x, y, np.zeros(origin.ranges)))
    terms = absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    is_zero = np.abs(product(problem.M, z) + problem.q) <= ZERO * terms
    M, zeros = data.M, [Fraction(0)] * (data.n - k)
    w = data.w([*map(Fraction, proposed.values), *zeros])
    equations = [
        [*(M[j].get(k + i, Fraction(0)) for i in support), -w[j]]
        for j in np.flatnonzero(is_zero[:k]).tolist()
    ]
    integer_rows = [over_one_denominator(each)[0] for each in equations]
    solution = elimination.solve(
        [row[:-1] for row in integer_rows], [row[-1] for row in integer_rows]
    )
    exact = dict(zip(support, solution[0] or map(Fraction, y[support]), strict=True))
    return [exact.get(i, Fraction(0)) for i in range(y.size)]


def _of_program(problem: Problem, blocks: Blocks, x: Vector) -> Vector:
    """Return the multipliers of the rows in the linear program for d at x; zeros if it
    has no finite solution."""
    k, m = x.size, blocks.row_lower.size
    limiting = -problem.M[:k, k : k + m].T
    g, Ax = product(blocks.Q, x) + blocks.c, product(blocks.A, x)
    # The box |d| <= 1 + |x| keeps the program bounded if x is no solution.
    reach = 1.0 + np.abs(x)
    bounds = (
        np.clip(blocks.lower - x, -reach, 0.0),
        np.clip(blocks.upper - x, 0.0, reach),
    )
    sides = (
        np.minimum(blocks.row_lower - Ax, 0.0),
        np.maximum(blocks.row_upper - Ax, 0.0),
    )
    program_solution = minimized(g, limiting, sides, bounds)
    if program_solution is None or not np.isfinite(program_solution.y).all():
        return np.zeros(Ax.size)
    return program_solution.y
