"""Rigorous bounds on the distance of any z from the solution of the problem as stored,
rounding errors included; and proofs that M is in a class that has such bounds:
H+-matrices, by a scaling u, and positive definite ones, by factors.

X. Chen and S. Xiang, Computation of error bounds for P-matrix linear complementarity
problems, Mathematical Programming 106 (2006) 513-525, for H+ matrices, componentwise
and independent of scaling. Let w = M z + q, r = min(z, w) and <M> the comparison matrix
of M: |M_ii| on the diagonal, -|M_ij| off it. There is a diagonal D, 0 <= D <= I, with r
= (I - D + D M)(z - z*), because the change of the minimum of two numbers is a convex
combination of their changes. M being H+, |(I - D + D M)^-1| <= <I - D + D M>^-1 <=
<M>^-1 max(L, I) with L the diagonal of M, which is their theorem. Rows may be scaled
beforehand; the best scaling is by 1 / L, for which L becomes I and the bound

    |z - z*| <= <M>^-1 |min(L z, w)|.

The same holds with bounds, where min(z, w) is z - mid(l, u, z - w). M is H+ if and only
if its diagonal is positive and <M> u > 0 for some u > 0 (A. Berman and R. J. Plemmons,
Nonnegative matrices in the mathematical sciences, SIAM 1994, chapter 6); then <M>^-1 >=
0, so that <M> t >= s yields t >= <M>^-1 s: an approximate t is corrected by a multiple
of u.

R. Mathias and J.-S. Pang, Error bounds for the linear complementarity problem with a
P-matrix, Linear Algebra and its Applications 132 (1990) 123-136, and J.-S. Pang, A
posteriori error bounds for the linearly-constrained variational inequality problem,
Mathematics of Operations Research 12 (1987) 474-484, for positive definite M, symmetric
or not, in their sharp form. Take rho and sigma so that y = z - rho and v = w - sigma
are nonnegative with y'v = 0: where z_i is the smaller one, rho_i = z_i and sigma_i =
min(w_i, 0), elsewhere rho_i = min(z_i, 0) and sigma_i = w_i. For a positive diagonal T,
(y - z*)'T(v - w*) = -y'T w* - z*'T v <= 0. With e = z - z* this reads (e - rho)'T(M e -
sigma) <= 0, and as rho'T sigma >= 0,

    e'T M e <= g'e    with    g = T sigma + M'T rho.

With bounds, y lies within them and v has the signs required at y: at l_i, v_i
= max(w_i, 0); at u_i, v_i = min(w_i, 0); elsewhere y_i = mid(l, u, z)_i and v_i = 0.
The rest is the same.

So if the symmetric part of T M has smallest eigenvalue lambda > 0, |e|_2 <= |g|_2 /
lambda, which for T = I is at most Pang's (1 + |M|_2) |min(z, w)|_2 / lambda. It
is applied after scaling T M to a diagonal of about 1, and around the centre of the
ellipsoid, c = S^-1 g / 2 for the symmetric part S: f = e - c has f'S f <= (g - 2 S c)'f
+ c'(g - S c) for every c, so that c may be rounded. lambda is verified by Cholesky's
factorization of the shifted matrix, which runs to completion only if no eigenvalue is
below minus its rounding errors: S. M. Rump, Verification of positive definiteness, BIT
Numerical Mathematics 46 (2006) 433-452. For a sparse S, |S - c I - L U| <= gamma |L|
|U|, and U = D L' up to a difference that is computed.

Rounding errors: an inner product of k terms has an error of at most gamma_k = k u / (1
- k u) times that of the absolute values (N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., SIAM 2002, chapter 3). With the entries of M and z in the
range required here, no product M_ij z_j underflows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from lcpcli import interrupts
from lcpcli.clock import imports
from lcpcli.interrupts import interruptibly
from lcpcli.linalg import factors, matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL, sizes
from lcpcli.linalg.factors import (
    MAX_NUMPY_ROWS,
    PrincipalSolver,
    SingularMatrix,
    Solve,
)
from lcpcli.linalg.krylov import (
    SEMIDEFINITE_ROUNDING,
    StoppingCriterion,
    bicgstab,
    conjugate_gradients,
    identity,
    norm,
)
from lcpcli.linalg.matrices import accurate_residual, is_sparse, product
from lcpcli.linalg.patterns import affordable
from lcpcli.linalg.units import half_power
from lcpcli.model.arrays import as_vector
from lcpcli.model.box import BASIC, Box
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector, VectorLike

# Fractions of the diagonal that are subtracted before d is computed: 0, then one far
# above rounding errors, so that d passes the exact check, but small compared with most
# margins.
SLACKS = 0.0, 2.0**-30
# The Laplacian of the least-squares problem is singular; this makes it regular.
SCALING_RIDGE = 1e-9
# Far more steps than needed if rows of a balanced matrix have been scaled.
BALANCING_STEPS = 50
# Matrices whose diagonal exceeds 2^+-400 after taking roots are not decided, as
# products might overflow.
LARGEST_EXPONENT = 400
# The limit on the steps: the scaling computed by then is verified in any case.
KRYLOV_STEPS = 2000

Proof: TypeAlias = "tuple[bool, Vector | None]"
"""Whether S is proved to be positive definite; and if not, a v, shape (n,), that may
have v'Sv <= 0, or None."""


