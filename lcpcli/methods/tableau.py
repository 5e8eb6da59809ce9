"""Lemke's tableau in double precision, kept as the inverse of the basis, for any size and any numbers.

The lexicographic rule after B. C. Eaves, The linear complementarity problem, Management Science 17 (1971) 612-634.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector

UPDATE_NOISE = 2.0**-36  # relative to the terms: what an update leaves below is zero, and ratios this close tie
RECOMPUTED_NOISE = 2.0**-42  # relative to the terms: sums just computed from M and q that are below are zero
TIE = 2.0**-30  # relative difference up to which quotients of entries of the inverse are equal
DOUBTFUL_PIVOT = 2.0**-26  # relative to its terms: a smaller pivot is recomputed before use, as cancellation spoils it
REFACTOR = 50  # minimum number of pivots between two inversions of the basis from scratch
REFACTOR_AT_TIES = 5  # minimum number of pivots if rows tie: there rounding can lead off the path


class Tableau:
    """A basis of w - M z - e z_0 = q, the inverse of its matrix and its basic solution.

    Variables are numbered: w_i is i, z_i is n + i, z_0 is 2 n. Column i of the inverse is a unit vector while w_i is
    basic; the others are the rows of `inverse`. They are also the columns of the tableau that were initially the
    identity, which the lexicographic rule uses.

    basic : the variable of each row, shape (n,).
    row_of : the row of each variable, shape (2 n + 1,), -1 if it is nonbasic.
    values : the basic solution, shape (n,).
    nonbasic_w : the k indices i of the nonbasic w_i.
    inverse : row s holds column nonbasic_w[s] of the inverse, shape (n, n), of which k rows are in use.
    age : pivots since the inverse was last computed from scratch.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.n = problem, problem.n
        self.column_of_M = matrices.column_reader(problem.M)
        self.basic: Indices = np.arange(self.n)
        self.row_of: Indices = np.append(self.basic, np.full(self.n + 1, -1))
        self.values: Vector = problem.q.copy()
        self.nonbasic_w: list[int] = []
        self.inverse: Vector = np.empty((self.n, self.n))
        self.work: Vector = np.empty((self.n, self.n))
        self.age = 0

    def value_of(self, variable: int) -> float:
        """Return the value of a basic variable."""
        return float(self.values[self.row_of[variable]])

    def x(self) -> Vector:
        """Return (z - w) / 2 of the basic solution; 0 where neither z_i nor w_i is basic."""
        x = np.zeros(2 * self.n + 1)
        x[self.basic] = self.values
        return 0.5 * (x[self.n : -1] - x[: self.n])

    def support(self, entering: int) -> Indices:
        """Return the i for which z_i is basic after `entering` has entered."""
        support = self.row_of[self.n : -1] >= 0
        if entering >= self.n:
            support[entering - self.n] = True
        return np.flatnonzero(support)

    def direction(self, column: Vector, entering: int) -> Vector:
        """Return the direction in z of the ray of an entering variable with this column."""
        ray = np.zeros(2 * self.n + 1)
        ray[self.basic] = np.maximum(-column, 0.0)
        ray[entering] = 1.0
        return ray[self.n : -1]

    def multipliers(self) -> Vector:
        """Return the multipliers of the row of z_0, which is basic: that row of the inverse, negated."""
        multipliers = np.zeros(self.n)
        multipliers[self.nonbasic_w] = -self.inverse[: len(self.nonbasic_w), self.row_of[2 * self.n]]
        return multipliers

    def first_pivot(self) -> tuple[Vector, int, Indices]:
        """Return the pivot by which z_0 enters the basis, just large enough for all w = q + e z_0 to be nonnegative."""
        tied = np.flatnonzero(self.values == self.values.min())
        return -np.ones(self.n), int(tied[-1]), tied  # the last one is the lexicographic minimum of [q | I]

    def next_pivot(self, entering: int) -> tuple[Vector, int, Indices]:
        """Return the entering column, the row of the leaving variable (-1 if there is none) and all tied rows.

        If z_0 is among the tied variables it leaves; else the lexicographic rule decides.
        """
        k = len(self.nonbasic_w)
        if self.age >= max(REFACTOR, k):
            self.invert()
        column, size = self._column(entering)
        row, tied = self._minimum_ratio(column)
        delicate = tied.size > 1 and self.age >= max(REFACTOR_AT_TIES, k**2 / self.n)
        if self.age and (row < 0 or delicate or column[row] < DOUBTFUL_PIVOT * size[row]):
            self.invert()
            column, size = self._column(entering)
            row, tied = self._minimum_ratio(column)
        return column, row, tied

    def pivot(self, column: Vector, row: int, tied: Indices, entering: int) -> int:
        """Exchange the basic variable of the row for the entering one; return the leaving variable. Entries of the
        inverse that cancel become zero."""
        leaving = int(self.basic[row])
        step = self.values[row] / column[row]
        change = step * column
        self.values -= change
        self.values[np.abs(self.values) <= UPDATE_NOISE * np.abs(change)] = 0.0
        self.values[tied] = 0.0
        self.values[row] = step
        if leaving < self.n:
            self.inverse[len(self.nonbasic_w)] = 0.0
            self.inverse[len(self.nonbasic_w), row] = 1.0
            self.nonbasic_w.append(leaving)
        inverse, change = self.inverse[: len(self.nonbasic_w)], self.work[: len(self.nonbasic_w)]
        quotients = inverse[:, row] / column[row]
        np.multiply(quotients[:, np.newaxis], column, out=change)
        inverse -= change
        np.abs(change, out=change)
        change *= UPDATE_NOISE
        cancelled = inverse <= change
        cancelled &= inverse >= np.negative(change, out=change)
        inverse[cancelled] = 0.0
        inverse[:, row] = quotients
        self.basic[row] = entering
        self.row_of[leaving], self.row_of[entering] = -1, row
        if entering < self.n:
            position, last = self.nonbasic_w.index(entering), len(self.nonbasic_w) - 1
            self.inverse[position] = self.inverse[last]
            self.nonbasic_w[position] = self.nonbasic_w[last]
            self.nonbasic_w.pop()
        self.age += 1
        return leaving

    def invert(self) -> None:
        """Compute the inverse and the basic solution from scratch; entries that are zero up to rounding become zero."""
        z_rows = np.flatnonzero(self.basic >= self.n)
        variables = self.basic[z_rows]
        nonbasic_w, basic_z = np.array(self.nonbasic_w, dtype=np.intp), np.flatnonzero(self.row_of[: self.n] >= 0)
        columns = np.full((self.n, z_rows.size), -1.0)
        from_M = variables < 2 * self.n
        columns[:, from_M] = -matrices.dense(self.problem.M[:, variables[from_M] - self.n])
        try:
            block = np.linalg.inv(columns[nonbasic_w])
        except np.linalg.LinAlgError:
            return
        size = np.abs(block) @ (np.abs(columns[nonbasic_w]) @ np.abs(block))
        block[np.abs(block) <= RECOMPUTED_NOISE * size] = 0.0
        rest = -(columns[basic_z] @ block)
        rest[np.abs(rest) <= RECOMPUTED_NOISE * (np.abs(columns[basic_z]) @ size)] = 0.0
        k, rows = z_rows.size, self.row_of[basic_z]
        self.inverse[:k, z_rows], self.inverse[:k, rows] = block.T, rest.T
        q = self.problem.q
        size = np.abs(q[nonbasic_w]) @ np.abs(self.inverse[:k])
        size[rows] += np.abs(q[basic_z])
        self.values = q[nonbasic_w] @ self.inverse[:k]
        self.values[rows] += q[basic_z]
        self.values[np.abs(self.values) <= RECOMPUTED_NOISE * size] = 0.0
        self.age = 0

    def _column(self, entering: int) -> tuple[Vector, Vector]:
        """Return the column of a variable in the tableau, and the size of the terms that its entries sum."""
        k = len(self.nonbasic_w)
        if entering < self.n:
            column = self.inverse[self.nonbasic_w.index(entering)].copy()
            return column, np.abs(column)
        m = self.column_of_M(entering - self.n)
        above, beside = -m[self.nonbasic_w], -m[self.basic[self.basic < self.n]]
        size = np.abs(above) @ np.abs(self.inverse[:k], out=self.work[:k])
        column = above @ self.inverse[:k]
        rows = np.flatnonzero(self.basic < self.n)
        column[rows] += beside
        size[rows] += np.abs(beside)
        column[np.abs(column) <= UPDATE_NOISE * size] = 0.0
        return column, size

    def _minimum_ratio(self, column: Vector) -> tuple[int, Indices]:
        rows = np.flatnonzero(column > 0)
        if not rows.size:
            return -1, rows
        ratios = np.maximum(self.values[rows], 0.0) / column[rows]
        tied = rows[ratios <= ratios.min() * (1 + UPDATE_NOISE)]
        if tied.size == 1:
            return int(tied[0]), tied
        auxiliary = int(self.row_of[2 * self.n])
        if auxiliary in tied:
            return auxiliary, tied
        return self._lexicographic_minimum(tied, column), tied

    def _lexicographic_minimum(self, rows: Indices, column: Vector) -> int:
        """Return the tied row whose row of the inverse, over its column entry, is lexicographically least."""
        positions = {i: position for position, i in enumerate(self.nonbasic_w)}
        units = [int(i) for i in self.basic[rows] if i < self.n]
        for i in sorted([*positions, *units]):
            if i in positions:
                quotients = self.inverse[positions[i], rows] / column[rows]
                least = quotients.min()
                rows = rows[quotients - least <= TIE * np.maximum(np.abs(quotients), abs(least))]
            else:
                rows = rows[rows != self.row_of[i]]
            if rows.size == 1:
                break
        return int(rows[-1])
