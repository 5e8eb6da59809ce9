"""The reduction of a mixed problem to bounded variables (see `bounded_form`), for any q and for other bounds."""

from __future__ import annotations

from copy import copy

import numpy as np

from lcpcli.linalg.units import equilibrate
from lcpcli.methods import bounded_form
from lcpcli.methods.bounded_form import DEPENDENT
from lcpcli.model.box import Box, of_masks
from lcpcli.typing import Mask, States, Vector

NEAR_ONE = 2.0**8  # largest entries of rows and columns up to this, and from its inverse on, are not scaled


def _has_near_units(A: Vector) -> bool:
    """Return whether all rows and columns but those of zeros have largest entries of about size 1."""
    sizes = np.abs(A)
    largest = np.concatenate([sizes.max(axis=0, initial=0.0), sizes.max(axis=1, initial=0.0)])
    used = largest[largest > 0.0]
    return not used.size or bool(used.max() <= NEAR_ONE and used.min() >= 1 / NEAR_ONE)


def scaled(A: Vector) -> tuple[Vector, Vector]:
    """Equilibrate rows and columns of A; return their factors."""
    rows, columns = equilibrate(A, np.zeros(len(A)))
    A *= rows[:, np.newaxis]
    A *= columns
    return rows, columns


class Reduction:
    """A mixed problem in bounded variables: K y + k has the signs that 0 <= y <= d ask for, with k from any q.

    K, d : shapes (m, m) and (m,). units : the factors of the rows of K, shape (m,).

    Variables with an upper bound only are mirrored, fixed ones are left out, and rows and columns are equilibrated. The
    unknowns y are the bounded variables in order, and then a and b.
    """

    def __init__(self, M: Vector, box: Box) -> None:
        self.M, self.n, self.box = M, M.shape[0], box
        self.corner = np.broadcast_to(box.corner, self.n)
        self._own = bounded_form.kept(M, *box.vectors(self.n))
        A, self.kept, self.turn, self.bounded, self.free = self._own
        rows = columns = np.ones(self.kept.size)
        if not _has_near_units(A):
            rows, columns = scaled(A)
        self._found = bounded_form.eliminated(self._own, rows, columns)
        self.K, self.rows, self.columns = self._found[:3]
        self.units = np.append(self.rows[self.bounded], np.ones(len(self.K) - self.bounded.size))
        self.d = self._widths()

    def within(self, box: Box) -> Reduction | None:
        """Return the reduction for other bounds, which changes no more than the distances between them; None if other
        variables are free, fixed or bounded on other sides."""
        for before, now in zip(self.box.vectors(self.n), box.vectors(self.n), strict=True):
            if not np.array_equal(np.isfinite(before), np.isfinite(now)):
                return None
        if not np.array_equal(self.box.fixed, box.fixed):
            return None
        other = copy(self)
        other.box, other.corner = box, np.broadcast_to(box.corner, self.n)
        other.d = other._widths()
        return other

    def _widths(self) -> Vector:
        """Return the distances between the bounds of the unknowns."""
        lower, upper = self.box.vectors(self.n)
        return bounded_form.widths(self._own, self._found, upper - lower)

    def constants(self, q: Vector) -> Vector:
        """Return k for a q of shape (n,); the z of later calls are for this q."""
        w = q + self.M @ self.corner if np.count_nonzero(self.corner) else q
        k, self.offset = bounded_form.constants(self._own, self._found, w)
        return k

    def given(self, y: Vector, basic: Mask, at_upper: Mask) -> tuple[Vector, States]:
        """Return z and its states for y and its states."""
        states = of_masks(basic, at_upper & ~basic)
        return self.corner + self._direction(y, self.offset), bounded_form.given_states(self._own, self.n, states)

    def direction(self, y: Vector) -> Vector:
        """Return the direction of z for one of y."""
        return self._direction(y, np.zeros(self.free.size))

    def _direction(self, y: Vector, offset: Vector) -> Vector:
        """Return z - corner, if free variables have this offset."""
        z = np.zeros(self.n)
        z[self.kept] = bounded_form.direction(self._own, self._found, y, offset)
        return z

    def given_w(self, w: Vector) -> Vector:
        """Return w of the given bounded variables; 0 for the others."""
        own, B = np.zeros(self.n), self.bounded
        own[self.kept[B]] = self.turn[B] * w[: B.size] / self.rows[B]
        return own

    def multipliers(self, u: Vector) -> Vector:
        """Return the y of all rows, with M_F' y = 0 for free variables F as nearly as possible, for multipliers u of
        the reduced rows."""
        y, B = np.zeros(self.n), self.bounded
        y[self.kept[B]] = self.turn[B] * self.rows[B] * u[: B.size]
        if self.free.size:
            F = self.kept[self.free]
            y[F] = -np.linalg.lstsq(self.M[np.ix_(F, F)].T, self.M[:, F].T @ y, rcond=DEPENDENT)[0]
        return y