def scaling(
    M: Matrix,
    holds: Callable[[Vector], bool],
    check: Callable[[], None] = interrupts.raise_if_timed_out,
    slacks: tuple[float, ...] = SLACKS,
) -> Vector | None:
    """Return a d > 0 with <M> d > 0, for M of shape (n, n) with positive diagonal; None
    if none is obtained.

    holds : whether <M> d > 0 is proved for a finite d > 0, by `lower_image` or in exact
        arithmetic. check : called between steps; it may raise TimeIsUp. slacks : the
        slacks with which a d is computed.
    """
    candidates = _candidates(matrices.comparison(M), check, slacks)
    return next(
        (d for d in candidates if np.isfinite(d).all() and (d > 0).all() and holds(d)),
        None,
    )


def lower_image(M: Matrix, diagonal: Vector, d: Vector) -> Vector:
    """Return a lower bound on <M> d for d >= 0: 2 L d - |M| d minus a bound on the
    rounding errors."""
    terms = int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else M.shape[1]
    diagonal_terms, others = 2 * diagonal * d, matrices.absolute_product(M, d)
    return np.asarray(
        diagonal_terms
        - others
        - (factor(terms) * (diagonal_terms + others) + (terms + 4) * SMALLEST_NORMAL)
    )


def factor(terms: int) -> float:
    """Return an upper bound on gamma_k = k u / (1 - k u), the relative error of a sum
    of k products (Higham, chapter 3), with a margin of 16 for further operations.
    """
    return (terms + 16) * EPS


def _candidates(
    C: Matrix, check: Callable[[], None], slacks: tuple[float, ...]
) -> Iterator[Vector]:
    """Yield candidates for d: the solution of C d = L e, or, if d varies widely, of (C
    - slack L) d = L e, with L the diagonal of C.
    """
    diagonal, direct = C.diagonal(), affordable(C)
    for slack in slacks:
        check()
        A = matrices.plus_diagonal(C, -slack * diagonal) if slack else C
        all_of_it = np.arange(diagonal.size)
        d = np.full(diagonal.size, np.nan)
        with (
            np.errstate(over="ignore", invalid="ignore", divide="ignore"),
            suppress(SingularMatrix),
        ):
            d = (
                PrincipalSolver(A).solve(all_of_it, diagonal)
                if direct
                else _krylov(A, diagonal, check)
            )
        yield d


def _krylov(C: Matrix, diagonal: Vector, check: Callable[[], None]) -> Vector:
    """Return an approximate solution d of C d = L e by a Krylov method."""

    def multiply(v: Vector) -> Vector:
        check()
        return product(C, v)

    solve = conjugate_gradients if matrices.is_symmetric(C) else bicgstab
    target = min(0.5 * float(diagonal.min()), 1e-3 * norm(diagonal))
    stopping = StoppingCriterion(target, KRYLOV_STEPS)
    start = np.ones(diagonal.size)
    return solve(multiply, diagonal, start, stopping, lambda r: r / diagonal)[0]


