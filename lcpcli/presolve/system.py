"""The rows and columns of a mixed problem while presolve removes some of them, and the steps by which it does, each
with its way back for z and for Farkas vectors.

Column j has the variable z_j, and row i is w_i = (M z + q)_i. The row of a bounded variable is its complement; the rows
of free variables are equations, and which of these belongs to which free variable makes no difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

LARGEST_INTEGER = 2.0**50  # sums of a few are exact
LARGEST_ENTRY = 2.0**25  # of integers in M: products of two are exact


def mask_of(n: int, indices: Indices) -> Mask:
    """Return a mask of shape (n,) that is true at these indices."""
    mask: Mask = np.zeros(n, dtype=bool)
    mask[indices] = True
    return mask


def summed(places: Indices, values: Vector, n: int) -> Vector:
    """Return the sums of the values at each of n places."""
    return np.bincount(places, values, n).astype(np.float64, copy=False)


def are_integers(values: Vector) -> bool:
    """Return whether all values are integers that doubles represent exactly."""
    return bool((np.rint(values) == values).all() and np.abs(values).max(initial=0.0) <= LARGEST_INTEGER)


class Entries(NamedTuple):
    """Entries of a matrix of shape (n, n)."""

    rows: Indices
    columns: Indices
    values: Vector

    def part(self, mask: Mask | Indices) -> Entries:
        return Entries(self.rows[mask], self.columns[mask], self.values[mask])

    def absolute(self) -> Entries:
        return self._replace(values=np.abs(self.values))

    def times(self, z: Vector) -> Vector:
        return summed(self.rows, self.values * z[self.columns], z.size)

    def transposed_times(self, y: Vector) -> Vector:
        return summed(self.columns, self.values * y[self.rows], y.size)


@dataclass(frozen=True, eq=False)
class Step:
    """What a rule has done at one time. Both ways back change vectors of shape (n,) in place; by default nothing.

    keeps_integers : whether integers have remained integers, so that nothing was rounded.
    """

    keeps_integers: bool

    def fill(self, z: Vector) -> None:
        """Set the z_j of the columns that were removed, from those that were left."""

    def carry(self, y: Vector) -> None:
        """Turn Farkas' y of the rows after the step, 0 for the removed ones, into that of the rows before it."""


@dataclass(frozen=True, eq=False)
class Known(Step):
    """Variables of known values. Their rows serve no proof."""

    columns: Indices
    values: Vector

    def fill(self, z: Vector) -> None:
        z[self.columns] = self.values


@dataclass(frozen=True, eq=False)
class Pivots(Step):
    """Equations a z_j + (other terms) + q = 0, each solved for a z_j, which is substituted in the other rows.

    in_rows, in_columns : the other entries of these rows, and of these columns.
    """

    rows: Indices
    columns: Indices
    pivots: Vector
    q: Vector
    in_rows: Entries
    in_columns: Entries

    def fill(self, z: Vector) -> None:
        z[self.columns] = -(self.q + self.in_rows.times(z)[self.rows]) / self.pivots

    def carry(self, y: Vector) -> None:
        """Let (M'y)_j be 0."""
        y[self.rows] = -self.in_columns.transposed_times(y)[self.columns] / self.pivots


