"""The steps of presolve, each with its way back for z and for Farkas vectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

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


class Step(Protocol):
    """What a rule has done at one time. Both ways back change vectors of shape (n,) in place."""

    def fill(self, z: Vector) -> None:
        """Set the z_j of the columns that were removed, from those that were left."""

    def carry(self, y: Vector) -> None:
        """Turn Farkas' y of the rows after the step, 0 for the removed ones, into that of the rows before it."""

    @property
    def keeps_integers(self) -> bool:
        """Return whether integers have remained integers, so that nothing was rounded."""


@dataclass(frozen=True, eq=False)
class Known:
    """Variables of known values. Their rows serve no proof."""

    columns: Indices
    values: Vector

    def fill(self, z: Vector) -> None:
        z[self.columns] = self.values

    def carry(self, y: Vector) -> None:
        pass

    @property
    def keeps_integers(self) -> bool:
        return are_integers(self.values)


@dataclass(frozen=True, eq=False)
class Pivots:
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

    @property
    def keeps_integers(self) -> bool:
        return bool((np.abs(self.pivots) == 1).all())


@dataclass(frozen=True, eq=False)
class Bounds:
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

    @property
    def keeps_integers(self) -> bool:
        return are_integers(self.at)


@dataclass(frozen=True, eq=False)
class Factors:
    """Rows times factors: of any sign for equations, positive for others; shape (n,)."""

    factors: Vector

    def fill(self, z: Vector) -> None:
        pass

    def carry(self, y: Vector) -> None:
        y *= self.factors

    @property
    def keeps_integers(self) -> bool:
        return bool((np.abs(self.factors) == 1).all())