def proof_of_definiteness(S: Matrix) -> Proof:
    """Return whether S is proved to be positive definite, for an affordable S of shape
    (n, n) with positive diagonal, symmetric up to rounding; S is first scaled by powers
    of two to a diagonal of about 1.
    """
    power = -half_power(S.diagonal())
    if np.abs(power).max() > LARGEST_EXPONENT:
        return False, None
    D = np.exp2(power)
    with np.errstate(over="ignore"):
        A = matrices.scaled(S, D, D)
        rounding = EPS * matrices.norm_inf(A)
    if not rounding < 1:
        return False, None
    proved, v = _sparse(A, rounding) if is_sparse(A) else _dense(A)
    return proved, None if v is None else D * v


def semidefinite_within(S: Matrix) -> float | None:
    """Return a d, at the level of rounding errors, such that S + d diag(S) is proved to
    be positive semidefinite: S is semidefinite after a relative change d of its
    diagonal. None if there is no such proof.

    S : affordable, of shape (n, n), symmetric up to rounding.
    """
    rows = np.flatnonzero(matrices.row_maxima(S))
    S = S[rows][:, rows]
    diagonal = S.diagonal()
    if not rows.size or not diagonal.min() > 0:
        return None if rows.size else 0.0
    power = -half_power(diagonal)
    if np.abs(power).max() > LARGEST_EXPONENT:
        return None
    D = np.exp2(power)
    A, shift = matrices.scaled(S, D, D), SEMIDEFINITE_ROUNDING * rows.size
    if not is_sparse(A):
        lost = _lost(A) if _is_factorized(A, -shift) else math.inf
    else:
        lost = math.inf
        with suppress(SingularMatrix):
            lu = factors.sparse_lu(symmetric=True)(matrices.plus_diagonal(A, shift))
            if factors.positive_pivots(lu):
                lost = _error(lu, rows.size) + EPS * matrices.norm_inf(A)
    within = (shift + lost) / float(A.diagonal().min())
    return within if within < 1 else None


@np.errstate(all="ignore")
def semidefinite_by_rounding(M: Matrix) -> float | None:
    """Return the d of `semidefinite_within` for M + M' if entries of M are rounded
    numbers and M + M' is not proved to be positive definite; None for other M. Whether
    such an M is positive definite, semidefinite or indefinite depends on rounding
    errors of its data, as for a covariance matrix or a product A'A.
    """
    with imports:
        from lcpcli.rational.numbers import are_rounded
    S = M + M.T
    S = S.tocsr() if is_sparse(S) else S
    rows = np.flatnonzero(matrices.row_maxima(S))
    S = S[rows][:, rows]
    if not rows.size or not S.diagonal().min() > 0:
        return None
    used_part = M[rows][:, rows]
    entries = used_part.data if is_sparse(used_part) else used_part[S != 0]
    if not are_rounded(entries).any() or not affordable(S):
        return None
    return None if proof_of_definiteness(S)[0] else semidefinite_within(S)


def _dense(A: Vector) -> Proof:
    """Return whether a dense A with a diagonal of about 1 is proved to be positive
    definite; if Cholesky's method fails at a pivot, v is the direction of that
    pivot."""
    if _is_factorized(A, _lost(A)):
        return True, None
    with imports:
        from scipy.linalg import get_lapack_funcs, solve_triangular
    (potrf,) = get_lapack_funcs(("potrf",), (A,))
    factor, info = potrf(A, lower=True)
    v = np.zeros(A.shape[0])
    if info > 0:
        k = info - 1
        v[:k] = -solve_triangular(factor[:k, :k], factor[k, :k], lower=True, trans=1)
        v[k] = 1.0
    return False, v


def row_scalings(M: Vector) -> Iterator[Vector]:
    """Yield diagonals T > 0 of shape (n,) for which T M may be positive definite, for a
    dense M with positive diagonal; with NaN if numbers overflow. Scaling the rows of a
    problem does not change its solutions.
    """
    for proposed in (_symmetrising, _balanced):
        with np.errstate(all="ignore"):
            T = proposed(M)
        yield T


