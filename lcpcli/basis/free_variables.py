"""The reduction of a mixed problem to bounded variables (see `bounded_form`), for any q and for other bounds.

A sparse mixed problem without its free variables, whose equations have a unique solution for given other variables.

From M_FF z_F = -(M_FB z_B + q_F) for the free variables F, by sparse factors, there are left w_B = K z_B + k of the
bounded ones B, with K = M_BB - M_BF M_FF^{-1} M_FB, which is dense.
"""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np

from lcpcli.basis import bounded_form
from lcpcli.basis.bounded_form import DEPENDENT
from lcpcli.linalg import units
from lcpcli.linalg.factors import SingularMatrix, sparse_lu
from lcpcli.linalg.matrices import product
from lcpcli.model.box import BASIC, Box, of_masks
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, States, Vector

NEAR_ONE = 2.0**8  # largest entries of rows and columns up to this, and from its inverse on, are not scaled


def are_near_one(sizes: Vector) -> bool:
    """Return whether all of these sizes but zeros are of about size 1."""
    used = sizes[sizes > 0.0]
    return bool(used.size == 0 or (used.max() <= NEAR_ONE and used.min() >= 1.0 / NEAR_ONE))


def exponents(A: Vector) -> Vector:
    """Return the exponents of the factors of rows, and then of columns, that `Reduction` uses: 0 if all of these have
    largest entries of about size 1; none where `equilibrate` has to be asked, as it would balance logarithms."""
    sizes = units.sizes_in_units(A, np.zeros(2 * A.shape[0]))
    if are_near_one(sizes):
        return np.zeros(sizes.size)
    return units.moderate_powers(A, sizes, np.abs(np.diag(A)))


def scaled(A: Vector, powers: Vector) -> tuple[Vector, Vector]:
    """Scale rows and columns of A by powers of two with their `exponents`; return these factors."""
    n, factors = A.shape[0], np.exp2(powers)
    rows, columns = (factors[:n], factors[n:]) if factors.size else units.equilibrate(A, np.zeros(n))
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
        rows, columns = scaled(A, exponents(A))
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
        return self.corner + self.direction(y, self.offset), bounded_form.given_states(self._own, self.n, states)

    def direction(self, y: Vector, offset: Vector | None = None) -> Vector:
        """Return the direction of z for one of y, or z - corner if free variables have this offset."""
        z, offset = np.zeros(self.n), np.zeros(self.free.size) if offset is None else offset
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


MOST_REDUCED = 500  # bounded variables: their K is dense
LARGEST = 1e10  # relative to the entries of M: those of M_FF^{-1} M_FB, above which M_FF counts as singular


class WithoutFree:
    """The problem in the bounded variables. Raises SingularMatrix if M_FF is singular, or nearly so, if there are no
    free variables, or if there are more than MOST_REDUCED bounded ones.

    problem : with a sparse M. bounded : its bounded variables, those of `reduced`, with dense K.
    """

    def __init__(self, problem: Problem) -> None:
        M, box = problem.M, problem.box
        lower, upper = box.vectors(problem.n)
        is_free = ~(np.isfinite(lower) | np.isfinite(upper))
        self._problem, self._free, self.bounded = problem, is_free.nonzero()[0], (~is_free).nonzero()[0]
        if not self._free.size or self.bounded.size > MOST_REDUCED:
            raise SingularMatrix
        rows, others = M[self._free], M[self.bounded]
        self._lu: Any = sparse_lu(False)(rows[:, self._free])
        self._columns, across = rows[:, self.bounded], others[:, self._free]
        X = self._lu.solve(self._columns.toarray())
        if not np.abs(X).max(initial=0.0) <= LARGEST:
            raise SingularMatrix
        K = others[:, self.bounded].toarray() - product(across, X)
        k = problem.q[self.bounded] - product(across, self._lu.solve(problem.q[self._free]))
        self.reduced = Problem(K, k, lower=lower[self.bounded], upper=upper[self.bounded])

    def given(self, z: Vector, basis: States) -> tuple[Vector, States]:
        """Return z of the given problem, and its states, for those of the bounded variables."""
        whole, states = np.empty(self._problem.n), np.full(self._problem.n, BASIC, np.int8)
        whole[self.bounded], states[self.bounded] = z, basis
        whole[self._free] = -self._lu.solve(product(self._columns, z) + self._problem.q[self._free])
        return whole, states
