"""Positive definite and semidefinite matrices, symmetric or not: the sign of v'Mv, which is that of v'(M + M')v / 2.

Small matrices are decided by exact elimination. For larger ones, Cholesky's factorization of a slightly smaller matrix
proves definiteness in spite of rounding (S. M. Rump, Verification of positive definiteness, BIT Numerical Mathematics
46 (2006) 433-452), an unsuccessful one gives a v, and the sign of v'Mv is decided exactly.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.classes import certify
from lcpcli.classes.context import Subject, signs
from lcpcli.classes.dominance import h_plus_part
from lcpcli.classes.verdict import NO, OPEN, YES, Verdict, as_floats, index_set, shown
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational import elimination, linear
from lcpcli.typing import Matrix, Vector

EXACT_FIRST = 20  # n up to which exact elimination comes before rounded arithmetic
EXACT_LAST = 200  # n up to which it is tried while time is left
UNSEEN = "no v with v'Mv < 0 is to be seen, nor a proof that there is none"
RATIONAL = 16  # pivots up to which the vector of a pivot is computed exactly


def positive_definite(subject: Subject) -> Verdict:
    """v'Mv > 0 for every v != 0."""
    found = _by_diagonal(subject, strict=True)
    if found is not None:
        return found
    if subject.n > EXACT_FIRST:
        found = _by_rounded_arithmetic(subject)
        if found.word != OPEN or subject.n > EXACT_LAST:
            return found
    sets = subject.definiteness
    if sets.zero is None and sets.negative is None:
        return Verdict(YES, "exact elimination of M + M' meets positive pivots only")
    return _by_index_set(subject, sets.zero or sets.negative or (), strict=True)


def positive_semidefinite(subject: Subject) -> Verdict:
    """v'Mv >= 0 for every v."""
    if subject.yes("positive_definite"):
        return Verdict(YES, "it is positive definite")
    if subject.yes("skew_symmetric"):
        return Verdict(YES, "v'Mv = 0 for every v, as M' = -M")
    witness = subject.verdicts["positive_definite"]
    if witness.vector is not None and subject.form_is(lambda sign: sign < 0, witness.vector):
        return Verdict(NO, f"v'Mv < 0 for v = {shown(witness.vector)}", witness.indices, witness.vector)
    found = _by_diagonal(subject, strict=False)
    if found is None and subject.n > EXACT_FIRST:
        found = _by_support(subject)
    if found is None and subject.n <= EXACT_LAST:
        sets = subject.definiteness
        if sets.negative is None:
            return Verdict(YES, "exact elimination of M + M' meets no negative pivot")
        found = _by_index_set(subject, sets.negative, strict=False)
    return found or Verdict(OPEN, witness.evidence if witness.word == OPEN else UNSEEN)


def _by_diagonal(subject: Subject, strict: bool) -> Verdict | None:
    """What the diagonal excludes: a negative entry, or one that is not positive."""
    low = np.flatnonzero(subject.diagonal <= 0 if strict else subject.diagonal < 0)
    if not low.size:
        return None
    i, v = int(low[np.argmin(subject.diagonal[low])]), np.zeros(subject.n)
    v[i] = 1.0
    return Verdict(NO, f"v'Mv = M[{i}][{i}] = {subject.diagonal[i]:.6g} for the unit vector v of index {i}", (i,), v)


def _by_rounded_arithmetic(subject: Subject) -> Verdict:
    """A proof or a counterexample by floating-point factorizations, both checked."""
    for candidate in (np.ones(subject.n), subject.witness("h_plus")):
        if candidate is not None and subject.form_is(lambda sign: sign <= 0, candidate):
            return Verdict(NO, f"v'Mv <= 0 for v = {shown(candidate)}", vector=candidate)
    if subject.yes("symmetric", "h_plus"):
        return Verdict(YES, "it is symmetric and an H+-matrix")
    subject.check()
    S = subject.symmetric_part
    if not np.isfinite(S.data if is_sparse(S) else S).all():
        return Verdict(OPEN, "M + M' overflows")
    if is_sparse(S) and _exact_sum(subject, S) and h_plus_part(S, subject.check):
        return Verdict(YES, "M + M' is an H+-matrix: its diagonal is positive and dominates, columns suitably scaled")
    subject.check()
    outcome = certify.definite(S)
    if outcome.proved:
        return Verdict(YES, "Cholesky's factorization of (M + M') / 2 less more than its rounding error succeeds")
    v = outcome.direction
    if v is not None and subject.form_is(lambda sign: sign <= 0, v):
        return Verdict(NO, f"v'Mv <= 0 for v = {shown(v)}", vector=v)
    return Verdict(OPEN, outcome.reason)


