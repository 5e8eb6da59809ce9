"""Classes of M with their certificates: H+-matrices, by a positive scaling d, and positive definite ones, by factors.

M with positive diagonal L is an H+-matrix if its comparison matrix <M> (|M_ii| on the diagonal, -|M_ij| off it) is a
nonsingular M-matrix, that is, if <M> d > 0 for some d > 0 (A. Berman and R. J. Plemmons, Nonnegative matrices in the
mathematical sciences, SIAM 1994, chapter 6): generalized strict diagonal dominance. Whoever asks for d says in which
arithmetic <M> d > 0 is to be proved.

A factorization of S - c I, S = M + M', proves that M is positive definite if it runs to completion, and c exceeds a
bound on its rounding error (S. M. Rump, Verification of positive definiteness, BIT Numerical Mathematics 46 (2006)
433-452). In the sparse case |S - c I - L U| <= gamma |L| |U|, and U = D L' up to a difference that is computed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from lcpcli import interrupts
from lcpcli.clock import imports
from lcpcli.interrupts import interruptibly
from lcpcli.linalg import factors, matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.factors import MOST_NUMPY_ROWS, PrincipalSolver, Solve
from lcpcli.linalg.matrices import is_sparse, product
from lcpcli.linalg.units import half_power
from lcpcli.typing import Matrix, Vector

SLACK = 2.0**-30  # of the diagonal: far above rounding, so that d passes the exact check, and small beside most margins
SCALING_RIDGE = 1e-9  # added to the Laplacian of the least-squares problem, which is singular
BALANCING_STEPS = 50  # far more than are needed where rows have been multiplied by numbers
LARGEST_EXPONENT = 400  # binary; matrices with entries further from 1 are left undecided, as products might overflow
KRYLOV_STEPS = 2000  # at most: the scaling found by then is verified in any case


class Scaling(NamedTuple):
    """A proof that M is H+: d > 0 with <M> d > 0; and a solver for <M>, None if d was found without factors."""

    d: Vector
    solve: Solve | None


Proof: TypeAlias = "tuple[bool, Vector | None]"
"""Whether S is proved to be positive definite; if not, a v, shape (n,), that may have v'Sv <= 0, or None."""


def scaling(M: Matrix, holds: Callable[[Vector], bool], check: Callable[[], None] = interrupts.check) -> Scaling | None:
    """Return a proof that M, of shape (n, n) with positive diagonal, is H+; None if no d was found. holds :
    whether <M> d > 0 is proved for a finite d > 0, as by `lower_image`, or in exact arithmetic. check : called between
    steps; it may raise TimeIsUp."""
    for found in _candidates(matrices.comparison(M), check):
        if np.isfinite(found.d).all() and (found.d > 0).all() and holds(found.d):
            return found
    return None


def lower_image(M: Matrix, diagonal: Vector, d: Vector) -> Vector:
    """Return a lower bound on <M> d for d >= 0: 2 L d - |M| d minus a bound on the rounding errors."""
    terms = int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else M.shape[1]
    own, others = 2 * diagonal * d, matrices.absolute_product(M, d)
    return np.asarray(own - others - (factor(terms) * (own + others) + (terms + 4) * SMALLEST_NORMAL))


def factor(terms: int) -> float:
    """Return gamma_k = k u / (1 - k u), the relative error of a sum of k products, with a margin for a few operations
    before and after (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, chapter 3)."""
    return (terms + 16) * EPS


def _candidates(C: Matrix, check: Callable[[], None]) -> Iterator[Scaling]:
    """Yield candidates for d: C d = L 1 or, where d varies widely, (C - SLACK L) d = L 1."""
    diagonal, direct = C.diagonal(), True
    if is_sparse(C) or diagonal.size > MOST_NUMPY_ROWS:
        with imports:
            from lcpcli.linalg.patterns import affordable
        direct = affordable(C)
    for slack in (0.0, SLACK):
        check()
        A, solve = matrices.plus_diagonal(C, -slack * diagonal) if slack else C, None
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            if direct:
                solver, everything = PrincipalSolver(A), np.arange(diagonal.size)
                try:
                    d, solve = solver.solve(everything, diagonal), None if slack else solver.at(everything)
                except factors.SingularMatrix:
                    continue
            else:
                d = _krylov(A, diagonal, check)
        yield Scaling(d, solve)


def _krylov(C: Matrix, diagonal: Vector, check: Callable[[], None]) -> Vector:
    with imports:
        from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, norm

    def multiply(v: Vector) -> Vector:
        check()
        return product(C, v)

    solve = conjugate_gradients if matrices.is_symmetric(C) else bicgstab
    target = min(0.5 * float(diagonal.min()), 1e-3 * norm(diagonal))
    return solve(multiply, diagonal, np.ones(diagonal.size), target, KRYLOV_STEPS, lambda r: r / diagonal)[0]


