"""Rows without entries, whose sides are rounding of 0.

A row that is computed may lose all its entries, and what should be 0 on its other side
is the rounding of sums that cancel: 0 x <= -7e-18 among rows with sides of 1. No x
satisfies these literal numbers, which is seldom what is meant.

A side is treated as rounding of 0 only if its row has no entry, so that the side alone
decides; and if it is at most ROUNDING_OF_SIDES of the median of the sides, those of 0
left out, of the rows of the same kind with entries. These have to be FEW at least, or
all rows of this kind with entries. Equations are of one kind, and inequalities of the
other. In a program, only rows of A are meant: a cost of 1e-17 is no side. A side far
below that, as 1e-80 among sides of 1, is not what sums of such sides leave.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lcpcli.errors import listed
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import dense
from lcpcli.model.block_form import BlockForm
from lcpcli.model.formulation import Conditions
from lcpcli.typing import Indices, Mask, Vector

# Relative to the median of the sides of other rows.
ROUNDING_OF_SIDES = 1e-15
# Relative to the same median: rounding of the other sides, or of rounding of them,
# leaves no smaller side.
MIN_OF_SIDES = EPS**2
FEW = 3  # sides with a median
MAX_NAMED = 3


class RoundedRows(NamedTuple):
    """Rows without entries, whose sides are rounding of 0.

    rows : their indices in q. sides : the literal side of each. names : the users'
        names for them. conditions : the problem with sides of 0 there.
    """

    rows: Indices
    sides: Vector
    names: list[str]
    conditions: Conditions

    @property
    def statement(self) -> str:
        """Return that these rows have no solution, as a clause."""
        pairs = zip(self.names, self.sides.tolist(), strict=True)
        named = [f"{name} (empty, side {side:.0e})" for name, side in pairs]
        more = len(named) - MAX_NAMED
        named[MAX_NAMED:] = [f"{more} more"] if more > 0 else []
        have = "has" if self.rows.size == 1 else "have"
        return f"with the numbers as stored, {listed(named)} {have} no solution"


class _Rows(NamedTuple):
    """The rows of a problem that have sides. indices : their indices in q. lower, upper
    : the sides.
    is_empty, is_equation : whether each has no entry, and is an equation. ranges : for
        a row between two sides, the index of the variable that represents its value;
        else -1."""

    indices: Indices
    lower: Vector
    upper: Vector
    is_empty: Mask
    is_equation: Mask
    ranges: Indices


# Without it: a row 0 x <= -7e-18 makes a program infeasible.
def rounded_rows(
    data: Conditions, maxima: Vector, block_form: BlockForm | None, names: Sequence[str]
) -> RoundedRows | None:
    """Return the rows without entries whose sides are rounding of 0; None if there are
    none. maxima : the largest |M_ij| of each row. names : those of the unknowns."""
    table_rows = _rows(data, maxima, block_form)
    sides = np.where(
        table_rows.lower > 0,
        table_rows.lower,
        np.where(table_rows.upper < 0, table_rows.upper, 0.0),
    )
    is_rounded = table_rows.is_empty & (sides != 0)
    for is_kind in (table_rows.is_equation, ~table_rows.is_equation):
        if (is_rounded & is_kind).any():
            size = _size(table_rows, is_kind & ~table_rows.is_empty)
            each = np.abs(sides)
            is_rounding = each <= ROUNDING_OF_SIDES * size
            is_rounding &= each >= MIN_OF_SIDES * size
            is_rounded &= ~is_kind | is_rounding
    if not is_rounded.any():
        return None
    rows = table_rows.indices[is_rounded]
    values = table_rows.ranges[is_rounded & (table_rows.ranges >= 0)]
    q = data.q.copy()
    low = data.lower.copy()
    high = data.upper.copy()
    q[rows] = 0.0
    low[values], high[values] = np.minimum(low[values], 0), np.maximum(high[values], 0)
    first = table_rows.indices[0]
    named = [f"row {names[i] or i - first + 1}" for i in rows.tolist()]
    changed = Conditions(data.M, q, low, high)
    return RoundedRows(rows, sides[is_rounded], named, changed)


def _size(rows: _Rows, others: Mask) -> float:
    """Return the size of the sides of other rows; 0 if there are too few of them."""
    each = np.abs(np.stack((rows.lower[others], rows.upper[others])))
    largest = np.where(each < np.inf, each, 0.0).max(axis=0, initial=0.0)
    sizes = np.sort(largest[largest > 0])
    if sizes.size < FEW and sizes.size < largest.size:
        return 0.0
    return float(sizes[(sizes.size - 1) // 2]) if sizes.size else 0.0


def _rows(data: Conditions, maxima: Vector, block_form: BlockForm | None) -> _Rows:
    M, q, low, high = data
    first, last = 0, q.size
    if block_form is not None:
        first, last = block_form.variables, q.size - block_form.ranges
    indices = np.arange(first, last)
    is_equation = (low == -np.inf) & (high == np.inf)
    # Rows of w = M z + q have sides where z_i is unbounded above, and below.
    lower = np.where(high == np.inf, -q, -np.inf)[indices]
    upper = np.where(low == -np.inf, -q, np.inf)[indices]
    is_empty = (maxima == 0)[indices]
    is_equation = is_equation[indices]
    ranges = np.full(indices.size, -1)
    if last < q.size:
        values = np.arange(last, q.size)
        # Each value occurs in its row alone.
        of_value = M[values].nonzero()[1] - first
        lower[of_value], upper[of_value] = low[values], high[values]
        is_equation[of_value], ranges[of_value] = False, values
        may_be = (lower > 0) | (upper < 0)
        some = of_value[may_be[of_value]]
        entries = dense(abs(M[first + some][:, :first])).max(axis=1, initial=0)
        is_empty[some] = entries == 0
    return _Rows(indices, lower, upper, is_empty, is_equation, ranges)
