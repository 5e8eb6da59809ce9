"""A mixed problem as one in bounded variables 0 <= y <= d, for pivoting: its free variables are eliminated.

With bounded variables B and free ones F, equations M_FB z_B + M_FF z_F + q_F = 0 have the solutions z_F = V u - E (M_FB
z_B + q_F), for all u, if U' (M_FB z_B + q_F) = 0, where the columns of U and V span the null spaces of M_FF' and of
M_FF, and E is an inverse, or a pseudo-inverse. What is left is

    w_B = K z_B + H u + k, G z_B + g = 0:  K = M_BB - M_BF E M_FB, H = M_BF V, G = U' M_FB.

As an equation has no partner, any invertible combination R G is the same: R by least squares, R G ~ -H', shows that M
is monotone, or that of a program, whatever the order, signs, and factors of its equations are. Such an M is so on the
null space of G; with the orthogonal projections P along the rows of G, and Q along the columns of H, K z_B is Q K P z_B
but for terms in g and, as they may be added to u, those in the range of H, and Q K P is positive semidefinite
everywhere. Then u = a - b with a, b >= 0.
"""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.units import equilibrate, half_power
from lcpcli.model.box import Box, of_masks
from lcpcli.typing import Mask, States, Vector

NEAR_ONE = 2.0**8  # largest entries of rows and columns up to this, and from its inverse on, are not scaled
NEAR_UNITS = 2.0**20  # ratio of the units of rows to those of columns up to which they are made the same
SMALLEST = 1e-9  # relative: singular values that count as 0, in equilibrated units
CANCELLED = 1e-13  # relative to the largest entry: what elimination leaves of zeros, as of redundant equations
DEPENDENT = 1e-12  # relative: singular values of rows of G that count as 0


class Solved(NamedTuple):
    """The solutions x = E r + V u of A x = r, for all u, if U' r = 0: A E A = A, U' A = 0, A V = 0.

    E : shape (f, f). U, V : shape (f, f - rank).
    """

    E: Vector
    U: Vector
    V: Vector


def solved(A: Vector) -> Solved:
    """Return the solutions of all systems with the square matrix A, in equilibrated units."""
    f = A.shape[0]
    with suppress(np.linalg.LinAlgError):
        E = np.asarray(np.linalg.inv(A), np.float64)
        if np.abs(E).max() * np.abs(A).max() < 1 / SMALLEST:
            return Solved(E, np.empty((f, 0)), np.empty((f, 0)))
    U, values, V = np.linalg.svd(A)
    rank = np.count_nonzero(values > SMALLEST * values[0])
    return Solved(V[:rank].T / values[:rank] @ U[:, :rank].T, U[:, rank:], V[rank:].T)


def combinations(G: Vector, H: Vector) -> Vector:
    """Return an invertible R with R G ~ -H' in the sense of least squares, or nearly such where there is none.

    G, H : shapes (s, b) and (b, s).
    """
    R: Vector = -np.linalg.lstsq(G.T, H, rcond=DEPENDENT)[0].T
    _, U, V = solved(R)
    R += U @ V.T
    return R


def _has_near_units(A: Vector) -> bool:
    """Return whether all rows and columns but those of zeros have largest entries of about size 1."""
    sizes = np.abs(A)
    largest = np.concatenate([sizes.max(axis=0, initial=0.0), sizes.max(axis=1, initial=0.0)])
    used = largest[largest > 0.0]
    return not used.size or bool(used.max() <= NEAR_ONE and used.min() >= 1 / NEAR_ONE)


