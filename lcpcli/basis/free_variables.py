"""A mixed problem as one in bounded variables 0 <= y <= d, for pivoting: its free
variables are eliminated.

With bounded variables B and free ones F, equations M_FB z_B + M_FF z_F + q_F = 0 have
the solutions z_F = V u - E (M_FB z_B + q_F), for all u, if U' (M_FB z_B + q_F) = 0,
where the columns of U and V span the null spaces of M_FF' and of M_FF, and E is an
inverse, or a pseudo-inverse. The reduced problem is

    w_B = K z_B + H u + k, G z_B + g = 0:  K = M_BB - M_BF E M_FB, H = M_BF V, G = U'
    M_FB.

As an equation has no complementary variable, any invertible combination R G is
equivalent: R by least squares, R G ~ -H', shows that M is monotone, or that of a
program, whatever the order, signs, and factors of its equations are. Such an M is so on
the null space of G; with the orthogonal projections P along the rows of G, and Q along
the columns of H, K z_B is Q K P z_B but for terms in g and, as they may be added to u,
those in the range of H, and Q K P is positive semidefinite everywhere. Then u = a - b
with a, b >= 0.

Where the equations of a sparse problem have a unique solution for bounded variables,
z_F = -M_FF^{-1} (M_FB z_B + q_F) by sparse factors, the reduced problem is w_B = K z_B
+ k, with K = M_BB - M_BF M_FF^{-1} M_FB, which is dense.
"""

from __future__ import annotations

from copy import copy
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli.linalg import units
from lcpcli.linalg.factors import SingularMatrix, finite, sparse_lu
from lcpcli.linalg.matrices import product
from lcpcli.model.box import BASIC, LOWER, Box, of_masks
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Indices, Mask, Vector

# The row and column factors of bounded variables are made the same if the largest of
# their ratios is at most this multiple of the smallest one.
NEAR_UNITS = 2.0**20
SMALLEST = 1e-9  # relative: singular values of equilibrated matrices treated as 0
# Relative to the largest entry: what cancellation leaves of zeros, as of redundant
# equations.
CANCELLED = 1e-13
DEPENDENT = 1e-12  # relative: singular values of rows of G that are treated as 0


class NonfixedVariables(NamedTuple):
    """The variables that are not fixed: `variable_indices` has their indices, and
    `bounded` and `free` have their positions in it.

    A : their M, where those with an upper bound only are reflected. reflection_signs :
        -1 for these, 1 for the others.
    """

    A: Vector
    variable_indices: Indices
    reflection_signs: Vector
    bounded: Indices
    free: Indices


Pair: TypeAlias = tuple[Vector, Vector]


class Eliminated(NamedTuple):
    """The matrix K of the reduced problem in the bounded variables, a and b, with what
    transforms constants to it, and its solutions back.

    rows, columns : the row and column factors of the variables that are not fixed. X :
        E A_FB. of_equations : what P subtracts from K, by the equations. Y : what Q
        subtracts from it, by u.
    """

    K: Vector
    rows: Vector
    columns: Vector
    A_BF: Vector
    E: Vector
    U: Vector
    V: Vector
    X: Vector
    of_equations: Vector
    Y: Vector


def solved(A: Vector) -> tuple[Vector, Vector, Vector]:
    """Return E, shape (f, f), U and V, shape (f, f - rank), with A E A = A, U' A = 0
    and A V = 0 for a square equilibrated A: A x = r has the solutions x = E r + V u,
    for all u, if U' r = 0."""
    f = A.shape[0]
    if not A.any():  # as for the equations of a program
        return np.zeros((f, f)), np.eye(f), np.eye(f)
    try:
        E = np.ascontiguousarray(np.linalg.inv(A))
        if largest(E) * largest(A) < 1 / SMALLEST:
            return E, np.empty((f, 0)), np.empty((f, 0))
    except Exception:  # numba catches no other: A is singular
        pass
    left, values, right = np.linalg.svd(finite(A))
    rank = np.count_nonzero(values > SMALLEST * values[0])
    U, V = np.ascontiguousarray(left.T), np.ascontiguousarray(right)
    E = (V[:rank].T / values[:rank]) @ U[:rank]
    return E, np.ascontiguousarray(U[rank:].T), np.ascontiguousarray(V[rank:].T)


