"""Linear programs, solved exactly.

At a minimizer v of c'v with A v >= b and l <= v <= u there are multipliers y >= 0 such
that y_i = 0 where row i is no equation at v, and for d = c - A'y, d_j >= 0 where v_j <
u_j and d_j <= 0 where v_j > l_j; and such y prove that v is a minimizer. The simplex
method in doubles shows which of these are equations, and two linear systems, for v and
for y, are then solved in integers and everything is checked (D. Applegate, W. Cook, S.
Dash and D. Espinoza, Exact solutions to linear programming problems, Operations
Research Letters 35 (2007) 693-699).
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

LP_EFFORT = 10.0  # by the seconds that so many iterations usually take
# By which costs are multiplied, as the tolerance of the simplex method is absolute.
COST_UNIT = 1e3
# Relative: what counts as 0 in doubles, one after another.
TOLERANCES = (1e-12, 1e-9, 1e-15)


class LinearProgram(NamedTuple):
    """min costs'v, where rows of v are at least `ends`, or equal to them, within
    bounds."""

    costs: Values
    rows: Rows
    ends: Values
    equal: Sequence[bool]
    lower: Bounds
    upper: Bounds

    @np.errstate(all="ignore")
    def minimizer(self) -> tuple[Values, Values] | None:
        """Return a minimizer and the multipliers of rows that prove that it is one;
        None if none is found."""
        A, c = matrix_of(self.rows, len(self.costs)), rounded(self.costs)
        b, low, high = rounded(self.ends), *in_doubles(self.lower, self.upper)
        ends = b, np.where(self.equal, b, math.inf)
        found = minimized(COST_UNIT * c, A, ends, (low, high), LP_EFFORT)
        if found is None:
            return None
        x, y = found.x, found.y / COST_UNIT
        gaps = np.abs(c - A.T @ y) / (np.abs(c) + abs(A).T @ np.abs(y))
        slacks = np.abs(A @ x - b) / (np.abs(b) + abs(A) @ np.abs(x))
        columns: Rows = [{} for _ in self.costs]
        for i, row in enumerate(self.rows):
            for j, a in row.items():
                columns[j][i] = a
        for tol in TOLERANCES:
            near = tol * np.maximum(1.0, np.abs(x))
            at_low, at_high = x - low <= near, high - x <= near
            free = np.flatnonzero(~(at_low | at_high)).tolist()
            ends_of_v = zip(self.lower, self.upper, at_low, at_high, strict=True)
            v = [
                (start if is_low else end if is_high else None) or Fraction(0)
                for start, end, is_low, is_high in ends_of_v
            ]
            active = _first(y != 0, ~(slacks > tol))
            _settle(v, free, [(self.rows[i], self.ends[i]) for i in active])
            own = [Fraction(0)] * len(self.rows)
            of_y = np.flatnonzero(np.abs(y) > tol * np.abs(y).max(initial=0.0))
            tight = _first(~(at_low | at_high), ~(gaps > tol))
            _settle(own, of_y.tolist(), [(columns[j], self.costs[j]) for j in tight])
            if self._is_minimizer(v, own, columns):
                return v, own
        return None

    def _is_minimizer(self, v: Values, y: Values, columns: Rows) -> bool:
        """Return whether the multipliers y prove that v is a minimizer."""
        rows = zip(self.rows, self.ends, self.equal, y, strict=True)
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
    """Return a sparse matrix of doubles."""
    with imports:
        from scipy.sparse import csr_array
    entries = [(i, j, float(a)) for i, row in enumerate(rows) for j, a in row.items()]
    places = [i for i, _, _ in entries], [j for _, j, _ in entries]
    values = [a for _, _, a in entries]
    return csr_array((values, places), shape=(len(rows), columns))


def in_doubles(lower: Bounds, upper: Bounds) -> tuple[Vector, Vector]:
    return (
        np.array([-math.inf if end is None else float(end) for end in lower]),
        np.array([math.inf if end is None else float(end) for end in upper]),
    )


def _first(first: Mask, others: Mask) -> list[int]:
    """Return the indices where the first is true, then those where only the other
    is."""
    return [*np.flatnonzero(first).tolist(), *np.flatnonzero(others & ~first).tolist()]


def _product(row: Mapping[int, Fraction], v: Values) -> Fraction:
    return sum((a * v[j] for j, a in row.items()), Fraction(0))


def _settle(
    v: Values,
    free: Sequence[int],
    equations: Iterable[tuple[Mapping[int, Fraction], Fraction]],
) -> None:
    """Change some components so that equations hold which are independent of those
    before them, if such values are found."""
    whole = [
        over_one_denominator(
            [*(row.get(j, Fraction(0)) for j in free), end - _product(row, v)]
        )[0]
        for row, end in equations
        if any(j in row for j in free)
    ]
    A, ends = [row[:-1] for row in whole], [row[-1] for row in whole]
    found = elimination.particular(A, ends) if A else None
    for j, value in zip(free, found or (), strict=False):
        v[j] += value
