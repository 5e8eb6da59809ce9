"""Factorizations of dense and sparse matrices and of their principal submatrices, by
Cholesky's method where M is positive definite.

Each factorization returns a function that solves systems, or raises SingularMatrix.
scipy is imported only when needed: for sparse or large matrices.

A principal submatrix of a tridiagonal matrix is tridiagonal too: an entry next to the
diagonal remains if both of its neighbours remain. LAPACK's gttrf factorizes it with row
interchanges.

Systems with many principal submatrices of one dense M are solved in batches, in which
each distinct submatrix is factorized once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import Owned, interruptibly, owned
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import (
    column_maxima,
    is_sparse,
    is_symmetric,
    norm_inf,
    plus_diagonal,
    product,
    width,
)
from lcpcli.typing import Indices, Mask, Matrix, Vector

MIN_ROWS = 3  # scipy's gttrs rejects smaller systems
# Order up to which dense matrices are inverted by numpy: importing scipy takes longer
# than it saves.
MAX_NUMPY_ROWS = 200
# Entries up to which a sparse factorization is too fast to need an interruptible
# thread.
MAX_QUICK_ENTRIES = 10_000
# Rows from which dense factorizations are interruptible; see `_DenseFactors`.
LONG_LU, LONG_CHOLESKY = 2000, 5000
# If this module is loaded already, it is used for small systems too: it takes half of
# numpy's time, but importing it takes longer than that saves.
LAPACK = "scipy.linalg.lapack"
# The largest fraction of an index set that may change: up to it an update costs clearly
# less than a factorization.
MAX_UPDATED = 1 / 12
# The condition number up to which an inverse has at least 8 correct digits.
MODEST_CONDITION = 1e8
Solve = Callable[[Vector], Vector]
TwoWay = Callable[..., Vector]  # called as solve(b, transposed=False)
# The matrix is singular, or so close to it that solutions have no correct digit.
SingularMatrix = np.linalg.LinAlgError


class Tridiagonal:
    """Systems with principal submatrices of one tridiagonal M."""

    def __init__(self, M: Matrix) -> None:
        with imports:
            from scipy.linalg import get_lapack_funcs
        self._below, self._diagonal, self._above = (M.diagonal(k) for k in (-1, 0, 1))
        self._factorize, self._solve = get_lapack_funcs(("gttrf", "gttrs"))

    def at(self, indices: Indices) -> Callable[[Vector], Vector]:
        """Return a solver of systems with M_PP; raise LinAlgError if M_PP is
        singular."""
        first, adjacent = indices[:-1], np.diff(indices) == 1
        below, above = (side[first] * adjacent for side in (self._below, self._above))
        if indices.size < MIN_ROWS:
            return partial(
                np.linalg.solve,
                np.diag(self._diagonal[indices])
                + np.diag(below, -1)
                + np.diag(above, 1),
            )
        *factors, info = self._factorize(below, self._diagonal[indices], above)
        if info > 0:
            raise np.linalg.LinAlgError
        return lambda b: np.asarray(self._solve(*factors, b)[0])


def solver(A: Matrix) -> TwoWay:
    """Return a function solve(b, transposed=False) for systems with A, or with its
    transpose; A may be overwritten. This function, or the one that it returns, raises
    SingularMatrix if A is singular.
    """
    if not is_sparse(A):
        return invert(A) if A.shape[0] <= MAX_NUMPY_ROWS else dense_factors().lu(A)
    if (definite := definite_solver(A)) is not None:
        return lambda b, transposed=False: definite(b)  # noqa: ARG005 (A is symmetric)
    lu = sparse_lu(symmetric=False)(A)
    return lambda b, transposed=False: lu.solve(b, "T" if transposed else "N")


def checked_solver(M: Matrix, shift: float = 0.0) -> Solve:
    """Return a function x = solve(b) for systems (shift I + M) x = b; raise
    SingularMatrix if that matrix is singular to working precision.

    The test solves a system with a known solution, of which at least one digit must be
    recovered. Unlike a condition number, it does not depend on the scaling of rows and
    columns.
    """
    solve = solver(plus_diagonal(M, shift, order="F"))
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        known_solution = 1 / np.maximum(column_maxima(M), shift)
        if (
            not np.max(
                np.abs(
                    solve(product(M, known_solution) + shift * known_solution)
                    / known_solution
                    - 1
                )
            )
            < 0.5
        ):
            raise SingularMatrix
    return solve


def sparse_lu(symmetric: bool) -> Callable[[Matrix], Any]:
    """Return scipy's splu for csr_arrays, which raises SingularMatrix; for symmetric
    matrices with diagonal pivots.

    For symmetric matrices, ordering by M + M' instead of M'M halves the fill-in.
    Diagonal pivots are stable for positive definite ones; for others, the test of a
    known system or iterative refinement detects failure. SuperLU must not be called
    with a structurally singular matrix: for some it passes negative sizes to BLAS,
    which prints to standard output, and fails with other errors.
    """
    with imports:
        from scipy.sparse.linalg import splu

        from lcpcli.linalg.patterns import is_structurally_singular, order_of
    options: dict[str, Any] = (
        {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
        if symmetric
        else {}
    )

    def lu(A: Matrix) -> Any:
        if not A.diagonal().all() and is_structurally_singular(A):
            raise SingularMatrix
        # The transpose of a csr_array is a csc_array that shares its arrays.
        columns = A.T if symmetric else A.tocsc()
        factors = partial(
            splu, columns, permc_spec=order_of(A) if symmetric else "COLAMD", **options
        )
        return factorized(factors, A.nnz)

    return lu


class _Factors:
    """SuperLU's factors, which are deleted by the thread that computed them."""

    def __init__(self, owned_factors: Owned) -> None:
        self._owned_factors = owned_factors

    def solve(self, b: Vector, trans: str = "N") -> Vector:
        return np.asarray(self._owned_factors.value.solve(b, trans))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._owned_factors.value, name)