def largest(A: Vector) -> float:
    return float(np.abs(A).max()) if A.size else 0.0


def cleaned(A: Vector, max_size: float) -> Vector:
    """Return A with entries up to this size replaced by 0."""
    cleaned_entries: Vector = A * (np.abs(A) > max_size)
    return cleaned_entries


def combinations(G: Vector, H: Vector) -> Vector:
    """Return an invertible R with R G ~ -H' in the sense of least squares, or one close
    to it where there is none; the identity where it solves this exactly, as for a
    program.

    G, H : shapes (s, b) and (b, s).
    """
    if (H == -G.T).all():
        return np.eye(G.shape[0])
    R: Vector = -np.ascontiguousarray(H.T @ np.linalg.pinv(finite(G), DEPENDENT))
    _, U, V = solved(R)
    R += U @ V.T
    return R


def nonfixed_variables(M: Vector, lower: Vector, upper: Vector) -> NonfixedVariables:
    """Return the variables that are not fixed, for bounds of shape (n,)."""
    nonfixed = (lower != upper).nonzero()[0]
    low, high = np.isfinite(lower[nonfixed]), np.isfinite(upper[nonfixed])
    reflection_signs = 1.0 - 2.0 * (high & ~low)
    A = M.copy() if nonfixed.size == lower.size else M[nonfixed][:, nonfixed]
    if reflection_signs.size and reflection_signs.min() < 0.0:
        A *= reflection_signs.reshape(-1, 1)
        A *= reflection_signs
    return NonfixedVariables(
        A,
        nonfixed,
        reflection_signs,
        (low | high).nonzero()[0],
        (~(low | high)).nonzero()[0],
    )


def eliminated(nonfixed: NonfixedVariables, factors: Pair) -> Eliminated:
    """Eliminate the free variables from the A of those that are not fixed, which has
    these row and column factors and may be changed, with the bounded variables a - b
    instead of u, and inequalities in both directions for the equations G z_B + g =
    0."""
    rows, columns = factors
    A, bounded = nonfixed.A, nonfixed.bounded
    free, m = nonfixed.free, bounded.size
    if not free.size:
        none, wide = np.empty((0, 0)), np.empty((0, m))
        return Eliminated(
            A,
            rows,
            columns,
            np.empty((m, 0)),
            none,
            none,
            none,
            wide,
            np.empty((m, 0)),
            wide,
        )
    E, U, V = solved(A[free][:, free])
    s = V.shape[1]
    if s:
        rows, columns = same_units(A, rows, columns, bounded)
    A_BF, A_FB = A[bounded][:, free], A[free][:, bounded]
    X = E @ A_FB
    K = A[bounded][:, bounded] - A_BF @ X
    size = CANCELLED * max(largest(A), largest(X), largest(K))
    K = cleaned(K, size)
    of_equations, Y = np.zeros((m, s)), np.zeros((s, m))
    if s and m:
        G, H = cleaned(U.T @ A_FB, size), cleaned(A_BF @ V, size)
        R = combinations(G, H)
        U, G = U @ R.T, R @ G
        if K.any():
            of_equations = K @ np.linalg.pinv(finite(G), SMALLEST)
            K = K - of_equations @ G
            Y = np.linalg.pinv(finite(H), SMALLEST) @ K
        whole = np.zeros((m + 2 * s, m + 2 * s))
        whole[:m, :m] = cleaned(K - H @ Y, size)
        whole[:m, m : m + s], whole[:m, m + s :] = H, -H
        whole[m : m + s, :m], whole[m + s :, :m] = G, -G
        K = whole
    elif s:
        K = np.zeros((2 * s, 2 * s))
    return Eliminated(K, rows, columns, A_BF, E, U, V, X, of_equations, Y)


