"""Systems with rows and columns of a sparse M, by factors that are followed by the product form of the inverse (G. B.
Dantzig and W. Orchard-Hays, Mathematical Tables and Other Aids to Computation 8 (1954) 64-67)."""

from __future__ import annotations

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import factors
from lcpcli.linalg.matrices import product
from lcpcli.parametric.changing_system import LEAST_PIVOT, MOST_CHANGES, NOTHING, ChangingSystem
from lcpcli.typing import Indices, Matrix, Vector


class SparseSystem(ChangingSystem):
    """The factors of [A_C, E] for a sparse M, where E has the unit columns of the rows outside R, and later changes.

    The interface is that of `DenseSystem`. Columns are numbered as in J = [M, c, I].
    """

    def __init__(self, M: Matrix, moved: Vector) -> None:
        super().__init__(M, moved)
        self._M = M
        self._slots: Indices = np.arange(self.n + 1, 2 * self.n + 1)  # the column of J in each place
        self._place_of: Indices = np.append(np.full(self.n + 1, -1), np.arange(self.n))
        self._changes: list[tuple[int, Vector]] = []

    @property
    def rows(self) -> Indices:
        """Return R."""
        return np.flatnonzero(self._place_of[self.n + 1 :] < 0)

    @property
    def cols(self) -> Indices:
        """Return C."""
        return self._slots[self._slots <= self.n]

    def has(self, col: int) -> bool:
        """Return whether a column is in C."""
        return bool(self._place_of[col] >= 0)

    def solve(self, b: Vector) -> Vector:
        """Return the x with A_RC x = b_R, for b of shape (n,)."""
        return np.asarray(self._solution(b)[self._slots <= self.n])

    def solve_column(self, col: int) -> Vector:
        """Return the x with A_RC x = a_R for the column a, which may be the next one to come into C."""
        self._solved = col, self._solution(self.column(col))
        return np.asarray(self._solved[1][self._slots <= self.n])

    def solve_unit(self, row: int) -> Vector:
        """Return the x with A_RC x = e_row."""
        return self.solve(_unit(self.n, row))

    def multipliers(self, col: int) -> Vector:
        """Return the y of shape (n,), zero outside R, with y'A_C = e_col."""
        y = _unit(self.n, self._place_of[col])
        for place, change in reversed(self._changes):
            y[place] -= (y @ change - y[place]) / change[place]
        return np.asarray(self._lu.solve(y, "T"))

    def times(self, x: Vector) -> Vector:
        """Return A_C x in all rows, shape (n,)."""
        values = np.zeros(self.n + 1)
        values[self.cols] = x
        return np.asarray(product(self._M, values[:-1]) + values[-1] * self.moved)

    def add(self, row: int, col: int) -> None:
        """Add a row to R and a column to C."""
        self._replace(self.n + 1 + row, col)

    def drop(self, row: int, col: int) -> None:
        """Take a row from R and a column from C."""
        self._replace(col, self.n + 1 + row)

    def replace_column(self, old: int, new: int) -> None:
        """Put another column in the place of one in C, or its new values in the place of column n."""
        self._replace(old, new)

    def replace_row(self, old: int, new: int) -> None:
        """Put another row in the place of one in R."""
        self._replace(self.n + 1 + new, self.n + 1 + old)

    def refresh(self) -> None:
        """Compute the factors from scratch; raise SingularMatrix if there are none."""
        with imports:
            from scipy.sparse import csc_array, eye_array, hstack
        cols, rows = self.cols, self.rows
        self._slots = np.arange(
            self.n + 1, 2 * self.n + 1
        )  # with the diagonal of M in its places, as far as it is there
        self._slots[cols[cols < self.n]] = cols[cols < self.n]
        if self.has(self.n):
            self._slots[rows[self._slots[rows] > self.n]] = self.n
        self._place_of[self._slots] = np.arange(self.n)
        J = hstack([csc_array(self._M), csc_array(self.moved[:, np.newaxis]), eye_array(self.n)], format="csc")
        self._lu = factors.sparse_lu(symmetric=False)(J[:, self._slots].tocsr())
        self._changes, self.age = [], 0

    def begin(self, basic: Indices) -> None:
        """Set R and C to some indices; raise SingularMatrix if A_RC is singular."""
        self._slots[basic], self._place_of[basic], self._place_of[self.n + 1 + basic] = basic, basic, -1
        self.refresh()

    def _replace(self, old: int, new: int) -> None:
        place = self._place_of[old]
        last, change = self._solved
        if last != new:
            change = self._solution(self.column(new) if new <= self.n else _unit(self.n, new - self.n - 1))
        self._solved = NOTHING
        self.age = self.age + 1 if abs(change[place]) > LEAST_PIVOT * np.abs(change).max() else MOST_CHANGES + 1
        self._changes.append((place, change))
        self._place_of[old] = -1
        self._slots[place], self._place_of[new] = new, place

    def _solution(self, b: Vector) -> Vector:
        x: Vector = self._lu.solve(b)
        for place, change in self._changes:
            own = x[place] / change[place]
            x -= own * change
            x[place] = own
        return x


def _unit(n: int, at: int) -> Vector:
    e = np.zeros(n)
    e[at] = 1.0
    return e