def factorized(factorize: Callable[[], Any], entries: int, owns: bool = True) -> Any:
    """Return the factors of a sparse matrix with this number of entries; raise
    SingularMatrix for any error of the library.

    owns : whether only the thread that computes the factors may delete them.
    """
    try:
        if entries <= MAX_QUICK_ENTRIES:
            return factorize()
        return _Factors(owned(factorize)) if owns else interruptibly(factorize)
    except RuntimeError as error:
        raise SingularMatrix from error


def positive_pivots(lu: Any) -> bool:
    """Return whether all pivots are on the diagonal and positive, as they are for
    positive definite matrices.
    """
    return bool(np.array_equal(lu.perm_r, lu.perm_c) and lu.U.diagonal().min() > 0)


class _DenseFactors:
    """LAPACK's factorizations of dense matrices in either storage order, which raise
    SingularMatrix.
    """

    def __init__(self) -> None:
        with imports:
            from scipy.linalg import get_lapack_funcs
        self._potrf, self._potrs, self._getrf, self._getrs = get_lapack_funcs(
            ("potrf", "potrs", "getrf", "getrs")
        )

    def cholesky(self, A: Matrix) -> TwoWay:
        """Return a solver as `lu` does, by the Cholesky factorization of A.

        scipy's potrf holds the interpreter's lock, so that neither Ctrl-C nor a time
        limit can interrupt it; numpy's releases the lock, but copies A twice and takes
        a third longer.
        """
        if A.shape[0] >= LONG_CHOLESKY:
            upper = interruptibly(partial(np.linalg.cholesky, A.T)).T
            # A is symmetric.
            return lambda b, transposed=False: self._potrs(upper, b)[0]  # noqa: ARG005
        factor, info = self._potrf(A.T, lower=True, clean=False)
        if info > 0:
            raise SingularMatrix
        return lambda b, transposed=False: (  # noqa: ARG005
            self._potrs(factor, b, lower=True)[0]
        )

    def lu(self, A: Matrix, overwrite: bool = True) -> TwoWay:
        """Return a function solve(b, transposed=False) for systems with A, or with its
        transpose, by the LU factorization of A.
        """
        by_columns = A.flags.f_contiguous
        factorize = partial(
            self._getrf, A if by_columns else A.T, overwrite_a=overwrite
        )
        factor, pivots, info = (
            interruptibly(factorize) if A.shape[0] >= LONG_LU else factorize()
        )
        if info > 0:
            raise SingularMatrix
        return lambda b, transposed=False: self._getrs(
            factor, pivots, b, trans=by_columns == transposed
        )[0]


dense_factors = cache(_DenseFactors)


def invert(A: Matrix) -> TwoWay:
    """Return a solver as `_DenseFactors.lu` does, by the inverse of A and one step of
    iterative refinement, which makes it as accurate as LU factors.
    """
    inverse = np.linalg.inv(A)

    def solve(b: Vector, transposed: bool = False) -> Vector:
        inverse_used, matrix_used = (inverse.T, A.T) if transposed else (inverse, A)
        x = inverse_used @ b
        return np.asarray(x + inverse_used @ (b - matrix_used @ x))

    return solve