def same_units(
    A: Vector, rows: Vector, columns: Vector, bounded: Indices
) -> tuple[Vector, Vector]:
    """Return the row and column factors of A = R M C, made equal to each other for each
    bounded variable if the ratios R_i / C_i of these differ by at most NEAR_UNITS and M
    may be monotone, which A_BB then remains; A is rescaled in place. Otherwise return
    the factors as they are."""
    ratios = rows[bounded] / columns[bounded]
    is_near = bounded.size > 0 and ratios.max() <= NEAR_UNITS * ratios.min()
    if is_near and may_be_monotone(A / rows.reshape(-1, 1) / columns):
        units = np.exp2(np.rint(0.5 * np.log2(rows[bounded] * columns[bounded])))
        same_rows, same_columns = rows.copy(), columns.copy()
        same_rows[bounded], same_columns[bounded] = units, units
        A *= (same_rows / rows).reshape(-1, 1)
        A *= same_columns / columns
        return same_rows, same_columns
    return rows, columns


def may_be_monotone(M: Vector) -> bool:
    """Return whether all minors of order 2 of M + M' are nonnegative, up to
    rounding."""
    M = 0.5 * M
    d, pairs = np.diag(M), np.abs(M + M.T) - CANCELLED * (np.abs(M) + np.abs(M.T))
    roots = np.sqrt(np.maximum(d, 0.0))
    return bool(
        d.min() >= 0.0 and (pairs <= (2.0 + CANCELLED) * np.outer(roots, roots)).all()
    )


def constants(
    nonfixed: NonfixedVariables, elimination: Eliminated, w: Vector
) -> tuple[Vector, Vector]:
    """Return k for the w of all variables at the corner of the box, and the offset of
    the free ones."""
    b = elimination.rows * (nonfixed.reflection_signs * w[nonfixed.variable_indices])
    free = nonfixed.free
    if not free.size:
        return b, np.empty(0)
    offset = -(elimination.E @ b[free])
    k = b[nonfixed.bounded] + elimination.A_BF @ offset
    if elimination.V.shape[1]:
        g = cleaned(elimination.U.T @ b[free], CANCELLED * largest(b))
        k = np.concatenate((k - elimination.of_equations @ g, g, -g))
    return k, offset


def widths(
    nonfixed: NonfixedVariables, elimination: Eliminated, distances: Vector
) -> Vector:
    """Return d for the distances between the bounds of all variables."""
    d, bounded = np.full(elimination.K.shape[0], np.inf), nonfixed.bounded
    d[: bounded.size] = (
        distances[nonfixed.variable_indices[bounded]] / elimination.columns[bounded]
    )
    return d


def reduced(
    M: Vector,
    q: Vector,
    lower: Vector,
    upper: Vector,
    nonfixed: NonfixedVariables,
    factors: Pair,
) -> tuple[Vector, Vector, Vector]:
    """Return K, k and d of a problem from its variables that are not fixed, whose A has
    these row and column factors."""
    elimination = eliminated(nonfixed, factors)
    corner = np.zeros(q.size)
    for i in range(q.size):
        if lower[i] > -np.inf:
            corner[i] = lower[i]
        elif upper[i] < np.inf:
            corner[i] = upper[i]
    k, _ = constants(nonfixed, elimination, q + M @ corner if corner.any() else q)
    return elimination.K, k, widths(nonfixed, elimination, upper - lower)


def direction(
    nonfixed: NonfixedVariables, elimination: Eliminated, y: Vector, offset: Vector
) -> Vector:
    """Return the distances of the variables that are not fixed from the corner of the
    box, if free ones have this offset."""
    v = np.zeros(nonfixed.variable_indices.size)
    m, s = nonfixed.bounded.size, elimination.V.shape[1]
    v[nonfixed.bounded] = y[:m]
    if nonfixed.free.size:
        v[nonfixed.free] = offset - elimination.X @ y[:m]
    if s:
        v[nonfixed.free] += elimination.V @ (
            y[m : m + s] - y[m + s :] - elimination.Y @ y[:m]
        )
    return nonfixed.reflection_signs * elimination.columns * v