def proof_of_definiteness(S: Matrix) -> Proof:
    """Return the proof for an affordable S of shape (n, n), with positive diagonal, symmetric up to rounding, which is
    first scaled by powers of two to a diagonal near 1."""
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


def _dense(A: Vector) -> Proof:
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
    """Yield diagonals T > 0 of shape (n,) for which T M may be positive definite, for a dense M with positive diagonal;
    with NaN where numbers overflow. All solutions of a problem stay what they are."""
    for proposed in (_symmetrising, _balanced):
        with np.errstate(all="ignore"):
            T = proposed(M)
        yield T


def _symmetrising(M: Vector) -> Vector:
    """Return T for which T M is as close to symmetric as possible: least squares on log |T_i M_ij / T_j M_ji|."""
    sizes = np.log2(np.abs(M), where=M != 0, out=np.zeros_like(M))
    pairs = (M != 0) & (M.T != 0)
    excess = np.where(pairs, sizes.T - sizes, 0.0).sum(axis=1)
    laplacian = np.diag(pairs.sum(axis=1) + SCALING_RIDGE) - pairs
    return np.asarray(np.exp2(np.linalg.solve(laplacian, excess)))


def _balanced(M: Vector) -> Vector:
    """Return d > 0 for which rows of diag(d) M have about the norms of columns; NaN where numbers overflow."""
    d = np.ones(len(M))
    for _ in range(BALANCING_STEPS):
        scaled = d[:, None] * M
        d *= np.sqrt(np.linalg.norm(scaled, axis=0) / np.linalg.norm(scaled, axis=1))
    return d


def least_eigenvalue(S: Vector) -> float | None:
    """Return a positive lower bound on the smallest eigenvalue of a dense symmetric S with entries near 1 or smaller,
    each rounded once; None if none is proved."""
    if (estimate := _called(lambda: np.linalg.eigvalsh(S)[0], S)) is None:
        return None
    lost = _lost(S)
    shift = float(estimate) - 2 * lost
    return float(shift - lost) * (1 - 4 * EPS) if shift > lost and _is_factorized(S, shift) else None


def _lost(A: Vector) -> float:
    """Return a bound on how far below 0 eigenvalues of A may be if its Cholesky factorization is completed."""
    n = len(A)
    return 2 * (n + 4) * EPS * float(np.trace(A)) + EPS * matrices.norm_inf(A) + n * n * SMALLEST_NORMAL


def _is_factorized(A: Vector, shift: float) -> bool:
    """Return whether Cholesky's factorization of A - shift I runs to completion."""
    return _called(lambda: np.linalg.cholesky(matrices.plus_diagonal(A, -shift)), A) is not None


def _called(call: Callable[[], Any], A: Vector) -> Any:
    """Return the value of a call that takes some n^3 operations, interruptibly if these take longer than a thread; None
    if it fails."""
    with suppress(np.linalg.LinAlgError):
        return interruptibly(call) if A.shape[0] > MOST_NUMPY_ROWS else call()


def _sparse(A: Matrix, rounding: float) -> Proof:
    n = A.shape[0]
    for shift in (2.0**-20, 2.0**-32):
        try:
            lu = factors.sparse_lu(symmetric=True)(matrices.plus_diagonal(A, -shift))
        except factors.SingularMatrix:
            return False, None
        if factors.positive_pivots(lu):
            return _error(lu, n) + rounding + 4 * EPS < shift, None
    return False, _direction(lu, n)


def _error(lu: Any, n: int) -> float:
    """Return a bound on |S - c I - L D L'| in the maximum norm, for factors computed without row interchanges."""
    L, U = lu.L.tocsr(), lu.U.tocsr()
    D = U.diagonal()
    gamma = 2 * (n + 4) * EPS
    with np.errstate(over="ignore"):
        sums = abs(L) @ (abs(U) @ np.ones(n))
        row = U.copy()
        row.data /= np.repeat(D, np.diff(U.indptr))
        difference = abs(L) @ (D * (abs(row - L.T.tocsr()) @ np.ones(n)))
        slack = abs(L) @ (D * (abs(row) @ np.ones(n)))
    return float((1 + gamma) * (gamma * sums.max() + difference.max() + gamma * slack.max()))


def _direction(lu: Any, n: int) -> Vector | None:
    """Return v with L'v = e_k in the order of elimination, for which v'Sv is about the k-th pivot, the smallest one."""
    if not np.array_equal(lu.perm_r, lu.perm_c):
        return None
    with imports:
        from scipy.sparse.linalg import spsolve_triangular
    unit = np.zeros(n)
    unit[int(lu.U.diagonal().argmin())] = 1.0
    return np.asarray(spsolve_triangular(lu.L.T.tocsr(), unit, lower=False, unit_diagonal=True)[lu.perm_c])
