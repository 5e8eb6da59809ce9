"""A mixed problem as one in bounded variables 0 <= y <= d, for pivoting: its free variables are eliminated.

Equations of free variables have no partner, so that any invertible combination of them is the same problem; their
order, signs and factors often hide that M is monotone, or that of a program. With equations F and bounded rows B,
combinations R by least squares, R M_FB ~ -M_BF', show that again. Then free variables are eliminated by principal
pivots, of one or two pairs, which keep a monotone problem monotone, and what is left, the multipliers of rows without
free variables, is split into a - b. The other reduction, for M_FF that is regular but far from principal, as of
circuits, pivots on any equation and free variable, and combines only the equations that are left.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.units import equilibrate
from lcpcli.methods.tableau import exchange
from lcpcli.model.box import Basis, Box
from lcpcli.typing import Indices, Mask, Vector

NEAR_ONE = 2.0**8  # largest entries of rows and columns up to this, and from its inverse on, are not scaled
SMALLEST = 1e-9  # pivot, in equilibrated units: smaller ones count as rounding of 0
LEAST_SINGLE = 1e-3  # principal pivot of one pair, before those of two pairs are compared with it
CANCELLED = 1e-13  # relative to the largest entry: what elimination leaves of zeros, as of redundant equations
DEPENDENT = 1e-12  # relative: singular values of rows of M_FB that count as 0
DEFICIENT = 1e-9  # relative: singular values of R that count as 0


def combinations(G: Vector, H: Vector) -> Vector:
    """Return an invertible R with R G ~ -H' in the sense of least squares, or nearly such where there is none.

    G, H : M_FB and M_BF, shapes (f, b) and (b, f).
    """
    R: Vector = -np.linalg.lstsq(G @ G.T, G @ H, rcond=DEPENDENT)[0].T
    left, values, right = np.linalg.svd(R)
    zero = values <= DEFICIENT * values.max(initial=0.0)
    R += left[:, zero] @ right[zero]
    return R


def _has_near_units(A: Vector) -> bool:
    """Return whether all rows and columns but those of zeros have largest entries of about size 1."""
    sizes = np.abs(A)
    largest = np.concatenate([sizes.max(axis=0, initial=0.0), sizes.max(axis=1, initial=0.0)])
    used = largest[largest > 0.0]
    return not used.size or bool(used.max() <= NEAR_ONE and used.min() >= 1 / NEAR_ONE)


def eliminate(T: Vector, free: Indices, principal: bool) -> tuple[Indices, Indices]:
    """Exchange equations of free variables for free variables in T, in place; return the rows and columns exchanged.

    free : the indices of the free variables, whose rows are their equations. principal : whether only a pair, or two
    pairs, may be exchanged with each other.
    """
    rows, columns = free.copy(), free.copy()
    done_rows, done_columns = np.empty(free.size, np.int64), np.empty(free.size, np.int64)
    done = 0
    while rows.size:
        block = T[rows][:, columns]
        singles = np.abs(np.diag(block)) if principal else np.abs(block).ravel()
        at = int(np.argmax(singles))
        best, first, second = singles[at], at, at
        if not principal:
            first, second = at // columns.size, at % columns.size
        elif best <= LEAST_SINGLE and rows.size > 1:
            own = np.diag(block)
            pairs = np.sqrt(np.abs(np.multiply.outer(own, own) - block * block.T))
            at = int(np.argmax(pairs))
            if pairs[at // rows.size, at % rows.size] > max(best, SMALLEST):
                best, first, second = pairs[at // rows.size, at % rows.size], at // rows.size, at % rows.size
        if best <= SMALLEST:
            break
        i, k = rows[first], columns[second]
        exchange(T, i, k)
        done_rows[done], done_columns[done] = i, k
        done += 1
        if principal and i != k:
            exchange(T, k, i)
            done_rows[done], done_columns[done] = k, i
            done += 1
            rows = columns = rows[(rows != i) & (rows != k)]
        else:
            rows, columns = rows[rows != i], columns[columns != k]
    return done_rows[:done], done_columns[:done]


def _without(indices: Indices, some: Indices) -> Indices:
    """Return the indices but for some of them."""
    left: Indices = indices[~(indices[:, np.newaxis] == some).any(axis=1)]
    return left


class Reduction:
    """A mixed problem in bounded variables: K y + k has the signs that 0 <= y <= d ask for, with k from any q.

    K, d : shapes (m, m) and (m,). units : the factors of the rows of K, shape (m,).

    Variables with an upper bound only are mirrored, fixed ones are left out, and rows and columns are equilibrated. The
    unknowns y are the bounded variables in order, and then a and b for each free variable that is split.
    """

    def __init__(self, M: Vector, box: Box, principal: bool = True) -> None:
        n = M.shape[0]
        lower, upper = box.vectors(n)
        self.M, self.n = M, n
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
        self.R = self.R2 = np.empty((0, 0))
        if self.free.size and principal:
            self.R = combinations(A[self.free][:, self.bounded], A[self.bounded][:, self.free])
            A[self.free] = self.R @ A[self.free]
        self.rows = self.columns = np.ones(kept.size)
        if not _has_near_units(A):
            self.rows, self.columns = equilibrate(A, np.zeros(kept.size))
            A *= self.rows[:, np.newaxis]
            A *= self.columns
        self.T = self.K = A
        self.d = (upper - lower)[kept[self.bounded]] / self.columns[self.bounded]
        self.units = self.rows[self.bounded]
        self.solved = self.equations = self.eliminated = self.split = self.free
        if self.free.size:
            self._eliminate(principal)

    def _eliminate(self, principal: bool) -> None:
        """Eliminate free variables, and split those that are left."""
        T, B = self.T, self.bounded
        self.solved, self.eliminated = eliminate(T, self.free, principal)
        self.equations, self.split = (_without(self.free, some) for some in (self.solved, self.eliminated))
        S, s = self.split, self.split.size
        K, H, G, N = T[np.ix_(B, B)], T[np.ix_(B, S)], T[np.ix_(self.equations, B)], T[np.ix_(self.equations, S)]
        if s and not principal:  # in given units, as scaling rows and columns apart hides the structure
            self.R2 = combinations(G / self.columns[B], H / self.rows[B][:, np.newaxis])
            G, N = self.R2 @ G, np.zeros((s, s))
        self.K = np.block([[K, H, -H], [G, N, -N], [-G, -N, N]]) if s else K
        self.K[np.abs(self.K) <= CANCELLED * np.abs(T).max(initial=0.0)] = 0.0
        self.d = np.append(self.d, np.full(2 * s, np.inf))
        self.units = np.append(self.units, np.ones(2 * s))

    def constants(self, q: Vector) -> Vector:
        """Return k for a q of shape (n,); the z of later calls are for this q."""
        b: Vector = q + self.M @ self.corner if np.count_nonzero(self.corner) else q
        b = self.turn * b[self.kept]
        if self.R.size:
            b[self.free] = self.R @ b[self.free]
        b *= self.rows
        if not self.free.size:
            return b
        size = np.abs(b).max()
        of_equations = self.T[:, self.eliminated] @ b[self.solved]
        self.offset = -of_equations[self.solved]
        b -= of_equations
        g = self.R2 @ b[self.equations] if self.R2.size else b[self.equations]
        g = np.where(np.abs(g) <= CANCELLED * size, 0.0, g)
        return np.concatenate([b[self.bounded], g, -g])

    def given(self, y: Vector, basic: Mask, at_upper: Mask) -> tuple[Vector, Basis]:
        """Return z and its states for y and its states."""
        z = self.corner + self._direction(y, 0.0 if not self.free.size else self.offset)
        inside, upper = np.zeros(self.n, np.bool_), np.zeros(self.n, np.bool_)
        inside[self.kept[self.free]] = True
        bounded = self.kept[self.bounded]
        inside[bounded] = basic[: bounded.size]
        upper[bounded] = ~inside[bounded] & (at_upper[: bounded.size] ^ self.mirrored[self.bounded])
        return z, Basis(inside, upper)

    def direction(self, y: Vector) -> Vector:
        """Return the direction of z for one of y."""
        return self._direction(y, 0.0)

    def _direction(self, y: Vector, offset: Vector | float) -> Vector:
        """Return z - corner, if the eliminated variables have this offset."""
        v, m, s = np.zeros(self.kept.size), self.bounded.size, self.split.size
        v[self.bounded] = y[:m]
        if self.free.size:
            v[self.split] = y[m : m + s] - y[m + s :]
            rest = np.append(self.bounded, self.split)
            v[self.eliminated] = self.T[np.ix_(self.solved, rest)] @ v[rest] + offset
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