def _symmetrising(M: Vector) -> Vector:
    """Return T for which T M is as close to symmetric as possible: least squares on log
    |T_i M_ij / T_j M_ji|."""
    sizes = np.log2(np.abs(M), where=M != 0, out=np.zeros_like(M))
    pairs = (M != 0) & (M.T != 0)
    excess = np.where(pairs, sizes.T - sizes, 0.0).sum(axis=1)
    laplacian = np.diag(pairs.sum(axis=1) + SCALING_RIDGE) - pairs
    return np.asarray(np.exp2(np.linalg.solve(laplacian, excess)))


def _balanced(M: Vector) -> Vector:
    """Return d > 0 for which each row of diag(d) M has about the norm of the column of
    the same index; NaN if numbers overflow.
    """
    d = np.ones(len(M))
    for _ in range(BALANCING_STEPS):
        scaled = d[:, None] * M
        d *= np.sqrt(np.linalg.norm(scaled, axis=0) / np.linalg.norm(scaled, axis=1))
    return d


def least_eigenvalue(S: Vector) -> float | None:
    """Return a positive lower bound on the smallest eigenvalue of a dense symmetric S
    with entries of about 1 or smaller, each rounded once; None if none is proved.
    """
    if (estimate := _called(lambda: np.linalg.eigvalsh(S)[0], S)) is None:
        return None
    lost = _lost(S)
    shift = float(estimate) - 2 * lost
    return (
        float(shift - lost) * (1 - 4 * EPS)
        if shift > lost and _is_factorized(S, shift)
        else None
    )


def _lost(A: Vector) -> float:
    """Return a bound delta such that all eigenvalues of A are at least -delta if its
    Cholesky factorization in floating-point arithmetic runs to completion (Rump 2006).
    """
    n = len(A)
    return (
        2 * (n + 4) * EPS * float(np.trace(A))
        + EPS * matrices.norm_inf(A)
        + n * n * SMALLEST_NORMAL
    )


def _is_factorized(A: Vector, shift: float) -> bool:
    """Return whether Cholesky's factorization of A - shift I runs to completion."""
    return (
        _called(lambda: np.linalg.cholesky(matrices.plus_diagonal(A, -shift)), A)
        is not None
    )


def _called(call: Callable[[], Any], A: Vector) -> Any:
    """Return the result of a function that takes about n^3 operations, called in an
    interruptible thread if A is large; None if it raises SingularMatrix.
    """
    with suppress(SingularMatrix):
        return interruptibly(call) if A.shape[0] > MAX_NUMPY_ROWS else call()


def _sparse(A: Matrix, rounding: float) -> Proof:
    """Return whether a sparse A, with errors of norm up to `rounding`, is proved to be
    positive definite; otherwise also a direction in which it may not be."""
    proved, v = _by_doubles(A, rounding)
    if not proved:
        # A narrow band may be positive definite with eigenvalues below the rounding
        # errors of double precision.
        with imports:
            from lcpcli.verify.definite_enclosure import SHIFT, least_eigenvalue
        if least_eigenvalue(A, None, SHIFT + rounding + 4 * EPS) > 0:
            return True, None
    return proved, v


def _by_doubles(A: Matrix, rounding: float) -> Proof:
    """Return the result of `_sparse` by factors of A - c I in double precision."""
    n = A.shape[0]
    for shift in (2.0**-20, 2.0**-32):
        try:
            lu = factors.sparse_lu(symmetric=True)(matrices.plus_diagonal(A, -shift))
        except SingularMatrix:
            return False, None
        if factors.positive_pivots(lu):
            return _error(lu, n) + rounding + 4 * EPS < shift, None
    return False, _direction(lu, n)


