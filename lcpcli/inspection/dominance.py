"""H+ and M-matrices: generalized strict diagonal dominance, proved by a positive scaling of the columns.

M with positive diagonal is an H+-matrix if its comparison matrix C (|M_ii| on the diagonal, -|M_ij| off it) is a
nonsingular M-matrix, that is, if C d > 0 for some d > 0 (A. Berman and R. J. Plemmons, Nonnegative matrices in the
mathematical sciences, SIAM 1994, chapter 6). There is no such d if C v <= 0 for some v >= 0, v != 0, as C^-1 >= 0.
d and v are computed in double precision and verified exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.inspection.verdict import NO, UNDECIDED, YES, Check, Context, Verdict, index_set, signs, text_of
from lcpcli.linalg import factors, matrices
from lcpcli.linalg.factors import PrincipalSolver
from lcpcli.linalg.krylov import bicgstab, conjugate_gradients, norm
from lcpcli.linalg.matrices import product
from lcpcli.linalg.patterns import affordable
from lcpcli.rational import elimination, numbers
from lcpcli.typing import Matrix, Vector

EXACT_MINORS = 64  # n up to which the leading minors of C are computed exactly, in about a second
STEPS = 300  # of power iteration for a v that rules out d, which is verified whatever its accuracy
ZERO = 1e-9  # of the largest component of v, below which a component has not converged and is treated as zero
SLACK = 2.0**-30  # of the diagonal: far above rounding, so that d passes the exact check, and small beside most margins
KRYLOV_STEPS = 2000  # at most: the scaling found by then is verified in any case


def h_plus(context: Context) -> Verdict:
    """Decide whether M_ii > 0, and M_ii d_i > sum of |M_ij| d_j, j != i, in every row for some d > 0."""
    return context.low_diagonal() or scaled_dominance(context.M, context.check)


def m_matrix(context: Context) -> Verdict:
    """Decide whether M is a nonsingular M-matrix: a Z-matrix that is an H+-matrix."""
    if not context.yes("z_matrix"):
        return Verdict(NO, "it is not a Z-matrix")
    word, undecided = context.verdicts["h_plus"].word, "whether it is an H+-matrix is not decided"
    return Verdict(word, {YES: "it is a Z-matrix and an H+-matrix", NO: "it is not an H+-matrix"}.get(word, undecided))


def scaled_dominance(M: Matrix, check: Check) -> Verdict:
    """Decide whether M, with positive diagonal, is an H+-matrix."""
    C = matrices.comparison(M)
    e = np.ones(C.shape[0])
    row = signs(C, e, check)
    if (row > 0).all():
        return Verdict(YES, "it is strictly diagonally dominant: d = (1, ..., 1)", vector=e)
    if (row <= 0).all():
        return _excluded(e)
    for d in _scalings(C, check):
        if np.isfinite(d).all() and (d > 0).all() and (signs(C, d, check) > 0).all():
            scaling = f"scaling the columns of M by d = {text_of(d)} makes it strictly diagonally dominant"
            return Verdict(YES, scaling, vector=d)
    v = _perron(C, check)
    if v.any() and (signs(C, v, check) <= 0).all():
        return _excluded(v)
    if e.size > EXACT_MINORS:
        return Verdict(UNDECIDED, "neither a scaling d nor a vector that rules one out was found")
    first = elimination.definiteness(numbers.integers(matrices.dense(C)), check)
    indices = first.zero or first.negative
    if indices is None:
        return Verdict(YES, "all leading minors of its comparison matrix are positive, in exact arithmetic")
    return Verdict(NO, f"the minor {index_set(indices)} of its comparison matrix is not positive", indices)


def _excluded(v: Vector) -> Verdict:
    return Verdict(NO, f"M_ii v_i <= sum of |M_ij| v_j, j != i, in every row for v = {text_of(v)}", vector=v)


def _scalings(C: Matrix, check: Check) -> Iterator[Vector]:
    """Yield candidates for d: C d = D 1 for the diagonal D, or, where d varies widely, (C - SLACK D) d = D 1."""
    diagonal, direct = C.diagonal(), affordable(C)
    for slack in (0.0, SLACK):
        check()
        A = matrices.plus_diagonal(C, -slack * diagonal) if slack else C
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            try:
                everything = np.arange(diagonal.size)
                yield PrincipalSolver(A).solve(everything, diagonal) if direct else _krylov(A, diagonal, check)
            except factors.SingularMatrix:
                continue


def _krylov(C: Matrix, diagonal: Vector, check: Check) -> Vector:
    def multiply(v: Vector) -> Vector:
        check()
        return product(C, v)

    solve = conjugate_gradients if matrices.is_symmetric(C) else bicgstab
    target = min(0.5 * float(diagonal.min()), 1e-3 * norm(diagonal))
    return solve(multiply, diagonal, np.ones(diagonal.size), target, KRYLOV_STEPS, lambda r: r / diagonal)[0]


def _perron(C: Matrix, check: Check) -> Vector:
    """Return an approximate Perron vector v >= 0 of J = I - D^-1 C, by power iteration on I + J; D v may be below |off|
    v."""
    diagonal = C.diagonal()
    v = np.ones(diagonal.size)
    for _ in range(STEPS):
        check()
        with np.errstate(over="ignore", invalid="ignore"):
            v = 2 * v - product(C, v) / diagonal
        if not np.isfinite(v).all() or not v.max() > 0:
            return np.zeros(v.size)
        v /= v.max()
    v[v < ZERO] = 0.0
    return v
