"""P-matrices, whose principal minors are all positive, and P0-matrices, where none is negative.

Small matrices are decided by all their principal minors, in exact arithmetic. Larger ones belong to the class by an
implication, or are excluded by one minor, or by a vector whose signs M reverses (M. Fiedler and V. Pták, On matrices
with non-positive off-diagonal elements and positive principal minors, Czechoslovak Mathematical Journal 12 (1962)
382-400): v_i (Mv)_i <= 0 for all i, v != 0, for P; v_i (Mv)_i < 0 wherever v_i != 0 for P0.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.classes.context import Subject, signs
from lcpcli.classes.verdict import NO, OPEN, YES, Verdict, index_set, shown
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational import elimination
from lcpcli.typing import Vector

EXACT = 14  # n up to which all 2^n - 1 minors are computed
EIGEN = 300  # n up to which eigenvectors are tried
PAIRS = 2000  # n up to which all pairs of a dense matrix are looked at
CANDIDATES = 10  # pairs whose minor is computed exactly
NOISE = 1e-13  # of the largest component of an eigenvector: taken for zero


def p_matrix(subject: Subject) -> Verdict:
    """Every principal minor is positive."""
    for name, called in (("positive_definite", "positive definite"), ("h_plus", "an H+-matrix")):
        if subject.yes(name):
            return Verdict(YES, f"it is {called}")
    return _by_symmetry(subject, "positive_definite", "positive definite") or _by_minors(subject, strict=True)


def p0_matrix(subject: Subject) -> Verdict:
    """No principal minor is negative."""
    for name, called in (("p_matrix", "a P-matrix"), ("positive_semidefinite", "positive semidefinite")):
        if subject.yes(name):
            return Verdict(YES, f"it is {called}")
    return _by_symmetry(subject, "positive_semidefinite", "positive semidefinite") or _by_minors(subject, strict=False)


def _by_symmetry(subject: Subject, name: str, called: str) -> Verdict | None:
    """Of symmetric matrices, the P-matrices are the definite ones, and the P0-matrices the semidefinite ones."""
    if not (subject.yes("symmetric") and subject.no(name)):
        return None
    witness = subject.verdicts[name]
    return Verdict(NO, f"it is symmetric and not {called}", witness.indices, witness.vector)


def _by_minors(subject: Subject, strict: bool) -> Verdict:
    """A minor that excludes M, all minors if they are few, or a vector whose signs M reverses."""
    size = "not positive" if strict else "negative"
    low = np.flatnonzero(subject.diagonal <= 0 if strict else subject.diagonal < 0)
    if low.size:
        i = int(low[0])
        return Verdict(NO, f"M[{i}][{i}] = {subject.diagonal[i]:.6g} is {size}", (i,))
    pair = _pair(subject, strict)
    if pair is not None:
        return Verdict(NO, f"the principal minor {index_set(pair)} is {size}", pair)
    if subject.n <= EXACT:
        for indices, minor in elimination.principal_minors(subject.whole(), subject.check):
            if minor < 0 or (strict and minor == 0):
                return Verdict(NO, f"the principal minor {index_set(indices)} is {size}", indices)
        return Verdict(YES, f"of its {2**subject.n - 1} principal minors, exactly computed, none is {size}")
    v = _reversed(subject, strict)
    if v is not None:
        bound = "<= 0" if strict else "< 0"
        return Verdict(NO, f"v_i (Mv)_i {bound} wherever v_i is not 0, for v = {shown(v)}", vector=v)
    return Verdict(
        OPEN, f"2^{subject.n} - 1 principal minors are too many, no sufficient condition and no exception was found"
    )


def _pair(subject: Subject, strict: bool) -> tuple[int, int] | None:
    """Indices of a principal minor of order 2 that is negative, or zero if strict; exactly so."""
    M, diagonal = subject.M, subject.diagonal
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if is_sparse(M):
            product = M.multiply(M.T).tocoo()
            rows, columns, values = product.row, product.col, product.data
        elif subject.n <= PAIRS:
            values = (M * M.T).ravel()
            rows, columns = np.divmod(np.arange(values.size), subject.n)
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


def _reversed(subject: Subject, strict: bool) -> Vector | None:
    """A real eigenvector to an eigenvalue that is not positive, if M reverses its signs exactly."""
    if subject.n > EIGEN or subject.dense is None:
        return None
    subject.check()
    try:
        values, vectors = np.linalg.eig(subject.dense)
    except np.linalg.LinAlgError:
        return None
    for k in np.flatnonzero((values.imag == 0) & (values.real <= 0)):
        v = np.array(vectors[:, k].real)
        v[np.abs(v) < NOISE * np.abs(v).max()] = 0.0
        signs_of_product = signs(subject.dense, v, subject.check) * np.sign(v)
        reverses = signs_of_product <= 0 if strict else signs_of_product[v != 0] < 0
        if reverses.all():
            return v
    return None