@dataclass(frozen=True, eq=False)
class Bounds(Step):
    """Rows a z_j + q_i that are at least 0 where z_k is at its only bound (sign 1; or at most 0, sign -1), while z_k
    appears nowhere but as b z_k in the row of z_j: the row is a bound of z_j, and z_k its multiplier.

    rows, multipliers, columns, partners : the i, the k, the j, and the rows of the z_j.
    own : the bounds of the z_k. active : where z_j had no tighter bound. at : the new bounds.
    q, in_rows : of the partners, without z_k. in_columns : entries of the columns j, without row i.
    """

    rows: Indices
    multipliers: Indices
    columns: Indices
    partners: Indices
    a: Vector
    b: Vector
    sign: Vector
    own: Vector
    active: Mask
    at: Vector
    q: Vector
    in_rows: Entries
    in_columns: Entries

    def fill(self, z: Vector) -> None:
        """Let z_k make w_j 0 where z_j is at the new bound and w_j has the sign for it."""
        w = self.q + self.in_rows.times(z)[self.partners]
        change = -w / self.b
        needed = self.active & (z[self.columns] == self.at) & (self.sign * change > 0)
        z[self.multipliers] = self.own + np.where(needed, change, 0.0)

    def carry(self, y: Vector) -> None:
        """Let (M'y)_j be 0 where it has the sign with which the new bound counts."""
        share = -self.in_columns.transposed_times(y)[self.columns] / self.a
        y[self.rows] = np.where(self.active & (self.sign * share > 0), share, 0.0)


@dataclass(frozen=True, eq=False)
class Factors(Step):
    """Rows times factors: of any sign for equations, positive for others; shape (n,)."""

    factors: Vector

    def carry(self, y: Vector) -> None:
        y *= self.factors


ROUNDING = 8 * EPS  # relative to the terms of a sum
CANCELLED = 1e-14  # relative to the sum of their sizes: what rounding leaves of entries that cancel


class Contradiction(Exception):
    """Some rows cannot have the signs that are asked for, whatever z is; y : Farkas' vector for the rows."""

    def __init__(self, y: Vector) -> None:
        self.y = y