def _exact_sum(subject: Subject, S: Matrix) -> bool:
    """Whether M + M' was computed without rounding: no part of it is lost."""
    if subject.yes("symmetric"):
        return bool(np.isfinite(S.data if is_sparse(S) else S).all())
    M, T = subject.M, subject.M.T
    with np.errstate(over="ignore", invalid="ignore"):
        lost = (S - M) - T
        lost_too = (S - T) - M
    return not any((part.data if is_sparse(part) else part).any() for part in (lost, lost_too))


def _by_support(subject: Subject) -> Verdict | None:
    """Semidefinite by what is left of M + M' without its rows of zeros, or by weak dominance."""
    S = subject.symmetric_part
    sizes = np.asarray(abs(S).sum(axis=1)).ravel()
    support = np.flatnonzero(sizes)
    diagonal = np.asarray(S.diagonal())
    loose = support[diagonal[support] == 0]
    if loose.size:
        return _indefinite(subject, S, int(loose[0]))
    if support.size < subject.n:
        block = Subject(subject.M[support][:, support], subject.deadline)
        found = positive_definite(block)
        if found.word == YES:
            return Verdict(
                YES, f"M + M' has {subject.n - support.size} rows of zeros, and is positive definite without them"
            )
    return _weakly_dominant(subject, S)


def _weakly_dominant(subject: Subject, S: Matrix) -> Verdict | None:
    if _exact_sum(subject, S) and (signs(matrices.comparison(S), np.ones(subject.n), subject.check) >= 0).all():
        return Verdict(YES, "no diagonal entry of M + M' is smaller than the other entries of its row together")
    return None


def _indefinite(subject: Subject, S: Matrix, i: int) -> Verdict | None:
    """A row of M + M' with a zero on the diagonal and another entry: v'Mv < 0 for some v of two entries."""
    row = matrices.dense(S[[i]])[0]
    j, v = int(np.abs(row).argmax()), np.zeros(subject.n)
    v[i], v[j] = -np.sign(row[j]) * (abs(subject.diagonal[j]) / abs(row[j]) + 1.0), 1.0
    if not subject.form_is(lambda sign: sign < 0, v):
        return None
    return Verdict(NO, f"v'Mv < 0 for v of entries {v[i]:.6g} at {i} and 1 at {j}", (i, j), v)


def _by_index_set(subject: Subject, indices: tuple[int, ...], strict: bool) -> Verdict:
    """No, for a principal minor of M + M' that is negative, or zero if strict, with a vector where one is exact."""
    v = _vector(subject, indices)
    right = v is not None and subject.form_is((lambda sign: sign <= 0) if strict else (lambda sign: sign < 0), v)
    if v is not None and right:
        return Verdict(NO, f"v'Mv {'<=' if strict else '<'} 0 for v = {shown(v)}", indices, v)
    size = "not positive" if strict else "negative"
    return Verdict(NO, f"the minor {index_set(indices)} of M + M' is {size}", indices)


def _vector(subject: Subject, indices: tuple[int, ...]) -> Vector | None:
    """v with support in the index set, from the last pivot on it: S_PP x = -S_Pk, v = (x, 1); or from the last two."""
    v = np.zeros(subject.n)
    if len(indices) <= RATIONAL:
        whole = subject.whole_symmetric_part()
        S = [[whole[i][j] for j in indices] for i in indices]
        exact = _curvature(S)
        floats = None if exact is None else as_floats(exact)
        if floats is not None:
            v[list(indices)] = floats
            return v
    rows = list(indices)
    block = subject.symmetric_part[rows][:, rows]
    try:
        v[rows] = np.linalg.eigh(matrices.dense(block))[1][:, 0]
    except np.linalg.LinAlgError:
        return None
    return v


def _curvature(S: elimination.Rows) -> list[Fraction] | None:
    """The v = (x, 1) that minimises v'Sv, exactly, where the leading block is regular."""
    k = len(S) - 1
    x, free = linear.solve([row[:k] for row in S[:k]], [-row[k] for row in S[:k]])
    return None if x is None or free else [*x, Fraction(1)]