def finite(A: Vector) -> Vector:
    """Return A; raise SingularMatrix if an entry is not finite, as LAPACK's singular
    value decomposition may then not terminate.
    """
    if not np.isfinite(A).all():
        raise SingularMatrix
    return A


class Latest:
    """The factors of the last large dense M_PP, which the owner of M keeps; copying or
    pickling the owner does not copy them.
    """

    def __init__(self) -> None:
        self.stored_factors: tuple[Indices, TwoWay] | None = None

    def __reduce__(self) -> tuple[type[Latest], tuple[()]]:
        return Latest, ()


def well_conditioned_inverse(
    M: Matrix, largest: float = MODEST_CONDITION
) -> Matrix | None:
    """Return the inverse of a dense M, or None if its condition number exceeds
    `largest`."""
    with suppress(SingularMatrix), np.errstate(over="ignore", invalid="ignore"):
        inverse = np.linalg.inv(M)
        if norm_inf(M) * norm_inf(inverse) <= largest:
            return inverse
    return None


def definite_solver(M: Matrix) -> Solve | None:
    """Return a solver of M x = b if M is symmetric positive definite to working
    precision, otherwise None.
    """
    if not is_symmetric(M) or not M.diagonal().min() > 0:
        return None
    with suppress(SingularMatrix):
        if is_sparse(M):
            lu = sparse_lu(symmetric=True)(M)
            return lu.solve if positive_pivots(lu) else None
        if M.shape[0] > MAX_NUMPY_ROWS:
            return dense_factors().cholesky(M)
        np.linalg.cholesky(M)
        return invert(M)
    return None