class System:
    """The rows and columns that are left, with the indices that they have in the problem.

    entries : those of M. q : what is left of it, with known values put in. lower, upper : bounds. row_of : the row of
    each column, -1 for columns that are removed. factors : by which rows were multiplied. terms : the sizes of what was
    added up to q, and rounded. All of shape (n,). keeps_all : whether nothing but 0 counted as rounding, and
    no entry of M became so large that rounding may have changed it, if all are integers.
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
        self.n, self.entries, self.q, self.terms = n, entries, problem.q.copy(), np.abs(terms)
        self.lower, self.upper = (bound.copy() for bound in problem.box.vectors(n))
        self.row_of, self.factors, self.keeps_all = np.arange(n), np.ones(n), True

    @property
    def columns(self) -> Indices:
        """Return the columns that are left."""
        return np.flatnonzero(self.row_of >= 0)

    @property
    def free(self) -> Mask:
        """Return which columns have free variables."""
        mask: Mask = (self.row_of >= 0) & np.isinf(self.lower) & np.isinf(self.upper)
        return mask

    @property
    def equations(self) -> Mask:
        """Return which rows are those of free variables."""
        return mask_of(self.n, self.row_of[self.free])

    @property
    def column_of(self) -> Indices:
        """Return the column of each row, -1 for rows that are removed."""
        found, columns = np.full(self.n, -1), self.columns
        found[self.row_of[columns]] = columns
        return found

    def counts(self) -> tuple[Indices, Indices]:
        """Return the numbers of entries in each row and in each column."""
        return np.bincount(self.entries.rows, minlength=self.n), np.bincount(self.entries.columns, minlength=self.n)

    def know(self, columns: Indices, values: Vector, rows: Indices | None = None) -> Known:
        """Remove variables of known values and, by default, their rows; else these rows, as many."""
        if rows is not None:
            self.pair(rows, columns)
        z = np.zeros(self.n)
        z[columns] = values
        self.q += self.entries.times(z)
        self._add_terms(self.entries.absolute().times(np.abs(z)))
        self._remove(columns)
        return Known(are_integers(values), columns, values)

    def pivot(self, rows: Indices, columns: Indices, pivots: Vector) -> Pivots:
        """Remove equations and variables; none of the equations has an entry in the column of another's variable. A
        bounded variable must be known to be inside its bounds, so that its row is the equation that is left."""
        of_row, of_column = np.full(self.n, -1), np.full(self.n, -1)
        of_row[rows], of_column[columns] = np.arange(rows.size), np.arange(rows.size)
        in_rows, in_columns = of_row[self.entries.rows] >= 0, of_column[self.entries.columns] >= 0
        others, own = self.entries.part(in_rows & ~in_columns), self.entries.part(in_columns & ~in_rows)
        step = Pivots(bool((np.abs(pivots) == 1).all()), rows, columns, pivots, self.q[rows], others, own)
        self.pair(rows, columns)
        self._remove(columns)
        place = of_column[own.columns]
        factor = -own.values / pivots[place]
        self.q += summed(own.rows, factor * step.q[place], self.n)
        self._add_terms(summed(own.rows, np.abs(factor) * self.terms[rows][place], self.n))
        others = others.part(np.argsort(of_row[others.rows], kind="stable"))
        number = np.bincount(of_row[others.rows], minlength=rows.size)
        first = np.cumsum(number) - number
        times = number[place]
        source = np.repeat(first[place] - (np.cumsum(times) - times), times) + np.arange(times.sum())
        if source.size:
            fill = Entries(
                np.repeat(own.rows, times), others.columns[source], np.repeat(factor, times) * others.values[source]
            )
            self._add(fill)
        return step

    def multiply(self, factors: Vector) -> Factors:
        """Multiply rows by factors, those of bounded variables by positive ones; shape (n,)."""
        entries = self.entries
        self.entries, self.q = entries._replace(values=entries.values * factors[entries.rows]), self.q * factors
        self.factors, self.terms = self.factors * factors, self.terms * np.abs(factors)
        return Factors(bool((np.abs(factors) == 1).all()), factors)

    def bound(self, step: Bounds, lower: Vector, upper: Vector) -> Bounds:
        """Remove rows that are bounds, with their multipliers, and set the bounds of the variables."""
        self.pair(step.partners, step.columns)
        self.lower, self.upper = lower, upper
        self.q[step.partners] = step.q
        self.terms[step.partners] += np.abs(step.b * step.own)
        self._remove(step.multipliers)
        return step

    def _add_terms(self, sizes: Vector) -> None:
        """Take note of the sizes of what was added to q; where only rounding is left of it, it is 0."""
        self.terms += sizes
        small = np.abs(self.q) <= ROUNDING * self.terms
        self.keeps_all &= not self.q[small].any()
        self.q[small] = 0.0

    def _add(self, more: Entries) -> None:
        """Add entries to those that are there, and leave out those that cancel."""
        values = np.concatenate((self.entries.values, more.values))
        own, other = (each.rows * self.n + each.columns for each in (self.entries, more))
        keys, place = np.unique(np.concatenate((own, other)), return_inverse=True)
        sums, sizes = (summed(place, each, keys.size) for each in (values, np.abs(values)))
        whole = Entries((keys // self.n).astype(np.intp), (keys % self.n).astype(np.intp), sums)
        left = np.asarray(np.abs(sums) > CANCELLED * sizes)
        self.keeps_all &= not sums[~left].any() and float(sizes.max()) <= LARGEST_ENTRY
        self.entries = whole.part(left)

    def pair(self, rows: Indices, columns: Indices) -> None:
        """Exchange rows, without removing any, until each of these is the row of its column."""
        moved = self.row_of[columns] != rows
        if not moved.any():
            return
        column_of = self.column_of
        for i, j in zip(rows[moved].tolist(), columns[moved].tolist(), strict=True):
            other, own = column_of[i], self.row_of[j]
            self.row_of[other], column_of[own] = own, other
            self.row_of[j], column_of[i] = i, j

    def _remove(self, columns: Indices) -> None:
        """Remove columns with their rows."""
        rows = mask_of(self.n, self.row_of[columns])
        self.row_of[columns] = -1
        self.entries = self.entries.part((self.row_of[self.entries.columns] >= 0) & ~rows[self.entries.rows])