def recovered_basis(
    nonfixed: NonfixedVariables, n: int, statuses: BasisStatus
) -> BasisStatus:
    """Return the basis of all n variables for that of y; reflected ones are at the
    other bound."""
    basis, bounded = np.full(n, LOWER, np.int8), nonfixed.bounded
    basis[nonfixed.variable_indices[nonfixed.free]] = BASIC
    basis[nonfixed.variable_indices[bounded]] = (
        statuses[: bounded.size] * nonfixed.reflection_signs[bounded]
    ).astype(np.int8)
    return basis


# Rows and columns are not scaled if all their largest entries are between the
# reciprocal of this and this.
NEAR_ONE = 2.0**8


def exponents(A: Vector) -> Vector:
    """Return the exponents of the factors of rows, and then of columns, that
    `Reduction` uses: 0 if all of these have largest entries of about size 1; an empty
    array where `equilibrate` has to balance logarithms."""
    sizes = units.sizes_in_units(A, np.zeros(2 * A.shape[0]))
    used = sizes[sizes > 0.0]
    if used.size == 0 or (used.max() <= NEAR_ONE and used.min() >= 1.0 / NEAR_ONE):
        return np.zeros(sizes.size)
    return units.moderate_powers(A, sizes, np.abs(np.diag(A)))


def scaled(A: Vector, powers: Vector) -> tuple[Vector, Vector]:
    """Scale rows and columns of A by powers of two with their `exponents`; return these
    factors."""
    n, factors = A.shape[0], np.exp2(powers)
    rows, columns = (
        (factors[:n], factors[n:])
        if factors.size
        else units.equilibrate(A, np.zeros(n))
    )
    A *= rows[:, np.newaxis]
    A *= columns
    return rows, columns


class Reduction:
    """A mixed problem in bounded variables: 0 <= y <= d is complementary to K y + k,
    with k from any q.

    K, d : shapes (m, m) and (m,). units : scaling factors of the rows of K, shape (m,).

    Variables with an upper bound only are reflected, fixed ones are dropped, and rows
    and columns are equilibrated. The unknowns y are the bounded variables in order, and
    then a and b.
    """

    def __init__(self, M: Vector, box: Box) -> None:
        self.M = M
        self.n = M.shape[0]
        self.box = box
        self.corner = np.zeros(self.n) if box.is_orthant else box.corner
        lower, upper = box.vectors(self.n)
        self._nonfixed = nonfixed_variables(M, lower, upper)
        A, self.variable_indices, self.reflection_signs, self.bounded, self.free = (
            self._nonfixed
        )
        self._elimination = eliminated(self._nonfixed, scaled(A, exponents(A)))
        self.K, self.rows, self.columns = self._elimination[:3]
        self.units = np.append(
            self.rows[self.bounded], np.ones(len(self.K) - self.bounded.size)
        )
        self.d = widths(self._nonfixed, self._elimination, upper - lower)

    def within(self, box: Box) -> Reduction | None:
        """Return the reduction for other bounds of the same kinds; None if variables
        are bounded on other sides."""
        lower, upper = box.vectors(self.n)
        before, now = (
            [*map(np.isfinite, reduced_box.vectors(self.n)), reduced_box.fixed]
            for reduced_box in (self.box, box)
        )
        if not all(map(np.array_equal, before, now)):
            return None
        other = copy(self)
        other.box, other.corner = box, np.broadcast_to(box.corner, self.n)
        other.d = widths(self._nonfixed, self._elimination, upper - lower)
        return other

    def constants(self, q: Vector) -> Vector:
        """Return k for a q of shape (n,); the z of later calls are for this q."""
        w = q + self.M @ self.corner if np.count_nonzero(self.corner) else q
        k, self.offset = constants(self._nonfixed, self._elimination, w)
        return k

    def recover(
        self, y: Vector, basic: Mask, at_upper: Mask
    ) -> tuple[Vector, BasisStatus]:
        """Return z of the original problem and its basis for y and its basis."""
        basis = of_masks(basic, at_upper & ~basic)
        return self.corner + self.direction(y, self.offset), recovered_basis(
            self._nonfixed, self.n, basis
        )

    def direction(self, y: Vector, offset: Vector | None = None) -> Vector:
        """Return the direction of z for one of y, or z - corner if free variables have
        this offset."""
        z = np.zeros(self.n)
        offset = np.zeros(self.free.size) if offset is None else offset
        z[self.variable_indices] = direction(
            self._nonfixed, self._elimination, y, offset
        )
        return z

    def recover_w(self, w: Vector) -> Vector:
        """Return w of the bounded variables of the original problem; 0 for the
        others."""
        original_w, B = np.zeros(self.n), self.bounded
        original_w[self.variable_indices[B]] = (
            self.reflection_signs[B] * w[: B.size] / self.rows[B]
        )
        return original_w

    def multipliers(self, u: Vector) -> Vector:
        """Return the y of all rows, with M_F' y as close to 0 as possible for free
        variables F, for multipliers u of the reduced rows."""
        y, B = np.zeros(self.n), self.bounded
        s = self._elimination.V.shape[1]
        y[self.variable_indices[B]] = (
            self.reflection_signs[B] * self.rows[B] * u[: B.size]
        )
        if self.free.size:
            F = self.variable_indices[self.free]
            if s:
                of_inequalities = u[B.size : B.size + s] - u[B.size + s :]
                of_equations = self._elimination.of_equations.T @ u[: B.size]
                combination = self._elimination.U @ (of_inequalities - of_equations)
                y[F] = self.rows[self.free] * combination
            y[F] -= np.linalg.lstsq(
                self.M[np.ix_(F, F)].T, self.M[:, F].T @ y, rcond=DEPENDENT
            )[0]
        return y


