"""Equilibration: units for rows and columns in which every problem looks alike.

For positive diagonals R and C the solutions of LCP(R M C, R q) are z / C with w scaled by R. With R and C from the
matrix itself, what is measured in scaled units does not change when somebody rescales rows, columns or q.
"""

from __future__ import annotations

import numpy as np

from lcpcli import linalg
from lcpcli.typing import Matrix, Vector

SWEEPS = 30


def equilibrate(M: Matrix, q: Vector) -> tuple[Vector, Vector]:
    """Diagonals R, C of shape (n,) for which the rows and columns of R |M| C have largest entries near 1.

    Rows and columns are divided by the roots of their largest entries in turn (Ruiz 2001, A scaling algorithm to
    equilibrate both rows and columns norms in matrices, RAL-TR-2001-034), here by the nearest powers of two, so that
    scaling rounds nothing, until every largest entry lies between 1/4 and 4. A symmetric M stays symmetric: R = C.
    A row of zeros is scaled by its entry of q; a column of zeros, which has no scale, not at all.
    """
    row_power, column_power = np.zeros(q.size), np.zeros(q.size)
    for _ in range(SWEEPS):
        rows, columns = linalg.row_and_column_maxima(M, np.exp2(row_power), np.exp2(column_power))
        row_change, column_change = _half_power(rows), _half_power(columns)
        if not row_change.any() and not column_change.any():
            break
        row_power -= row_change
        column_power -= column_change
    empty = (rows == 0) & (q != 0)
    row_power[empty] = -2 * _half_power(np.abs(q[empty]))
    return np.exp2(row_power), np.exp2(column_power)


def _half_power(sizes: Vector) -> Vector:
    """Half the binary exponent of each size, rounded to a whole number; 0 where the size is 0."""
    half: Vector = np.rint(0.5 * np.log2(sizes, where=sizes > 0, out=np.zeros_like(sizes)))
    return half