def _error(lu: Any, n: int) -> float:
    """Return a bound on |S - c I - L D L'| in the maximum norm, for factors of S - c I
    computed without row interchanges.
    """
    L, U = lu.L.tocsr(), lu.U.tocsr()
    D = U.diagonal()
    gamma = 2 * (n + 4) * EPS
    with np.errstate(over="ignore"):
        sums = abs(L) @ (abs(U) @ np.ones(n))
        row = U.copy()
        row.data /= np.repeat(D, np.diff(U.indptr))
        difference = abs(L) @ (D * (abs(row - L.T.tocsr()) @ np.ones(n)))
        slack = abs(L) @ (D * (abs(row) @ np.ones(n)))
    return float(
        (1 + gamma) * (gamma * sums.max() + difference.max() + gamma * slack.max())
    )


def _direction(lu: Any, n: int) -> Vector | None:
    """Return v with L'v = e_k in the order of elimination, for which v'Sv is about the
    k-th pivot, where k has the smallest one.
    """
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    with imports:
        from scipy.sparse.linalg import spsolve_triangular
    unit = np.zeros(n)
    unit[int(lu.U.diagonal().argmin())] = 1.0
    return np.asarray(
        spsolve_triangular(lu.L.T.tocsr(), unit, lower=False, unit_diagonal=True)[
            lu.perm_c
        ]
    )


Distances: TypeAlias = Callable[[Vector, Vector], Vector]
"""Bounds on each |z - z*|_i, from z and w."""

Theorem = Callable[..., float]
"""A function that returns an upper bound on |z - z*|_inf, possibly infinite, for z in
range and w = M z + q with relative errors up to EPS; for positive definite M it also
takes bounds on further errors of w."""

H_PLUS = "Chen and Xiang 2006, M is H+"
DEFINITE = "Mathias and Pang 1990, M is positive definite"
# Products of two numbers in this range neither overflow nor underflow.
LARGEST_ENTRY, SMALLEST_ENTRY = 2.0**450, 2.0**-450
# Unknowns up to which a sparse M is converted to dense, for factors in a few seconds.
MAX_DENSIFIED = 2000
# Limit on T and on the scaling factors, so that their products with M neither overflow
# nor underflow.
LARGEST_UNIT = 2.0**250
SLOW_JACOBI = 0.9  # convergence rate above which Jacobi's iteration is too slow
JACOBI_STEPS = 60  # they reduce the error at least by the factor 0.9^60 = 0.002
# Steps after which the matrix is considered ill-conditioned and is factorized.
BICGSTAB_STEPS = 100
BICGSTAB_TARGET = 1e-8  # relative to the right-hand side: u needs only a few digits


def in_range(A: Matrix, smallest: float = 0.0) -> bool:
    """Return whether all |entries| are at most LARGEST_ENTRY, and all nonzero ones at
    least `smallest`.
    """
    smallest_entry, largest = sizes(A.data if is_sparse(A) else A)
    return largest <= LARGEST_ENTRY and smallest_entry >= smallest


def residual(problem: Problem, z: Vector) -> Vector | None:
    """Return M z + q with a relative error of at most EPS in each row, for M in range;
    None if z or the result is out of range.
    """
    with suppress(OverflowError, ValueError):
        if in_range(z) and in_range(w := -accurate_residual(problem.M, z, -problem.q)):
            return w
    return None


def h_plus_theorem(problem: Problem) -> Theorem | None:
    """Return a function that bounds |z - z*|_inf, for M in range with positive
    diagonal; None if M is not proved to be H+.
    """
    distances = h_plus_distances(problem)
    if distances is None:
        return None

    def bound(z: Vector, w: Vector) -> float:
        value = float(distances(z, w).max(initial=0.0))
        return value * (1 + 8 * EPS) + SMALLEST_NORMAL if value else 0.0

    return bound


