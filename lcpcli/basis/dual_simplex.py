"""The dual simplex method on the dictionary of w = A z + b in double precision, warm
started each time a variable is fixed at 0.

C. E. Lemke, The dual method of solving the linear programming problem, Naval Research
Logistics Quarterly 1 (1954) 36-47. Its answers hold only up to rounding, and for A +
delta with a small delta > 0: the caller verifies them.
"""

from __future__ import annotations

import numpy as np

from lcpcli.basis.tableau import exchange
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import generator
from lcpcli.typing import Vector

# Usually added to A, relative to the largest |A_ij|: almost all proofs y then have A'y
# < 0 beyond rounding.
MARGIN = 2e-9
MAX_DENSE = 300  # rows or columns up to which a dense dictionary is pivoted
NEGLIGIBLE = 1e-6  # relative to the largest |b_i|: what the margin may add to A z
# Coefficients and violations up to this size are treated as 0, for A and b with entries
# of size 1.
ZERO = 1e-11
# Limit of pivots for each row of A: almost all take a few pivots in total.
MAX_PIVOTS = 5


class DualSimplex:
    """The nonnegative z and w with w = A z + b, A of shape (m, n), some of which are
    fixed at 0.

    Variables are numbered: z_j is j, and w_i is n + i. Each basic variable is written
    in terms of the nonbasic ones; the objective, a sum of all z with weights between 1
    and 2 by which ties are broken, has nonnegative coefficients.

    margin : what is added to A, relative to the largest |A_ij|.
    """

    def __init__(self, A: Vector, b: Vector, margin: float = MARGIN) -> None:
        m, n = A.shape
        self._size = float(np.abs(b).max(initial=0.0)) or 1.0
        self._margin = margin * float(np.abs(A).max(initial=0.0))
        # The objective is the last row; its constant is not used.
        cost = np.append(0.0, generator(0).uniform(1.0, 2.0, (n,)))
        self._dictionary = np.vstack(
            (np.column_stack((b / self._size, A + self._margin)), cost)
        )
        self._basic, self._nonbasic = np.arange(n, n + m), np.arange(n)
        # The nonbasic variables that are not fixed at 0.
        self._varies = np.ones(n, dtype=bool)

    @property
    def _rows(self) -> Vector:
        return self._dictionary[:-1]

    def point(self) -> tuple[Vector, Vector] | None:
        """Return z and w where all nonbasic variables are 0; None if z is so large that
        the margin, which is added to A, changes w by more than NEGLIGIBLE, relative to
        the largest |b_i|."""
        n = self._nonbasic.size
        values = np.zeros(n + self._basic.size)
        values[self._basic] = self._rows[:, 0]
        if self._margin * values[:n].sum() > NEGLIGIBLE:
            return None
        values *= self._size
        return values[:n], values[n:]

    def fix_at_zero(self, variable: int) -> Vector | None:
        """Fix a variable at 0, move to a feasible point and return None; or return
        multipliers, as `feasible` does."""
        if variable in self._basic:
            i = int(np.argmax(self._basic == variable))
            sign = -1.0 if self._rows[i, 0] > 0 else 1.0
            k = self._entering(sign * self._rows[i, 1:])
            if k is None:
                return (
                    self._multipliers(i, sign)
                    if abs(self._rows[i, 0]) > ZERO
                    else np.zeros(self._basic.size)
                )
            self._pivot(i, k)
        self._varies[self._nonbasic == variable] = False
        return self.feasible()

    def feasible(self) -> Vector | None:
        """Move to a feasible point and return None; or return y, the multipliers of w =
        A z + b that show that there is none, which are 0 if that takes too many
        pivots."""
        for _ in range(MAX_PIVOTS * self._basic.size):
            raise_if_timed_out()
            i = int(np.argmin(self._rows[:, 0]))
            if self._rows[i, 0] >= -ZERO:
                return None
            k = self._entering(self._rows[i, 1:])
            if k is None:
                return self._multipliers(i, 1.0)
            self._pivot(i, k)
        return np.zeros(self._basic.size)

    def _entering(self, row: Vector) -> int | None:
        """Return the nonbasic variable whose growth raises a row and keeps the
        objective's coefficients nonnegative."""
        usable = np.flatnonzero((row > ZERO) & self._varies)
        return (
            int(usable[np.argmin(self._dictionary[-1, 1:][usable] / row[usable])])
            if usable.size
            else None
        )

    def _pivot(self, i: int, k: int) -> None:
        exchange(self._dictionary, i, k + 1)
        self._basic[i], self._nonbasic[k] = self._nonbasic[k], self._basic[i]

    def _multipliers(self, i: int, sign: float) -> Vector:
        """Return the multipliers of w = A z + b in a row, times a sign."""
        n = self._nonbasic.size
        y = np.zeros(n + self._basic.size)
        y[self._nonbasic], y[self._basic[i]] = -sign * self._rows[i, 1:], sign
        return y[n:]
