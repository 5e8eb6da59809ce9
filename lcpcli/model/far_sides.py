"""Sides that are likely to mean none: finite bounds of unknowns, and sides of
constraints of a program, that are far beyond everything else.

Formats and solvers have no infinity in common: 1e20 by the convention of MPS files,
9.99e19 of one collection, 1e19 of Ipopt, 1e15 of those who write a large number. Such a
side is a side like any other, but its size leaves no digits for smaller numbers. A
method does better if it first solves the problem without far sides: a solution within
them is one of the problem. Which sides are far only matters for how long this takes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lcpcli.model.box import MIN_FAR
from lcpcli.typing import Mask, Vector

# Far sides are at least this multiple of the largest side that is not far.
FAR_BEYOND = 1e7


class FarSides(NamedTuple):
    """Where z has a far lower bound, where a far upper one, and where it is the
    multiplier of a row whose only side is far; each of shape (n,)."""

    lower: Mask
    upper: Mask
    rows: Mask

    @property
    def number(self) -> int:
        return sum(int(np.count_nonzero(each)) for each in self)

    def without(self, met: FarSides) -> FarSides:
        """Return those of these sides that are not among the others."""
        pairs = zip(self, met, strict=True)
        return FarSides(*(mask & ~other for mask, other in pairs))

    def joined(self, others: FarSides) -> FarSides:
        """Return these sides and the others."""
        pairs = zip(self, others, strict=True)
        return FarSides(*(mask | other for mask, other in pairs))


def far_sides(
    q: Vector, lower: Vector, upper: Vector, y: slice | None, reach: float = 0.0
) -> tuple[FarSides, float, float] | None:
    """Return the far sides of a problem, the size of the smallest one, and that of the
    largest one that is not far; None if there are none. y : which unknowns are
    multipliers of a program. reach : a size relative to which sides are far."""
    is_row, of_rows = np.zeros(q.size, dtype=bool), np.zeros(q.size)
    if y is not None:
        is_lower = (lower == 0) & (upper == np.inf)
        is_upper = (lower == -np.inf) & (upper == 0)
        is_row[y] = (is_lower | is_upper)[y]
        of_rows[y] = np.abs(q)[y]
    all_sizes = np.concatenate((np.abs(lower), np.abs(upper), of_rows))
    reach = float(all_sizes[all_sizes < MIN_FAR].max(initial=reach))
    min_size = max(MIN_FAR, FAR_BEYOND * reach)
    sizes = np.abs(lower), np.abs(upper), np.where(is_row, of_rows, 0.0)
    far = [(each >= min_size) & (each < np.inf) for each in sizes]
    # Sides that allow only far values are meant literally.
    low = far[0] & (lower < 0) & (upper > -MIN_FAR)
    high = far[1] & (upper > 0) & (lower < MIN_FAR)
    rows = far[2] & np.where(upper == np.inf, q > 0, q < 0)
    sides = FarSides(low, high, rows)
    if not sides.number:
        return None
    parts = zip(sizes, sides, strict=True)
    smallest = min(
        float(each[is_far_side].min(initial=np.inf)) for each, is_far_side in parts
    )
    return sides, smallest, reach