class PrincipalSolver:
    """Solves M_PP x = b for one index set P after another.

    Blocks of a symmetric M are assumed to be positive definite until a factorization
    fails: dense ones are factorized by Cholesky's method, sparse ones with diagonal
    pivots. The factors of the last large or sparse block are reused for the same P, and
    those of a dense block are updated if P differs in few indices.

    latest : where the last factors are stored as well, for later solvers with the same
    M.
    """

    def __init__(self, M: Matrix, latest: Latest | None = None) -> None:
        self._M, self._latest = M, latest
        self._small = not is_sparse(M) and M.shape[0] <= MAX_NUMPY_ROWS
        self._dense = (
            None
            if is_sparse(M) or (self._small and LAPACK not in sys.modules)
            else dense_factors()
        )
        self._definite = (
            not self._small
            and bool((M.diagonal() > 0).all())
            and (not is_sparse(M) or is_symmetric(M))
        )
        self._stored_factors: tuple[Indices, Solve] | None = None
        is_tridiagonal = (
            is_sparse(M)
            and M.shape[0] >= 2
            and M.nnz <= 3 * M.shape[0]
            and width(M) <= 1
        )
        self._tridiagonal = Tridiagonal(M) if is_tridiagonal else None

    def solve(self, indices: Indices, b: Vector) -> Vector:
        """Return x after one step of refinement, for b of shape (k,); raise
        SingularMatrix if M_PP is singular."""
        if indices.size == 0:
            return np.empty(0)
        solve = self.at(indices)
        with np.errstate(over="ignore", invalid="ignore"):
            z = np.zeros(self._M.shape[0])
            z[indices] = x = solve(b)
            refined_x: Vector = x + solve(b - product(self._M, z)[indices])
        if not np.isfinite(refined_x).all():
            raise SingularMatrix
        return refined_x

    def at(self, indices: Indices) -> Solve:
        """Return a solver of systems with M_PP, without refinement; this method or the
        solver raises SingularMatrix if M_PP is numerically singular.
        """
        if self._small:
            return self._factorized(indices)
        if self._tridiagonal is not None:
            return self._tridiagonal.at(indices)
        if self._stored_factors is not None and np.array_equal(
            indices, self._stored_factors[0]
        ):
            return self._stored_factors[1]
        if self._stored_factors is not None and self._dense is not None:
            with suppress(SingularMatrix):
                if (solve := self._updated(indices, *self._stored_factors)) is not None:
                    return solve
        solve = self._factorized(indices)
        self._stored_factors = indices, solve
        if self._dense is not None and self._latest is not None:
            self._latest.stored_factors = self._stored_factors
        return solve

    def block(self, indices: Indices) -> Matrix:
        """Return M_PP for the indices of P; a small one is stored by columns, as LAPACK
        needs it.
        """
        return (
            self._M.T.take(indices, 0).take(indices, 1).T
            if self._small
            else matrices.principal(self._M, indices)
        )

    def factorized(self, block: Matrix, overwrite: bool = False) -> Solve:
        """Return a solver of systems with the block M_PP, without refinement; raise
        SingularMatrix if it is singular.
        """
        if self._dense is None and not is_sparse(block):
            return partial(np.linalg.solve, block)
        if self._definite and (is_sparse(block) or is_symmetric(block)):
            try:
                return (
                    self._dense.cholesky(block)
                    if self._dense
                    else sparse_lu(symmetric=True)(block).solve
                )
            except SingularMatrix:
                self._definite = False
        return (
            self._dense.lu(block, overwrite)
            if self._dense
            else sparse_lu(False)(block).solve
        )

    def _factorized(self, indices: Indices) -> Solve:
        block = self.block(indices)
        return self.factorized(block, overwrite=block is not self._M)

    # Without it: a dense LCP in 300 unknowns takes 1.2 times as long.
    def _updated(
        self, indices: Indices, factorized_indices: Indices, solve: Solve
    ) -> Solve | None:
        """Return a solver for the index set P from the one for the factorized set K, by
        a Schur complement; None if the sets differ in too many indices.

        The system is extended: K is enlarged by the indices N of P outside K, and for
        each index i of K outside P there are an equation x_i = 0 and its multiplier.
        The equations of K are solved by the factors, and the rest by the Schur
        complement.
        """
        before, now = np.zeros((2, self._M.shape[0]), dtype=bool)
        before[factorized_indices], now[indices] = True, True
        stays, old = now[factorized_indices], before[indices]
        added, dropped = indices[~old], (~stays).nonzero()[0]
        changes = added.size + dropped.size
        if changes > MAX_UPDATED * factorized_indices.size:
            return None
        if not changes:
            return solve
        rows = self._M[added]
        columns = np.zeros((factorized_indices.size, changes), order="F")
        columns[:, : added.size] = self._M[:, added][factorized_indices]
        columns[dropped, np.arange(added.size, changes)] = 1
        inner = solve(columns)
        small = np.zeros((changes, changes))
        small[: added.size, : added.size] = rows[:, added]
        rows = rows[:, factorized_indices]
        small[: added.size] -= product(rows, inner)
        small[added.size :] -= inner[dropped]
        solve_small = dense_factors().lu(small)

        def updated(b: Vector) -> Vector:
            right = np.zeros(factorized_indices.size)
            right[stays] = b[old]
            first = solve(right)
            outer = solve_small(
                np.concatenate([b[~old] - product(rows, first), -first[dropped]])
            )
            x = np.empty(indices.size)
            x[old] = (first - product(inner, outer))[stays]
            x[~old] = outer[: added.size]
            return x

        return updated


# Numbers in the submatrices and right-hand sides that are solved in one call, so that
# they fit in the processor's cache.
BATCH = 1 << 16
WORD = 64  # bits of a machine word
# Fraction of the indices in P above which solving with the complement of P in the
# inverse of M costs less.
LARGE_SHARE = 0.55


def solve_principal(
    M: Matrix, sets: Mask, B: Vector, inverse: Matrix | None = None
) -> Vector:
    """Return X whose row i has M_PP x_P = b_P and zeros elsewhere, for P = sets[i] and
    b = B[i]; NaN if M_PP is singular or numbers overflow.

    M, sets, B : shapes (n, n), (m, n), (m, n); row i of sets is the mask of the index
        set P for row i of B.
    inverse : G, the inverse of M, if M is well-conditioned. If most indices are in P
        and few in N, the complement of P, then M_PP^-1 = G_PP - G_PN G_NN^-1 G_NP needs
        only the smaller system.
    """
    if not sets.size:
        return np.zeros(B.shape)
    if inverse is not None:
        large = np.count_nonzero(sets, axis=1) > LARGE_SHARE * sets.shape[1]
        if large.any():
            X = np.empty(B.shape)
            X[~large] = solve_principal(M, sets[~large], B[~large])
            all_of_it = np.where(sets[large], B[large], 0.0) @ inverse.T
            x_outside = solve_principal(inverse, ~sets[large], all_of_it)
            X[large] = np.where(sets[large], all_of_it - x_outside @ inverse.T, 0.0)
            return X
    X = np.zeros(B.shape)
    for indices, rows in _batches(sets):
        # Selecting the columns first takes half the time of indexing with both.
        columns = M.T.take(indices, axis=0).transpose(0, 2, 1)
        blocks = columns[np.arange(indices.shape[0])[:, np.newaxis], indices]
        positions = rows[:, :, np.newaxis], indices[:, np.newaxis, :]
        X[positions] = _solved(blocks, B[positions].transpose(0, 2, 1)).transpose(
            0, 2, 1
        )
    return X


