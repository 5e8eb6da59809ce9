"""P-matrices, whose principal minors are all positive, and P0-matrices, where none is negative.

Small matrices are decided by all their principal minors, in exact arithmetic. Larger ones belong to the class by an
implication, or are ruled out by one minor, or by a vector whose signs M reverses (M. Fiedler and V. Pták, On matrices
with non-positive off-diagonal elements and positive principal minors, Czechoslovak Mathematical Journal 12 (1962)
382-400): v_i (Mv)_i <= 0 for all i, v != 0, for P; v_i (Mv)_i < 0 wherever v_i != 0 for P0.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.classes.context import Context, signs
from lcpcli.classes.verdict import NO, UNDECIDED, YES, Verdict, entry, index_set, shown
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational import linear
from lcpcli.typing import Vector

EXACT = 14  # n up to which all 2^n - 1 minors are computed
EIGEN = 300  # n up to which eigenvectors are tried
PAIRS = 2000  # n up to which all pairs of a dense matrix are examined
CANDIDATES = 10  # pairs whose minor is computed exactly
NOISE = 1e-13  # of the largest component of an eigenvector: treated as zero


def p_matrix(context: Context) -> Verdict:
    """Every principal minor is positive."""
    for name, called in (("positive_definite", "positive definite"), ("h_plus", "an H+-matrix")):
        if context.yes(name):
            return Verdict(YES, f"it is {called}")
    return _by_symmetry(context, "positive_definite", "positive definite") or _by_minors(context, strict=True)


def p0_matrix(context: Context) -> Verdict:
    """No principal minor is negative."""
    for name, called in (("p_matrix", "a P-matrix"), ("positive_semidefinite", "positive semidefinite")):
        if context.yes(name):
            return Verdict(YES, f"it is {called}")
    return _by_symmetry(context, "positive_semidefinite", "positive semidefinite") or _by_minors(context, strict=False)


def _by_symmetry(context: Context, name: str, called: str) -> Verdict | None:
    """A symmetric matrix is P exactly if it is definite, and P0 exactly if it is semidefinite."""
    if not (context.yes("symmetric") and context.no(name)):
        return None
    witness = context.verdicts[name]
    return Verdict(NO, f"it is symmetric and not {called}", witness.indices, witness.vector)


def _by_minors(context: Context, strict: bool) -> Verdict:
    """A minor that rules out M, all minors if they are few, or a vector whose signs M reverses."""
    size = "not positive" if strict else "negative"
    low = np.flatnonzero(context.diagonal <= 0 if strict else context.diagonal < 0)
    if low.size:
        i = int(low[0])
        return Verdict(NO, f"{entry(i, i)} = {context.diagonal[i]:.6g} is {size}", (i,))
    pair = _pair(context, strict)
    if pair is not None:
        return Verdict(NO, f"the principal minor {index_set(pair)} is {size}", pair)
    if context.n <= EXACT:
        for indices, minor in linear.principal_minors(context.whole(), context.check):
            if minor < 0 or (strict and minor == 0):
                return Verdict(NO, f"the principal minor {index_set(indices)} is {size}", indices)
        return Verdict(YES, f"none of its {2**context.n - 1} principal minors is {size}, in exact arithmetic")
    v = _reversed(context, strict)
    if v is not None:
        bound = "<= 0" if strict else "< 0"
        return Verdict(NO, f"v_i (Mv)_i {bound} wherever v_i is not 0, for v = {shown(v)}", vector=v)
    minors = f"2^{context.n} - 1 principal minors"
    return Verdict(UNDECIDED, f"{minors} are too many; no sufficient condition or counterexample was found")


def _pair(context: Context, strict: bool) -> tuple[int, int] | None:
    """Indices of a principal minor of order 2 that is negative, or zero if strict, exactly."""
    M, diagonal = context.M, context.diagonal
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if is_sparse(M):
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
        i, j = int(rows[k]), int(columns[k])
        a, b, c, d = (Fraction(float(M[r, s])) for r, s in ((i, i), (i, j), (j, i), (j, j)))
        minor = a * d - b * c
        if minor < 0 or (strict and minor == 0):
            return i, j
    return None


def _reversed(context: Context, strict: bool) -> Vector | None:
    """A real eigenvector of a nonpositive eigenvalue, if M reverses its signs exactly."""
    if context.n > EIGEN or context.dense is None:
        return None
    context.check()
    try:
        values, vectors = np.linalg.eig(context.dense)
    except np.linalg.LinAlgError:
        return None
    for k in np.flatnonzero((values.imag == 0) & (values.real <= 0)):
        v = np.array(vectors[:, k].real)
        v[np.abs(v) < NOISE * np.abs(v).max()] = 0.0
        signs_of_product = signs(context.dense, v, context.check) * np.sign(v)
        reverses = signs_of_product <= 0 if strict else signs_of_product[v != 0] < 0
        if reverses.all():
            return v
    return None
