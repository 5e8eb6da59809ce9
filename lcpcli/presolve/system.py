"""The rows and columns of a mixed problem while presolve removes some of them, and its
steps, each with the inverse transformations of z and of Farkas vectors (postsolve).

Column j belongs to the variable z_j, and row i is w_i = (M z + q)_i. The row of a
bounded variable is its complement; the rows of free variables are equations, which may
be assigned to free variables in any order.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

LARGEST_INTEGER = 2.0**50  # sums of few integers up to this are exact


def mask_of(n: int, indices: Indices) -> Mask:
    """Return a mask of length n that is True at these indices."""
    mask: Mask = np.zeros(n, dtype=bool)
    mask[indices] = True
    return mask


def summed(positions: Indices, values: Vector, n: int) -> Vector:
    """Return the sums of the values at equal positions, shape (n,)."""
    return np.bincount(positions, values, n).astype(np.float64, copy=False)


class Entries(NamedTuple):
    """Entries of a matrix of shape (n, n)."""

    rows: Indices
    columns: Indices
    values: Vector

    def part(self, mask: Mask | Indices) -> Entries:
        return Entries(self.rows[mask], self.columns[mask], self.values[mask])

    def times(self, z: Vector) -> Vector:
        return summed(self.rows, self.values * z[self.columns], z.size)

    def transposed_times(self, y: Vector) -> Vector:
        return summed(self.columns, self.values * y[self.rows], y.size)


def unchanged(_: Vector) -> None:
    """Leave a vector unchanged, as the inverse transformation of a step without one."""


class PresolveStep(NamedTuple):
    """One application of a rule, with the inverse transformations, which modify vectors
    of shape (n,).

    keeps_integers : whether integers have remained integers, so that nothing was
        rounded.
    postsolve_primal : sets the z_j of the removed columns from those of the remaining
        ones.
    postsolve_dual : converts a Farkas vector y of the rows after the step, 0 for the
        removed ones, to one of the rows before it. Both are module-level functions with
        their first arguments bound, as steps are pickled.
    """

    keeps_integers: bool
    postsolve_primal: Callable[[Vector], None] = unchanged
    postsolve_dual: Callable[[Vector], None] = unchanged


def _solve(
    rows: Indices,
    columns: Indices,
    pivots: Vector,
    q: Vector,
    in_rows: Entries,
    z: Vector,
) -> None:
    """Set z_j to solve the removed equations."""
    z[columns] = -(q + in_rows.times(z)[rows]) / pivots


def _balance(
    rows: Indices, columns: Indices, pivots: Vector, in_columns: Entries, y: Vector
) -> None:
    """Set y_i of the removed rows such that (M'y)_j = 0 in the removed columns."""
    y[rows] = -in_columns.transposed_times(y)[columns] / pivots


def _scale(factors: Vector, y: Vector) -> None:
    """Multiply y by the factors of the rows."""
    y *= factors


class ReducedProblem:
    """The remaining rows and columns, with the indices that they have in the original
    problem.

    entries : those of M. q : the constants of the rows, with the definitions of removed
        variables put in.
    lower, upper : bounds. row_of : the row of each column, -1 for columns that are
        removed.
    factors : by which rows were multiplied. terms : the sizes of the terms of which q
        is the rounded sum.
    is_lossless : whether, if all are integers, nothing but 0 counted as rounding.
    """

    def __init__(self, problem: Problem) -> None:
        M, n = problem.M, problem.n
        if is_sparse(M):
            rows = np.repeat(np.arange(n), np.diff(M.indptr))
            entries = Entries(rows, M.indices.astype(np.intp), M.data).part(M.data != 0)
        else:
            rows, columns = np.nonzero(M)
            entries = Entries(rows, columns, M[rows, columns])
        terms = problem.q if problem.terms_of_q is None else problem.terms_of_q
        self.n = n
        self.entries = entries
        self.q = problem.q.copy()
        self.terms = np.abs(terms)
        self.lower, self.upper = problem.box.vectors(n)
        self.row_of = np.arange(n)
        self.factors = np.ones(n)
        self.is_lossless = True

    @property
    def columns(self) -> Indices:
        """Return the remaining columns."""
        return np.flatnonzero(self.row_of >= 0)

    @property
    def free(self) -> Mask:
        """Return which of the remaining variables are free."""
        return np.asarray(
            (self.row_of >= 0) & np.isinf(self.lower) & np.isinf(self.upper)
        )

    @property
    def equations(self) -> Mask:
        """Return which rows belong to free variables."""
        return mask_of(self.n, self.row_of[self.free])

    @property
    def column_of(self) -> Indices:
        """Return the column of each row, -1 for removed rows."""
        column_of_row, columns = np.full(self.n, -1), self.columns
        column_of_row[self.row_of[columns]] = columns
        return column_of_row

    def positions(self, rows: Indices, columns: Indices) -> Indices:
        """Return the positions of these entries in the list of entries, arbitrary ones
        for entries that are 0; there must be at least one entry.
        """
        keys = self.entries.rows * self.n + self.entries.columns
        order = np.argsort(keys)
        return np.asarray(
            order[
                np.searchsorted(keys[order], rows * self.n + columns).clip(
                    max=keys.size - 1
                )
            ]
        )

    def counts(self) -> tuple[Indices, Indices]:
        """Return the numbers of entries of each row and of each column."""
        return np.bincount(self.entries.rows, minlength=self.n), np.bincount(
            self.entries.columns, minlength=self.n
        )

    def pivot(self, rows: Indices, columns: Indices, pivots: Vector) -> PresolveStep:
        """Solve equations a z_j + (other terms) + q = 0, each for a free z_j, and
        remove both. Column j has at most one other entry, which is the only one of its
        row, so that the other terms replace it there and nothing is added up."""
        of_row, of_column = np.full(self.n, -1), np.full(self.n, -1)
        of_row[rows] = of_column[columns] = np.arange(rows.size)
        in_rows = of_row[self.entries.rows] >= 0
        in_columns = of_column[self.entries.columns] >= 0
        row_entries = self.entries.part(in_rows & ~in_columns)
        column_entries = self.entries.part(in_columns & ~in_rows)
        q = self.q[rows]
        terms = self.terms[rows]
        self.pair(rows, columns)
        self.remove(columns)
        position = of_column[column_entries.columns]
        factors, targets = np.zeros(rows.size), np.full(rows.size, -1)
        factors[position] = -column_entries.values / pivots[position]
        targets[position] = column_entries.rows
        self.q[column_entries.rows] += factors[position] * q[position]
        self.terms[column_entries.rows] += np.abs(factors[position]) * terms[position]
        self._round_q()
        source = of_row[row_entries.rows]
        moved = Entries(
            targets[source], row_entries.columns, factors[source] * row_entries.values
        )
        self._append(moved.part((moved.rows >= 0) & (moved.values != 0)))
        return PresolveStep(
            bool((np.abs(pivots) == 1).all()),
            partial(_solve, rows, columns, pivots, q, row_entries),
            partial(_balance, rows, columns, pivots, column_entries),
        )

    def multiply(self, factors: Vector) -> PresolveStep:
        """Multiply rows by factors, shape (n,); those of bounded variables by positive
        ones.
        """
        entries = self.entries
        self.entries = entries._replace(values=entries.values * factors[entries.rows])
        self.q = self.q * factors
        self.factors, self.terms = self.factors * factors, self.terms * np.abs(factors)
        return PresolveStep(
            bool((np.abs(factors) == 1).all()), postsolve_dual=partial(_scale, factors)
        )

    def _round_q(self) -> None:
        """Set each q_i to 0 that cannot be distinguished from rounding errors of its
        terms."""
        small = np.abs(self.q) <= ROW_ROUNDING * self.terms
        self.is_lossless &= not self.q[small].any()
        self.q[small] = 0.0

    def _append(self, more: Entries) -> None:
        """Add entries where there are none, and sort all by rows."""
        both = Entries(
            np.concatenate((self.entries.rows, more.rows)),
            np.concatenate((self.entries.columns, more.columns)),
            np.concatenate((self.entries.values, more.values)),
        )
        self.entries = both.part(np.argsort(both.rows * self.n + both.columns))

    def pair(self, rows: Indices, columns: Indices) -> None:
        """Permute rows, without removing any, until each of these rows belongs to its
        column.
        """
        is_moved = self.row_of[columns] != rows
        if not is_moved.any():
            return
        column_of = self.column_of
        for i, j in zip(
            rows[is_moved].tolist(), columns[is_moved].tolist(), strict=True
        ):
            column_of_i, row_of_j = column_of[i], self.row_of[j]
            self.row_of[column_of_i], column_of[row_of_j] = row_of_j, column_of_i
            self.row_of[j], column_of[i] = i, j

    def remove(self, columns: Indices) -> None:
        """Remove columns and their rows."""
        rows = mask_of(self.n, self.row_of[columns])
        self.row_of[columns] = -1
        self.entries = self.entries.part(
            (self.row_of[self.entries.columns] >= 0) & ~rows[self.entries.rows]
        )
