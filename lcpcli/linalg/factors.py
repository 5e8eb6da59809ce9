"""Factorizations of dense and sparse matrices: each gives a solver, or reports that the matrix is singular.

scipy is imported only when needed: for sparse or large matrices.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lcpcli.interrupts import interruptibly
from lcpcli.linalg.fill import order_of
from lcpcli.linalg.matrices import column_maxima, is_sparse, is_symmetric
from lcpcli.linalg.products import product
from lcpcli.linalg.threads import include_loaded
from lcpcli.typing import Matrix, Vector

SMALL = 200  # up to this n a dense matrix is inverted by numpy: importing scipy costs more than it saves
QUICK = 10_000  # entries up to which a sparse factorization is too fast to need an interruptible thread
LONG_LU, LONG_CHOLESKY = 2000, 5000  # rows from which dense ones are interruptible; see `interruptible_cholesky`
Solve = Callable[[Vector], Vector]


class SingularMatrix(Exception):
    """The matrix is singular, or so nearly singular that solutions have no correct digit."""


def factorizer(M: Matrix) -> Callable[[float], Solve]:
    """A function that factorizes shift I + M.

    It returns a solver x = solve(b) of (shift I + M) x = b, and raises SingularMatrix if that matrix is singular to
    working precision. The test is a system with known solution, of which a solve must recover a digit. Unlike a
    condition number, this is insensitive to the units of rows and columns.
    """
    factorize = _sparse_factorizer(M) if is_sparse(M) else _dense_factorizer(M)

    def checked(shift: float) -> Solve:
        solve = factorize(shift)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            known = 1 / np.maximum(column_maxima(M), shift)
            computed = solve(product(M, known) + shift * known)
            if not np.max(np.abs(computed / known - 1)) < 0.5:
                raise SingularMatrix
        return solve

    return checked


def _sparse_factorizer(M: Matrix) -> Callable[[float], Solve]:
    from scipy.sparse import eye_array

    lu = sparse_lu(is_symmetric(M))
    identity = eye_array(M.shape[0], format="csr")

    def factorize(shift: float) -> Solve:
        solve: Solve = lu(M + shift * identity).solve
        return solve

    return factorize


def sparse_lu(symmetric: bool) -> Callable[[Matrix], Any]:
    """scipy's splu of a csr_array, raising SingularMatrix; with diagonal pivots if M is symmetric.

    Ordering M + M' instead of M'M halves the fill-in for symmetric matrices. Diagonal pivots are safe for positive
    definite ones; otherwise the known system in `factorizer`, or refinement, detects failure.
    SuperLU must not see a structurally singular matrix: for some it passes negative sizes to BLAS, which prints to
    standard output, and fails with other errors.
    """
    from scipy.sparse.csgraph import structural_rank
    from scipy.sparse.linalg import splu

    include_loaded()
    chosen: dict[str, Any] = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}} if symmetric else {}

    def lu(A: Matrix) -> Any:
        if not A.diagonal().all():
            pattern = A.copy()
            pattern.eliminate_zeros()
            if structural_rank(pattern) < A.shape[0]:
                raise SingularMatrix
        # a symmetric csr_array is a csc_array with the same three arrays
        columns = A.T if symmetric else A.tocsc()
        order = order_of(A) if symmetric else "COLAMD"

        def factors() -> Any:
            return splu(columns, permc_spec=order, **chosen)

        try:
            return interruptibly(factors) if A.nnz > QUICK else factors()
        except RuntimeError as error:
            if "singular" not in str(error) and "failed to factorize" not in str(error):
                raise
            raise SingularMatrix from None

    return lu


def positive_pivots(lu: Any) -> bool:
    """Whether all pivots are diagonal and positive, as they are for positive definite matrices."""
    return bool(np.array_equal(lu.perm_r, lu.perm_c) and lu.U.diagonal().min() > 0)


def _dense_factorizer(M: Matrix) -> Callable[[float], Solve]:
    if M.shape[0] <= SMALL:
        return lambda shift: invert(_shifted(M, shift))
    from scipy.linalg import get_lapack_funcs

    include_loaded()
    getrf, getrs = get_lapack_funcs(("getrf", "getrs"), (M,))

    def factorize(shift: float) -> Solve:
        lu, pivots, info = dense_lu(getrf, _shifted(M, shift), overwrite_a=True)
        if info > 0:
            raise SingularMatrix

        def solve(b: Vector) -> Vector:
            x: Vector = getrs(lu, pivots, b)[0]
            return x

        return solve

    return factorize


def dense_lu(getrf: Callable[..., Any], A: Matrix, **how: bool) -> Any:
    """What LAPACK's getrf returns for A."""
    return interruptibly(lambda: getrf(A, **how)) if A.shape[0] >= LONG_LU else getrf(A, **how)


def interruptible_cholesky(A: Matrix) -> Solve:
    """A solver of A x = b for a symmetric positive definite A of at least LONG_CHOLESKY rows; else SingularMatrix.

    scipy's potrf holds the interpreter's lock, so that neither Ctrl-C nor a time limit can end the wait for it. numpy's
    releases it, but copies A twice and takes a third longer, which pays where potrf would take more than a second.
    """
    from scipy.linalg import get_lapack_funcs

    include_loaded()
    (potrs,) = get_lapack_funcs(("potrs",), (A,))
    try:
        upper = interruptibly(lambda: np.linalg.cholesky(A.T)).T
    except np.linalg.LinAlgError:
        raise SingularMatrix from None
    return lambda b: potrs(upper, b)[0]


def _shifted(M: Matrix, shift: float) -> Matrix:
    A = M.copy(order="F")
    A.reshape(-1, order="F")[:: A.shape[0] + 1] += shift
    return A


def invert(A: Matrix) -> Solve:
    """The inverse and one step of refinement: as accurate as an LU factorization, without scipy."""
    try:
        inverse = np.linalg.inv(A)
    except np.linalg.LinAlgError:
        raise SingularMatrix from None

    def solve(b: Vector) -> Vector:
        x = inverse @ b
        refined: Vector = x + inverse @ (b - A @ x)
        return refined

    return solve
