"""Linear programs, solved exactly.

At a minimizer v of c'v with A v >= b and l <= v <= u there are multipliers y >= 0 such
that y_i = 0 if row i is inactive at v, and for d = c - A'y, d_j >= 0 if v_j < u_j and
d_j <= 0 if v_j > l_j; and such y prove that v is a minimizer. The simplex method in
floating-point arithmetic shows which rows and bounds are active; two linear systems,
for v and for y, are then solved in integers, and all conditions are checked (D.
Applegate, W. Cook, S. Dash and D. Espinoza, Exact solutions to linear programming
problems, Operations Research Letters 35 (2007) 693-699).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.programs import minimized
from lcpcli.rational import elimination
from lcpcli.rational.exact_problem import Bounds, Rows
from lcpcli.rational.numbers import over_one_denominator, rounded
from lcpcli.typing import Mask, Matrix, Vector

Values = list[Fraction]

LP_EFFORT = 10.0  # limit on a program, in seconds that its iterations usually take
# Costs are multiplied by this, as the tolerance of the simplex method is absolute.
COST_UNIT = 1e3
# Relative tolerances for active rows and bounds, tested one after another.
TOLERANCES = (1e-12, 1e-9, 1e-15)


class LinearProgram(NamedTuple):
    """min c'v subject to rows of v that are at least `right_side`, or equal to it, and
    bounds.
    """

    costs: Values
    rows: Rows
    right_side: Values
    equal: Sequence[bool]
    lower: Bounds
    upper: Bounds

    @np.errstate(all="ignore")
    def minimizer(self) -> tuple[Values, Values] | None:
        """Return a minimizer and the multipliers of the rows that prove it to be one;
        None if the search yields none.
        """
        A, c = matrix_of(self.rows, len(self.costs)), rounded(self.costs)
        b, low, high = rounded(self.right_side), *in_doubles(self.lower, self.upper)
        row_limits = b, np.where(self.equal, b, math.inf)
        lp_solution = minimized(COST_UNIT * c, A, row_limits, (low, high), LP_EFFORT)
        if lp_solution is None:
            return None
        x, y = lp_solution.x, lp_solution.y / COST_UNIT
        gaps = np.abs(c - A.T @ y) / (np.abs(c) + abs(A).T @ np.abs(y))
        slacks = np.abs(A @ x - b) / (np.abs(b) + abs(A) @ np.abs(x))
        columns: Rows = [{} for _ in self.costs]
        for i, row in enumerate(self.rows):
            for j, a in row.items():
                columns[j][i] = a
        for tol in TOLERANCES:
            margin = tol * np.maximum(1.0, np.abs(x))
            at_low, at_high = x - low <= margin, high - x <= margin
            free = np.flatnonzero(~(at_low | at_high)).tolist()
            bounds_of_v = zip(self.lower, self.upper, at_low, at_high, strict=True)
            v = [Fraction(0)] * len(self.costs)
            for j, (lower, upper, is_low, is_high) in enumerate(bounds_of_v):
                if is_low:
                    v[j] = lower or Fraction(0)
                elif is_high:
                    v[j] = upper or Fraction(0)
            active = _first(y != 0, ~(slacks > tol))
            _satisfy_equations(
                v, free, [(self.rows[i], self.right_side[i]) for i in active]
            )
            multipliers = [Fraction(0)] * len(self.rows)
            of_y = np.flatnonzero(np.abs(y) > tol * np.abs(y).max(initial=0.0))
            tight = _first(~(at_low | at_high), ~(gaps > tol))
            _satisfy_equations(
                multipliers, of_y.tolist(), [(columns[j], self.costs[j]) for j in tight]
            )
            if self._is_minimizer(v, multipliers, columns):
                return v, multipliers
        return None

    def _is_minimizer(self, v: Values, y: Values, columns: Rows) -> bool:
        """Return whether the multipliers y prove that v is a minimizer."""
        rows = zip(self.rows, self.right_side, self.equal, y, strict=True)
        for row, end, is_equal, value in rows:
            slack = _product(row, v) - end
            if slack < 0 or (slack and (is_equal or value)):
                return False
            if value < 0 and not is_equal:
                return False
        each = zip(v, self.lower, self.upper, self.costs, columns, strict=True)
        for value, low, high, cost, column in each:
            if (low is not None and value < low) or (high is not None and value > high):
                return False
            gap = cost - _product(column, y)
            if (gap > 0 and value != low) or (gap < 0 and value != high):
                return False
        return True


def matrix_of(rows: Sequence[Mapping[int, Fraction]], columns: int) -> Matrix:
    """Return rows of fractions as a sparse matrix of floats."""
    with imports:
        from scipy.sparse import csr_array
    entries = [(i, j, float(a)) for i, row in enumerate(rows) for j, a in row.items()]
    positions = [i for i, _, _ in entries], [j for _, j, _ in entries]
    values = [a for _, _, a in entries]
    return csr_array((values, positions), shape=(len(rows), columns))


def in_doubles(lower: Bounds, upper: Bounds) -> tuple[Vector, Vector]:
    """Return bounds as floats, infinite ones for None."""
    return (
        np.array([-math.inf if bound is None else float(bound) for bound in lower]),
        np.array([math.inf if bound is None else float(bound) for bound in upper]),
    )


def _first(first: Mask, others: Mask) -> list[int]:
    """Return the indices at which `first` is True, then those at which only `others`
    is.
    """
    return [*np.flatnonzero(first).tolist(), *np.flatnonzero(others & ~first).tolist()]


def _product(row: Mapping[int, Fraction], v: Values) -> Fraction:
    return sum((a * v[j] for j, a in row.items()), Fraction(0))


def _satisfy_equations(
    v: Values,
    free: Sequence[int],
    equations: Iterable[tuple[Mapping[int, Fraction], Fraction]],
) -> None:
    """Change the free components so that equations hold, those first that come first:
    if equations are dependent, later ones may be violated. Nothing changes if no
    solution is computed.
    """
    integer_rows = [
        over_one_denominator(
            [*(row.get(j, Fraction(0)) for j in free), end - _product(row, v)]
        )[0]
        for row, end in equations
        if any(j in row for j in free)
    ]
    A = [row[:-1] for row in integer_rows]
    right_side = [row[-1] for row in integer_rows]
    solution = elimination.particular(A, right_side) if A else None
    for j, value in zip(free, solution or (), strict=False):
        v[j] += value