MAX_REDUCED = 500  # bounded variables: their K is dense
# Size of an entry of M_FF^{-1} M_FB above which M_FF is treated as singular.
LARGEST = 1e10


class WithoutFree:
    """The problem in the bounded variables. Raises SingularMatrix if M_FF is singular,
    or almost so, if there are no free variables, or if there are more than MAX_REDUCED
    bounded ones.

    problem : with a sparse M. bounded : its bounded variables, those of `reduced`, with
        dense K.
    """

    def __init__(self, problem: Problem) -> None:
        M, box = problem.M, problem.box
        lower, upper = box.vectors(problem.n)
        is_free = ~(np.isfinite(lower) | np.isfinite(upper))
        self._problem = problem
        self._free = is_free.nonzero()[0]
        self.bounded = (~is_free).nonzero()[0]
        if not self._free.size or self.bounded.size > MAX_REDUCED:
            raise SingularMatrix
        rows, others = M[self._free], M[self.bounded]
        self._lu: Any = sparse_lu(False)(rows[:, self._free])
        self._columns, across = rows[:, self.bounded], others[:, self._free]
        X = self._lu.solve(self._columns.toarray())
        if not np.abs(X).max(initial=0.0) <= LARGEST:
            raise SingularMatrix
        K = others[:, self.bounded].toarray() - product(across, X)
        k = problem.q[self.bounded] - product(
            across, self._lu.solve(problem.q[self._free])
        )
        self.reduced = Problem(
            K, k, lower=lower[self.bounded], upper=upper[self.bounded]
        )

    def recover(self, z: Vector, basis: BasisStatus) -> tuple[Vector, BasisStatus]:
        """Return z of the original problem, and its basis, for those of the bounded
        variables."""
        original_z = np.empty(self._problem.n)
        statuses = np.full(self._problem.n, BASIC, np.int8)
        original_z[self.bounded], statuses[self.bounded] = z, basis
        original_z[self._free] = -self._lu.solve(
            product(self._columns, z) + self._problem.q[self._free]
        )
        return original_z, statuses