def principal_inverses(M: Vector, sets: Mask) -> Vector:
    """Return G with G_PP = M_PP^-1 and zeros elsewhere for each of m matrices M; G_PP
    is NaN if M_PP is singular or numbers overflow.

    M, sets : shapes (m, n, n), (m, n); row i of sets is the mask of the index set P for
        M[i].
    """
    G = np.zeros(M.size)
    sizes = np.count_nonzero(sets, axis=1)
    n = M.shape[-1]
    entries = M.reshape(-1)
    for size in range(1, n + 1):
        rows = (sizes == size).nonzero()[0]
        if rows.size:
            P = sets[rows].nonzero()[1].reshape(rows.size, size)
            positions = (
                n * (n * rows[:, np.newaxis] + P)[:, :, np.newaxis]
                + P[:, np.newaxis, :]
            )
            G[positions] = _solved(entries[positions])
    return G.reshape(M.shape)


def each_product(M: Vector, v: Vector) -> Vector:
    """Return M[i] v[i] for each i, for M of shape (m, n, n) and v of shape (m, n)."""
    return np.asarray((M @ v[:, :, np.newaxis])[:, :, 0])


def _batches(sets: Mask) -> Iterator[tuple[Indices, Indices]]:
    """Yield the distinct nonempty sets in batches of equal cardinality s, as indices of
    shape (g, s), and the rows that have these sets, shape (g, r).

    The numbers of rows of the sets in a batch are within a factor of two of each other;
    the last row of a set is repeated to make r rows.
    """
    m, n = sets.shape
    # The bits of a set, padded to whole machine words, are its key.
    packed = np.zeros((m, -(-n // WORD) * 8), dtype=np.uint8)
    packed[:, : -(-n // 8)] = np.packbits(sets, axis=1)
    machine_words = packed.view(np.uint64)
    keys = (
        machine_words[:, 0]
        if machine_words.shape[1] == 1
        else packed.view(f"V{packed.shape[1]}")[:, 0]
    )
    _, first, numbers = np.unique(keys, return_index=True, return_inverse=True)
    inverse = numbers.reshape(-1)
    counts = np.bincount(inverse)
    order, group_starts = np.argsort(inverse, kind="stable"), np.cumsum(counts) - counts
    sizes = np.count_nonzero(sets[first], axis=1)
    kinds = sizes * WORD + np.frexp(counts - 0.5)[1]
    by_kind = np.argsort(kinds, kind="stable")
    for group in np.split(by_kind, np.flatnonzero(np.diff(kinds[by_kind])) + 1):
        size, max_rows = int(sizes[group[0]]), int(counts[group].max())
        if not size:
            continue
        together = max(1, BATCH // (size * (size + max_rows)))
        for batch in np.split(group, range(together, group.size, together)):
            indices = sets[first[batch]].nonzero()[1].reshape(batch.size, size)
            yield (
                indices,
                order[
                    group_starts[batch, np.newaxis]
                    + np.minimum(np.arange(max_rows), counts[batch, np.newaxis] - 1)
                ],
            )


def _solved(A: Vector, B: Vector | None = None) -> Vector:
    """Return X with A X = B for A and B of shapes (g, s, s) and (g, s, r), or the
    inverses of A if B is None; NaN for each singular matrix, which bisection isolates.
    """
    try:
        return (np.linalg.inv(A) if B is None else np.linalg.solve(A, B)).astype(
            np.float64, copy=False
        )
    except np.linalg.LinAlgError:
        if A.shape[0] == 1:
            return np.full((A if B is None else B).shape, np.nan)
        half = A.shape[0] // 2
        halves = (slice(half), slice(half, None))
        return np.concatenate(
            [
                _solved(A[half_of_systems], None if B is None else B[half_of_systems])
                for half_of_systems in halves
            ]
        )