def h_plus_distances(problem: Problem) -> Distances | None:
    """Return a function that bounds each |z - z*|_i, for M in range with positive
    diagonal; None if M is not proved to be H+.
    """
    M, diagonal = problem.M, problem.M.diagonal()
    units = scale(problem)
    scaled_M = units.problem.M
    if (
        not scaled_M.diagonal().min() > 0
        or (scaling_and_solver := _scaling(scaled_M)) is None
    ):
        return None
    u, solve = units.z_outside(scaling_and_solver[0]), scaling_and_solver[1]
    gain = lower_image(M, diagonal, u)
    if not (u.min() > SMALLEST_NORMAL and gain.min() > 0 and np.isfinite(gain).all()):
        return None

    def distances(z: Vector, w: Vector) -> Vector:
        s = np.abs(problem.box.gaps(z, w, diagonal)) * (1 + 4 * EPS)
        if not s.any():
            return s
        if solve is None:
            t = (s / gain).max() * u
            for _ in range(JACOBI_STEPS):  # t decreases towards <M>^-1 s
                t = np.maximum(
                    (matrices.absolute_product(M, t) + s) / diagonal - t, 0.0
                )
        else:
            t = np.abs(units.z_outside(solve(units.w_inside(s))))
        missing = np.maximum(s - lower_image(M, diagonal, t), 0.0)
        multiple = (missing / gain).max() * (1 + 8 * EPS) + SMALLEST_NORMAL
        return np.asarray(t + multiple * u)

    return distances


def _scaling(M: Matrix) -> tuple[Vector, Solve | None] | None:
    """Return u with <M> u > 0, which proves that M is H+, and a solver for <M>, which
    is None if Jacobi's iteration converges fast; None if there is no proof. With B = L
    - <M>, the ratios (B u)_i / (L u)_i enclose the convergence rate for every u > 0
    (Collatz and Wielandt).
    """
    e, diagonal = np.ones(M.shape[0]), M.diagonal()
    ratios = matrices.absolute_product(M, e) / diagonal - 1
    if ratios.max() < SLOW_JACOBI:
        return e, None
    if ratios.min() > 1:
        return None

    def holds(u: Vector) -> bool:
        return bool(lower_image(M, diagonal, u).min() > 0)

    with suppress(SingularMatrix):
        C = matrices.comparison(M)
        if not affordable(C):  # factors take long, so that u is computed without them
            u = scaling(M, holds)
            return None if u is None else (u, solver(C))
        solve = PrincipalSolver(C).at(np.arange(e.size))
        proposed = np.abs(solve(diagonal))
        u = (
            proposed
            if np.isfinite(proposed).all() and holds(proposed)
            else scaling(M, holds, slacks=SLACKS[1:])
        )
        return None if u is None else (u, solve)
    return None


def solver(A: Matrix) -> Solve:
    """Return a solver for A with positive diagonal: BiCGSTAB if A is sparse and it
    converges fast, otherwise factors.
    """
    if is_sparse(A):
        inverse = 1 / A.diagonal()

        def iterate(b: Vector) -> tuple[Vector, bool]:
            start, target = np.zeros(b.size), BICGSTAB_TARGET * norm(inverse * b)
            stopping = StoppingCriterion(target, BICGSTAB_STEPS)
            x, size = bicgstab(
                lambda v: inverse * (A @ v), inverse * b, start, stopping, identity
            )
            return x, size <= target

        if iterate(A.diagonal())[1]:
            return lambda b: iterate(b)[0]
    return factors.checked_solver(A)


def definite_theorems(problem: Problem, has_bound: bool = False) -> dict[str, Theorem]:
    """Return functions that bound |z - z*|_inf for M in range with positive diagonal,
    keyed by their sources: with T = I, and with a T that makes T M symmetric. If
    neither T M is proved to be positive definite, another T is tested as well. There
    are none if M is sparse and large.

    has_bound : whether another theorem already has a bound, so that no other T is
        needed.
    """
    if is_sparse(problem.M) and problem.n > MAX_DENSIFIED:
        return {}
    M = matrices.dense(problem.M)
    theorems = {DEFINITE: _definite_theorem(M, np.ones(problem.n), problem.box)}
    if not matrices.is_symmetric(M):
        max_scalings = 1 if has_bound or theorems[DEFINITE] is not None else None
        scaled = (
            _definite_theorem(M, T, problem.box)
            for T in islice(row_scalings(M), max_scalings)
        )
        theorems[f"{DEFINITE} after row scaling"] = next(filter(None, scaled), None)
    return {
        source: theorem for source, theorem in theorems.items() if theorem is not None
    }


