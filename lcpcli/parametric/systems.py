"""Systems A_RC x = b with rows R and columns C of A = [M, c], which change by one row
or column at a time.

For a dense M the inverse is updated by the product form (G. B. Dantzig and W.
Orchard-Hays, The product form for the inverse in the simplex method, Mathematical
Tables and Other Aids to Computation 8 (1954) 64-67), and by bordering (J. Sherman and
W. J. Morrison, Annals of Mathematical Statistics 21 (1950) 124-127); the factors of a
sparse M are updated by the product form.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import factors
from lcpcli.linalg.matrices import column_reader, product
from lcpcli.typing import Indices, Matrix, Vector

# A pivot below this, relative to the terms that it is a sum of, has lost half of its
# digits, and is not used.
MIN_PIVOT = 2.0**-26
MAX_CHANGES = 64  # changes after which factors are recomputed from scratch
NOTHING: tuple[int, Vector] = -1, np.zeros(0)  # the solution for no column


class BasisFactorization(ABC):
    """The part that the dense and the sparse systems share.

    moved : column n of A, which is c; the others are those of M. age : the number of
        changes since factors were computed from scratch; more than MAX_CHANGES after a
        pivot that is not clearly different from 0. Columns are numbered as in J = [M,
        c, I], where C has the unit column of each row that is not in R.
    """

    def __init__(self, M: Matrix, moved: Vector) -> None:
        self.n = moved.size
        self.moved = moved
        self.age = 0
        self._column_of_M = column_reader(M)
        self._solved = NOTHING  # the last column that was solved for, with the solution

    def column(self, col: int) -> Vector:
        """Return a column of A, shape (n,)."""
        return self.moved if col == self.n else self._column_of_M(col)

    @abstractmethod
    def refresh(self) -> None:
        """Compute the factors from scratch; raise SingularMatrix if A_RC is
        singular."""


class DenseBasisFactorization(BasisFactorization):
    """The inverse of A_RC, of order k, and the columns of A in C, each of shape (n,).

    If the pivot of an update is not clearly different from 0, the inverse is marked to
    be recomputed from scratch.
    """

    def __init__(self, M: Matrix, moved: Vector) -> None:
        super().__init__(M, moved)
        n, self.k = self.n, 0
        self._rows, self._cols = np.zeros((2, n + 1), dtype=np.intp)
        # The position of a column in C, or at index n + 1 + i that of row i in R; and
        # zeros, for the entries of a unit column in the other rows.
        self._at, self._nothing = np.full(2 * n + 1, -1), np.zeros(n)
        # The operating system allocates the memory only as it is used.
        self._columns, self._inverse = np.zeros((n + 1, n)), np.zeros((n + 1, n + 1))

    @property
    def rows(self) -> Indices:
        """Return R."""
        return self._rows[: self.k]

    @property
    def cols(self) -> Indices:
        """Return C."""
        return self._cols[: self.k]

    def has(self, col: int) -> bool:
        """Return whether a column is in C."""
        return bool(self._at[col] >= 0)

    @property
    def inverse(self) -> Vector:
        """Return the inverse of A_RC."""
        return self._inverse[: self.k, : self.k]

    @property
    def columns(self) -> Vector:
        """Return the columns of A in C, shape (k, n)."""
        return self._columns[: self.k]

    def solve(self, b: Vector) -> Vector:
        """Return the x with A_RC x = b_R, for b of shape (n,)."""
        return np.asarray(self.inverse @ b[self.rows])

    def solve_column(self, col: int) -> Vector:
        """Return the x with A_RC x = a_R for the column a, which is stored, as the
        column may be the next one to enter C.
        """
        self._solved = col, self.solve(self.column(col))
        return self._solved[1]

    def solve_unit(self, row: int) -> Vector:
        """Return the x with A_RC x = e_row."""
        return np.array(self._inverse[: self.k, self._at[self.n + 1 + row]])

    def multipliers(self, col: int) -> Vector:
        """Return the y of shape (n,), zero outside R, with y'A_C = e_col."""
        y = np.zeros(self._columns.shape[1])
        y[self.rows] = self._inverse[self._at[col], : self.k]
        return y

    def times(self, x: Vector) -> Vector:
        """Return A_C x in all rows, shape (n,)."""
        return np.asarray(x @ self.columns)

    def exchange(self, old: int, new: int) -> None:
        """Replace a column of J by another one, or column n by its new values: one step
        of the product form for the inverse of [A_C, E], whose rows that belong to
        columns of I are not stored.
        """
        # The rows that enter and leave R; negative if the columns are those of A.
        k = self.k
        X = self.inverse
        coming = old - self.n - 1
        leaving = new - self.n - 1
        if leaving < 0:
            column, change = self.column(new), self._coming(new)
        else:
            column, change = self._nothing, X[:, self._at[new]].copy()
        if coming >= 0:
            row = self._columns[:k, coming]
            value = column[coming]
            position = k
            terms = abs(value) + np.abs(row) @ np.abs(change)
            self._inverse[k, :k] = -(row @ X)
            self._inverse[:k, k] = 0.0
            self._inverse[k, k] = 1.0
            change = np.append(change, value - row @ change)
            self._rows[k] = coming
            self._at[old] = k
            self.k = k + 1
        else:
            position, self._at[old] = self._at[old], -1
            others = np.abs(X[position])
            terms = (
                others @ np.abs(column[self.rows])
                if leaving < 0
                else max(others.max(), np.abs(change).max())
            )
        X = self.inverse
        X[position] /= self._pivot(change[position], terms)
        change[position] = 0.0
        X -= np.outer(change, X[position])
        self.age += 1
        if leaving < 0:
            self._cols[position] = new
            self._columns[position] = column
            self._at[new] = position
            return
        last = self.k - 1
        self.k = last
        p = self._at[new]
        self._at[new] = -1
        X[:, p], X[position] = X[:, last], X[last]
        if p != last:
            self._rows[p] = self._rows[last]
            self._at[self.n + 1 + self._rows[p]] = p
        if position != last:
            self._cols[position] = self._cols[last]
            self._columns[position] = self._columns[last]
            self._at[self._cols[position]] = position

    def refresh(self) -> None:
        block = self.columns[:, self.rows].T
        self._inverse[: self.k, : self.k] = np.linalg.inv(block)
        self.age = 0

    def begin(self, basic: Indices) -> None:
        """Set R and C to some indices; raise SingularMatrix if A_RC is singular."""
        for k, at in enumerate(basic.tolist()):
            self._rows[k] = self._cols[k] = at
            self._columns[k] = self.column(at)
            self._at[[at, self.n + 1 + at]] = k
        self.k = basic.size
        self.refresh()

    def _coming(self, col: int) -> Vector:
        """Return the x with A_RC x = a_R for a column a that enters C, from the last
        solve if that was for it.
        """
        last, x = self._solved
        self._solved = NOTHING
        return x.copy() if last == col else self.solve(self.column(col))

    def _pivot(self, value: float, terms: float) -> float:
        """Return a pivot; if it is too small, return 1 and have the inverse recomputed
        from scratch.
        """
        if abs(value) > MIN_PIVOT * terms:
            return value
        self.age = MAX_CHANGES
        return 1.0