class Reduction:
    """A mixed problem in bounded variables: K y + k has the signs that 0 <= y <= d ask for, with k from any q.

    K, d : shapes (m, m) and (m,). units : the factors of the rows of K, shape (m,).

    Variables with an upper bound only are mirrored, fixed ones are left out, and rows and columns are equilibrated. The
    unknowns y are the bounded variables in order, and then a and b.
    """

    def __init__(self, M: Vector, box: Box) -> None:
        self.M, self.n, self.box = M, M.shape[0], box
        n = self.n
        lower, upper = box.vectors(n)
        self.corner = np.broadcast_to(box.corner, n)
        self.kept = kept = (lower != upper).nonzero()[0]
        low, high = np.isfinite(lower[kept]), np.isfinite(upper[kept])
        self.mirrored = high & ~low
        self.turn = np.where(self.mirrored, -1.0, 1.0)
        A = M.copy() if kept.size == n else M[kept[:, np.newaxis], kept]
        if self.mirrored.any():
            A *= self.turn[:, np.newaxis]
            A *= self.turn
        self.bounded, self.free = (low | high).nonzero()[0], (~(low | high)).nonzero()[0]
        self.rows = self.columns = np.ones(kept.size)
        if not _has_near_units(A):
            self.rows, self.columns = equilibrate(A, np.zeros(kept.size))
            A *= self.rows[:, np.newaxis]
            A *= self.columns
        self.K = A
        if self.free.size:
            self._eliminate(A)
        self.units = self.rows[self.bounded]
        if self.free.size:
            self._split()
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
        widths: Vector = (upper - lower)[self.kept[self.bounded]] / self.columns[self.bounded]
        return np.append(widths, np.full(len(self.K) - widths.size, np.inf))

    def _eliminate(self, A: Vector) -> None:
        """Eliminate free variables from the scaled matrix A."""
        B, F = self.bounded, self.free
        self.E, self.U, self.V = solved(A[np.ix_(F, F)])
        if self.V.size:
            self._make_units_the_same(A)
        self.A_BF, A_FB = A[np.ix_(B, F)], A[np.ix_(F, B)]
        self.X = self.E @ A_FB
        K, G, H = A[np.ix_(B, B)] - self.A_BF @ self.X, self.U.T @ A_FB, self.A_BF @ self.V
        size = max(np.abs(each).max(initial=0.0) for each in (A, self.X, K))
        for each in (K, G, H):
            each[np.abs(each) <= CANCELLED * size] = 0.0
        self.K, self.G, self.H = K, G, H
        if not self.V.size:
            return
        R = combinations(G, H)
        self.U, self.G = self.U @ R.T, R @ G
        self._project(CANCELLED * size)

    def _make_units_the_same(self, A: Vector) -> None:
        """Scale rows and columns of bounded variables by the same factors, without which A is not monotone even if M
        is, unless these units are far apart."""
        B = self.bounded
        rows, columns = self.rows[B], self.columns[B]
        ratios = rows / columns
        if B.size and ratios.max() <= NEAR_UNITS * ratios.min():
            units = np.exp2(half_power(rows * columns))
            A[B] *= (units / rows)[:, np.newaxis]
            A[:, B] *= units / columns
            self.rows, self.columns = self.rows.copy(), self.columns.copy()
            self.rows[B] = self.columns[B] = units

    def _project(self, cancelled: float) -> None:
        """Put Q K P in place of K."""
        G_inverse, H_inverse = (np.linalg.pinv(each, rcond=SMALLEST) for each in (self.G, self.H))
        self.of_equations = self.K @ G_inverse
        K = self.K - self.of_equations @ self.G
        self.Y = H_inverse @ K
        self.K = K - self.H @ self.Y
        self.K[np.abs(self.K) <= cancelled] = 0.0

    def _split(self) -> None:
        """Replace u by a - b, and the equations G z_B + g = 0 by inequalities in both directions."""
        G, H, s = self.G, self.H, self.V.shape[1]
        if s:
            zero = np.zeros((s, s))
            self.K = np.block([[self.K, H, -H], [G, zero, zero], [-G, zero, zero]])
            self.units = np.append(self.units, np.ones(2 * s))

    def constants(self, q: Vector) -> Vector:
        """Return k for a q of shape (n,); the z of later calls are for this q."""
        b: Vector = q + self.M @ self.corner if np.count_nonzero(self.corner) else q
        b = self.rows * (self.turn * b[self.kept])
        if not self.free.size:
            return b
        self.offset = -self.E @ b[self.free]
        k: Vector = b[self.bounded] + self.A_BF @ self.offset
        if not self.V.size:
            return k
        g = self.U.T @ b[self.free]
        g[np.abs(g) <= CANCELLED * np.abs(b).max()] = 0.0
        return np.concatenate([k - self.of_equations @ g, g, -g])

    def given(self, y: Vector, basic: Mask, at_upper: Mask) -> tuple[Vector, States]:
        """Return z and its states for y and its states."""
        z = self.corner + self._direction(y, 0.0 if not self.free.size else self.offset)
        inside, upper = np.zeros(self.n, np.bool_), np.zeros(self.n, np.bool_)
        inside[self.kept[self.free]] = True
        bounded = self.kept[self.bounded]
        inside[bounded] = basic[: bounded.size]
        upper[bounded] = ~inside[bounded] & (at_upper[: bounded.size] ^ self.mirrored[self.bounded])
        return z, of_masks(inside, upper)

    def direction(self, y: Vector) -> Vector:
        """Return the direction of z for one of y."""
        return self._direction(y, 0.0)

    def _direction(self, y: Vector, offset: Vector | float) -> Vector:
        """Return z - corner, if free variables have this offset."""
        v, own, s = np.zeros(self.kept.size), y[: self.bounded.size], self.units.size - self.bounded.size
        v[self.bounded] = own
        if self.free.size:
            v[self.free] = offset - self.X @ own
        if s:
            a, b = np.split(y[own.size :], 2)
            v[self.free] += self.V @ (a - b - self.Y @ own)
        z = np.zeros(self.n)
        z[self.kept] = self.turn * self.columns * v
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