def _definite_theorem(M: Matrix, T: Vector, box: Box) -> Theorem | None:
    """Return a function that bounds |z - z*|_inf by the theorem for T M, after scaling
    by the D for which A = D T M D has a diagonal between 1/2 and 2; None if T M is not
    proved to be positive definite.
    """
    diagonal = M.diagonal()
    D = np.exp2(-half_power(T * diagonal))
    rows = D * T
    if not all(
        units.min() >= 1 / LARGEST_UNIT and units.max() <= LARGEST_UNIT
        for units in (T, D, rows)
    ):
        return None
    A = matrices.scaled(M, rows, D)
    S = 0.5 * (A + A.T)
    if (min_eigenvalue := least_eigenvalue(S)) is None:
        return None

    def bound(z: Vector, w: Vector, errors: Vector | None = None) -> float:
        nearest, sigma = box.on_bounds(z, w, diagonal)
        first, second = rows * sigma, (z - nearest) / D
        others = 0 * first if errors is None else rows * errors
        largest = float(np.abs((first, second, others)).max())
        if largest == 0:
            return 0.0
        power = 2.0 ** math.frexp(largest)[1]
        first, second = first / power, second / power
        g = first + second @ A
        off = factor(g.size) * (
            np.abs(first)
            + matrices.absolute_product(A.T, np.abs(second))
            + SMALLEST_NORMAL
        )
        off += others / power
        plain = float(D.max()) * _norm(np.abs(g) + off) / min_eigenvalue
        return (
            power
            * min(plain, _around_centre(S, min_eigenvalue, D, g, off))
            * (1 + 16 * EPS)
            + SMALLEST_NORMAL
        )

    return bound


def _around_centre(
    S: Matrix, min_eigenvalue: float, D: Vector, g: Vector, off: Vector
) -> float:
    """Return a bound on all D_i |e_i| from the ball around c = S^-1 g / 2 that contains
    e; g has errors up to `off`.
    """
    c = 0.5 * np.linalg.solve(S, g)
    image = S @ c
    image_off = (
        2 * factor(c.size) * (matrices.absolute_product(S, np.abs(c)) + SMALLEST_NORMAL)
    )
    residual_norm = _norm(np.abs(g - 2 * image) + off + 2 * image_off + EPS * np.abs(g))
    gap = np.abs(c) @ (off + image_off + factor(c.size) * (np.abs(g) + np.abs(image)))
    square = max(float(c @ (g - image)) + float(gap) * (1 + factor(c.size)), 0.0)
    radius = (
        (residual_norm + math.sqrt(residual_norm**2 + 4 * min_eigenvalue * square))
        / (2 * min_eigenvalue)
        * (1 + 8 * EPS)
    )
    return float((D * (np.abs(c) + radius)).max())


def _norm(v: Vector) -> float:
    """Return an upper bound on |v|_2, for |v_i| up to LARGEST_ENTRY; it is at least
    SMALLEST_NORMAL.
    """
    largest = max(float(np.abs(v).max()), SMALLEST_NORMAL)
    normalized = v / largest
    return (
        largest * float(np.sqrt(normalized @ normalized)) * (1 + factor(v.size))
        + SMALLEST_NORMAL
    )


# Refinement steps of a basic solution: each gains several digits unless M is so
# ill-conditioned that the bound is useless.
NEIGHBOUR_REFINEMENTS = 3


@dataclass(frozen=True)
class Bound:
    """|z - z*|_inf <= value, in the scale of the problem's data; infinite if unknown.
    source : the theorem and the class of M.
    """

    value: float
    source: str

    @property
    def proved(self) -> bool:
        return self.value < math.inf


UNPROVED_IN_TIME = Bound(math.inf, "the time limit was reached before one was proved")
NO_BOUND = Bound(math.inf, "M is not known to be H+ or positive definite")


def takes(problem: Problem) -> bool:
    """Return whether the theorems apply to a problem: its diagonal is positive, and no
    product of M with distances from the bounds underflows.
    """
    bounds = np.concatenate(problem.box.vectors(problem.n))
    return bool(
        in_range(problem.M, SMALLEST_ENTRY)
        and problem.M.diagonal().min(initial=np.inf) > 0
        and sizes(bounds)[0] >= SMALLEST_ENTRY
    )