class SparseBasisFactorization(BasisFactorization):
    """LU factors of [A_C, E] for a sparse M, where E has the columns of I of the rows
    outside R, and the changes since they were computed (product form).

    The interface is that of `DenseBasisFactorization`.
    """

    def __init__(self, M: Matrix, moved: Vector) -> None:
        super().__init__(M, moved)
        self._M = M
        # The column of J at each position of the basis.
        self._slots: Indices = np.arange(self.n + 1, 2 * self.n + 1)
        self._position_of: Indices = np.append(
            np.full(self.n + 1, -1), np.arange(self.n)
        )
        self._changes: list[tuple[int, Vector]] = []

    @property
    def rows(self) -> Indices:
        return np.flatnonzero(self._position_of[self.n + 1 :] < 0)

    @property
    def cols(self) -> Indices:
        return self._slots[self._slots <= self.n]

    def has(self, col: int) -> bool:
        return bool(self._position_of[col] >= 0)

    def solve(self, b: Vector) -> Vector:
        return np.asarray(self._solution(b)[self._slots <= self.n])

    def solve_column(self, col: int) -> Vector:
        self._solved = col, self._solution(self.column(col))
        return np.asarray(self._solved[1][self._slots <= self.n])

    def solve_unit(self, row: int) -> Vector:
        return self.solve(_unit(self.n, row))

    def multipliers(self, col: int) -> Vector:
        y = _unit(self.n, self._position_of[col])
        for position, change in reversed(self._changes):
            y[position] -= (y @ change - y[position]) / change[position]
        return np.asarray(self._lu.solve(y, "T"))

    def times(self, x: Vector) -> Vector:
        values = np.zeros(self.n + 1)
        values[self.cols] = x
        return np.asarray(product(self._M, values[:-1]) + values[-1] * self.moved)

    def refresh(self) -> None:
        with imports:
            from scipy.sparse import csc_array, eye_array, hstack
        cols, rows = self.cols, self.rows
        # Columns of M are put at their diagonal positions.
        self._slots = np.arange(self.n + 1, 2 * self.n + 1)
        self._slots[cols[cols < self.n]] = cols[cols < self.n]
        if self.has(self.n):
            self._slots[rows[self._slots[rows] > self.n]] = self.n
        self._position_of[self._slots] = np.arange(self.n)
        J = hstack(
            [
                csc_array(self._M),
                csc_array(self.moved[:, np.newaxis]),
                eye_array(self.n),
            ],
            format="csc",
        )
        self._lu = factors.sparse_lu(symmetric=False)(J[:, self._slots].tocsr())
        self._changes, self.age = [], 0

    def begin(self, basic: Indices) -> None:
        self._slots[basic] = basic
        self._position_of[basic] = basic
        self._position_of[self.n + 1 + basic] = -1
        self.refresh()

    def exchange(self, old: int, new: int) -> None:
        position = self._position_of[old]
        last, change = self._solved
        if last != new:
            change = self._solution(
                self.column(new) if new <= self.n else _unit(self.n, new - self.n - 1)
            )
        self._solved = NOTHING
        self.age = (
            self.age + 1
            if abs(change[position]) > MIN_PIVOT * np.abs(change).max()
            else MAX_CHANGES + 1
        )
        self._changes.append((position, change))
        self._position_of[old] = -1
        self._slots[position], self._position_of[new] = new, position

    def _solution(self, b: Vector) -> Vector:
        """Return the x with [A_C, E] x = b, by the factors and the changes since."""
        x: Vector = self._lu.solve(b)
        for position, change in self._changes:
            step = x[position] / change[position]
            x -= step * change
            x[position] = step
        return x


def _unit(n: int, at: int) -> Vector:
    """Return the unit vector e_at of length n."""
    e = np.zeros(n)
    e[at] = 1.0
    return e
