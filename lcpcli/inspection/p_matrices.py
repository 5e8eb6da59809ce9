"""P-matrices, whose principal minors are all positive, P0-matrices, where none is negative, and sufficient matrices.

Small matrices are decided by all their principal minors, in exact arithmetic. Larger ones belong to P or P0 by an
implication, or are ruled out by one minor, or by a vector whose signs M reverses (M. Fiedler and V. Pták, Czechoslovak
Mathematical Journal 12 (1962) 382-400): v_i (Mv)_i <= 0 for all i, v != 0, for P; v_i (Mv)_i < 0 wherever v_i != 0 for
P0.

M is column sufficient if z_i (Mz)_i <= 0 for all i implies that all are 0, and row sufficient if M' is column
sufficient (R. W. Cottle, J.-S. Pang and V. Venkateswaran, Linear Algebra Appl. 114/115 (1989) 231-249). Both imply P0.
Small matrices are decided exactly: let z be a counterexample of smallest support P, I the indices with z_i (Mz)_i < 0,
and J the others in P. M_PP + T is singular for the diagonal T of -(Mz)_i / z_i. Its determinant is a sum over the
principal minors from J to P, each times a positive number; in a P0-matrix they are therefore all 0, and M_PP + T is
singular for every T >= 0 with support in I. No null vector of it vanishes on I, as a multiple of it could be subtracted
from z to make P smaller. So the null space of M_PP + t diag(1_I), t > 0, has a counterexample; it suffices to examine
all I and P.

H+ and M-matrices are P-matrices: they are strictly diagonally dominant after a positive scaling of the columns.
M is an H+-matrix if C d > 0 for its comparison matrix C and some d > 0 (see `verify.error_theorems`). There is no such
d if C v <= 0 for some v >= 0, v != 0, as C^-1 >= 0. d and v are computed in double precision and verified exactly.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from lcpcli.inspection import verdict
from lcpcli.inspection.verdict import NO, UNDECIDED, YES, Context, Verdict, index_set, signs, text_of
from lcpcli.linalg import matrices
from lcpcli.rational import elimination, numbers
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.error_theorems import scaling

EXACT_MINORS = 64  # n up to which the leading minors of C are computed exactly, in about a second
STEPS = 300  # of power iteration for a v that rules out d, which is verified whatever its accuracy
ZERO = 1e-9  # of the largest component of v, below which a component has not converged and is treated as zero


def h_plus(context: Context) -> Verdict:
    """Decide whether M_ii > 0, and M_ii d_i > sum of |M_ij| d_j, j != i, in every row for some d > 0."""
    return context.low_diagonal() or scaled_dominance(context.M, context.check)


def m_matrix(context: Context) -> Verdict:
    """Decide whether M is a nonsingular M-matrix: a Z-matrix that is an H+-matrix."""
    if not context.yes("z_matrix"):
        return Verdict(NO, "it is not a Z-matrix")
    word, undecided = context.verdicts["h_plus"].word, "whether it is an H+-matrix is not decided"
    return Verdict(word, {YES: "it is a Z-matrix and an H+-matrix", NO: "it is not an H+-matrix"}.get(word, undecided))


def scaled_dominance(M: Matrix, check: verdict.Check) -> Verdict:
    """Decide whether M, with positive diagonal, is an H+-matrix."""
    C, e = matrices.comparison(M), np.ones(M.shape[0])
    row = signs(C, e, check)
    if (row > 0).all():
        return Verdict(YES, "it is strictly diagonally dominant: d = (1, ..., 1)", vector=e)
    if (row <= 0).all():
        return _excluded(e)
    if (d := scaling(M, lambda d: bool((signs(C, d, check) > 0).all()), check)) is not None:
        evidence = f"scaling the columns of M by d = {text_of(d)} makes it strictly diagonally dominant"
        return Verdict(YES, evidence, vector=d)
    v, diagonal = e, C.diagonal()
    for _ in range(STEPS):  # power iteration on I + J, which may lead to a Perron vector v >= 0 of J = I - D^-1 C
        check()
        v = 2 * v - matrices.product(C, v) / diagonal
        if not np.isfinite(v).all() or not v.max() > 0:
            v = np.zeros(e.size)
            break
        v = v / v.max()
    v[v < ZERO] = 0.0
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


ALL_MINORS = 14  # n up to which all 2^n - 1 = 16383 minors are computed, in half a second
ALL_PAIRS = 8  # n up to which all 3^n pairs of index sets are examined, 6561
MOST_WITH_VECTORS = 300  # unknowns up to which eigenvectors are tried, in a fraction of a second
PAIRS = 2000  # n up to which all pairs of a dense matrix are examined: 32 MB for each n x n array
CANDIDATES = 10  # pairs whose minor is computed exactly: one of the least minors in doubles is negative if any is
NOISE = 1e-13  # of the largest component of an eigenvector, below which a component is rounding and treated as zero


def p_matrix(context: Context) -> Verdict:
    """Decide whether every principal minor is positive."""
    found = context.implied("positive_definite", "h_plus") or _by_symmetry(context, "positive_definite")
    return found or _by_minors(context, strict=True)


def p0_matrix(context: Context) -> Verdict:
    """Decide whether no principal minor is negative."""
    found = context.implied("p_matrix", "positive_semidefinite") or _by_symmetry(context, "positive_semidefinite")
    return found or _by_minors(context, strict=False)


def _by_symmetry(context: Context, name: str) -> Verdict | None:
    """Decide for symmetric M, which is P if and only if it is definite, and P0 if and only if it is semidefinite."""
    return context.excluded(name, "it is symmetric and not") if context.yes("symmetric") else None


def _by_minors(context: Context, strict: bool) -> Verdict:
    """Decide by a minor that rules out M, by all minors if they are few, or by a vector whose signs M reverses."""
    size = "not positive" if strict else "negative"
    if (low := context.low_diagonal(strict)) is not None:
        return low
    if (pair := _pair(context, strict)) is not None:
        return Verdict(NO, f"the principal minor {index_set(pair)} is {size}", pair)
    if context.n <= ALL_MINORS:
        for indices, minor in elimination.principal_minors(context.whole(), context.check):
            if minor < 0 or (strict and minor == 0):
                return Verdict(NO, f"the principal minor {index_set(indices)} is {size}", indices)
        return Verdict(YES, f"none of its {2**context.n - 1} principal minors is {size}, in exact arithmetic")
    if (v := _sign_reversal(context, strict)) is not None:
        bound = "<= 0" if strict else "< 0"
        return Verdict(NO, f"v_i (Mv)_i {bound} wherever v_i is not 0, for v = {text_of(v)}", vector=v)
    minors = f"2^{context.n} - 1 principal minors"
    return Verdict(UNDECIDED, f"{minors} are too many; no sufficient condition or counterexample was found")


def _pair(context: Context, strict: bool) -> tuple[int, int] | None:
    """Return the indices of a principal minor of order 2 that is exactly negative, or zero if strict; or None."""
    M, diagonal = context.M, context.diagonal
    if matrices.is_sparse(M):
        product = M.multiply(M.T).tocoo()
        rows, columns, values = product.row, product.col, product.data
    elif context.n <= PAIRS:
        values = (M * M.T).ravel()
        rows, columns = np.divmod(np.arange(values.size), context.n)
    else:
        return None
    kept = np.flatnonzero((rows < columns) & (values > 0))
    rows, columns = rows[kept], columns[kept]
    excess = values[kept] / diagonal[rows] / diagonal[columns]
    likely = np.flatnonzero(excess >= 1 - 1e-15)
    for k in likely[np.argsort(-excess[likely], kind="stable")][:CANDIDATES]:
        pair = int(rows[k]), int(columns[k])
        minor = elimination.determinant(numbers.integers(matrices.dense(M[list(pair)][:, list(pair)])))
        if minor < 0 or (strict and minor == 0):
            return pair
    return None


def _sign_reversal(context: Context, strict: bool) -> Vector | None:
    """Return a real eigenvector of a nonpositive eigenvalue, if M reverses its signs exactly; else None."""
    if context.n > MOST_WITH_VECTORS:
        return None
    context.check()
    M = matrices.dense(context.M)
    with suppress(np.linalg.LinAlgError):
        values, vectors = np.linalg.eig(M)
        for k in np.flatnonzero((values.imag == 0) & (values.real <= 0)):
            v = np.array(vectors[:, k].real)
            v[np.abs(v) < NOISE * np.abs(v).max()] = 0.0
            products = signs(M, v, context.check) * np.sign(v)
            if (products <= 0 if strict else products[v != 0] < 0).all():
                return v
    return None


def row_sufficient(context: Context) -> Verdict:
    """Decide whether z_i (M'z)_i <= 0 for all i implies that all of these are 0."""
    if context.yes("symmetric"):
        own = context.verdicts["column_sufficient"]
        return Verdict(own.word, "it is symmetric, so this is column sufficiency", own.indices, own.vector)
    return column_sufficient(context, "M'z")


def column_sufficient(context: Context, product: str = "Mz") -> Verdict:
    """Decide whether z_i (Mz)_i <= 0 for all i, or the same for another product, implies that all of these are 0."""
    found = context.implied("p_matrix", "positive_semidefinite") or context.excluded("p0_matrix")
    if found is not None:
        return found
    if context.n > ALL_PAIRS:
        return Verdict(UNDECIDED, f"3^{context.n} pairs of index sets are too many; no sufficient condition was found")
    if not context.yes("p0_matrix"):
        return Verdict(UNDECIDED, "whether it is a P0-matrix is not decided")
    M = context.whole()
    A = M if product == "Mz" else [list(column) for column in zip(*M, strict=True)]
    for P, part in verdict.blocks(A, context.check):
        if elimination.determinant(part):
            continue
        t = max(abs(v) for row in part for v in row) or 1
        for inside in verdict.index_sets(len(P)):
            context.check()
            # z, not 0 on I, with (A + t diag(1_I)) z = 0: z_i (Az)_i = -t z_i^2 on I, 0 elsewhere
            shifted = [[v + t * (i == j and i in inside) for j, v in enumerate(row)] for i, row in enumerate(part)]
            _, free = elimination.solve(shifted, [0] * len(part))
            u = next((z for z in free if any(z[i] for i in inside)), None)
            if u is not None:
                claim = f"z_i ({product})_i <= 0 for all i and < 0 for one"
                z = context.vector(P, u)
                support = f"for a z with support {index_set(P)}, in exact arithmetic"
                return Verdict(NO, f"{claim}, {support if z is None else f'z = {text_of(z)}'}", P, z)
    return Verdict(YES, f"no z on any of {2**context.n - 1} index sets is a counterexample, in exact arithmetic")