@np.errstate(all="ignore")
def error_bound(problem: Problem, z: VectorLike) -> Bound | None:
    """Return the smallest proved bound on |z - z*|_inf for this M, z* being the unique
    solution; None if M is in neither class or too close to the boundary of both, if z
    or an entry of M is not finite or is beyond `LARGEST_ENTRY`, or if a nonzero entry
    of M or of the bounds is below `SMALLEST_ENTRY`.

    The class of M is verified, not estimated, and all rounding errors are bounded and
    included. The cost is O(n^3) for dense M, more than that of solving the problem, and
    a few solves for sparse M. A sparse M that is not H+ is treated as dense for up to
    `error_theorems.MAX_DENSIFIED` unknowns.

    problem : an LCP or a mixed problem with n unknowns; the theorems hold for any
        bounds.
    z : shape (n,), of any sign; ProblemError if it does not have n numbers.

    >>> from lcpcli import Problem, error_bound
    >>> bound = error_bound(Problem([[2, 1], [1, 2]], [-5, -6]), [1.3333, 2.3333])
    >>> 3e-5 < bound.value < 1e-3, bound.source
    (True, 'Chen and Xiang 2006, M is H+')
    >>> error_bound(Problem([[0, 1], [1, 0]], [-1, 1]), [0, 0]) is None
    True
    """
    if isinstance(z, np.ndarray) and z.dtype.kind == "f" and not np.isfinite(z).all():
        return None
    z_array = as_vector("z", z, problem.n)
    if not problem.n:
        return Bound(0.0, "M has no entries")
    if not (takes(problem) and in_range(z_array)):
        return None
    h_plus = h_plus_theorem(problem)
    theorems = definite_theorems(problem, h_plus is not None) | (
        {} if h_plus is None else {H_PLUS: h_plus}
    )
    if not theorems:
        return None
    points = [z_array, _neighbour(problem, z_array)]
    claims = [
        _claim(problem, theorems, z_array, point)
        for point in points
        if point is not None
    ]
    return min(filter(None, claims), key=lambda claim: claim.value, default=None)


def _claim(
    problem: Problem, theorems: dict[str, Theorem], z: Vector, y: Vector
) -> Bound | None:
    """Return the smallest of the bounds on |y - z*|_inf plus |z - y|_inf; None if it is
    out of range.
    """
    y = np.where(np.abs(y) < SMALLEST_ENTRY, 0.0, y)
    if (w := residual(problem, y)) is None:
        return None
    values = {source: theorem(y, w) for source, theorem in theorems.items()}
    best = min(
        values,
        key=lambda source: (
            values[source] if values[source] < LARGEST_ENTRY else math.inf
        ),
    )
    distance = float(np.abs(z - y).max())
    value = values[best] if distance == 0 else (distance + values[best]) * (1 + 4 * EPS)
    return Bound(value, best) if value < LARGEST_ENTRY else None


def _neighbour(problem: Problem, z: Vector) -> Vector | None:
    """Return a point y close to z at which a bound is sharp, as |z - z*| <= |z - y| +
    |y - z*|; None if its linear system is singular.

    It is about the basic solution of the active set at z - w_i / M_ii, projected on the
    bounds, and is z* up to rounding if z comes from a solver. Its residuals are
    computed with one rounding: with residuals in double precision, bounds would be up
    to 20 times as large.
    """
    basis = problem.box.basis_of(0.5 * (z - problem.w(z) / problem.M.diagonal()))
    y, active = problem.box.nonbasic(basis), np.flatnonzero(basis == BASIC)
    if not active.size:
        return y
    with suppress(SingularMatrix):
        solve = solver(problem.M[active][:, active])
        for _ in range(NEIGHBOUR_REFINEMENTS):
            if (remainder := residual(problem, y)) is None:  # as where y is not finite
                return None
            y[active] -= solve(remainder[active])
        return problem.box.project(y) if np.isfinite(y).all() else None
    return None
