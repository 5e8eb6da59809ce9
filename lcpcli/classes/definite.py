"""Positive definite and semidefinite matrices, symmetric or not: the sign of v'Mv = v'(M + M')v / 2.

Small matrices are decided by exact elimination. For larger ones, Cholesky's factorization of a slightly smaller matrix
proves definiteness in spite of rounding (S. M. Rump, Verification of positive definiteness, BIT Numerical Mathematics
46 (2006) 433-452), a failed one gives a v, and the sign of v'Mv is determined exactly.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.classes import certify
from lcpcli.classes.context import Context, signs
from lcpcli.classes.dominance import h_plus_part
from lcpcli.classes.verdict import NO, UNDECIDED, YES, Verdict, as_floats, entry, index_set, shown
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.rational import linear
from lcpcli.typing import Matrix, Vector

EXACT_FIRST = 20  # n up to which exact elimination precedes floating-point arithmetic
EXACT_LAST = 200  # n up to which it is tried while time is left
UNSEEN = "neither a v with v'Mv < 0 nor a proof that there is none was found"
RATIONAL = 16  # pivots up to which the vector of a pivot is computed exactly


def positive_definite(context: Context) -> Verdict:
    """v'Mv > 0 for every v != 0."""
    found = _by_diagonal(context, strict=True)
    if found is not None:
        return found
    if context.n > EXACT_FIRST:
        found = _by_rounded_arithmetic(context)
        if found.word != UNDECIDED or context.n > EXACT_LAST:
            return found
    sets = context.definiteness
    if sets.zero is None and sets.negative is None:
        return Verdict(YES, "exact elimination of M + M' gives only positive pivots")
    return _by_index_set(context, sets.zero or sets.negative or (), strict=True)


def positive_semidefinite(context: Context) -> Verdict:
    """v'Mv >= 0 for every v."""
    if context.yes("positive_definite"):
        return Verdict(YES, "it is positive definite")
    if context.yes("skew_symmetric"):
        return Verdict(YES, "v'Mv = 0 for every v, as M' = -M")
    witness = context.verdicts["positive_definite"]
    if witness.vector is not None and context.form_is(lambda sign: sign < 0, witness.vector):
        return Verdict(NO, f"v'Mv < 0 for v = {shown(witness.vector)}", witness.indices, witness.vector)
    found = _by_diagonal(context, strict=False)
    if found is None and context.n > EXACT_FIRST:
        found = _by_support(context)
    if found is None and context.n <= EXACT_LAST:
        sets = context.definiteness
        if sets.negative is None:
            return Verdict(YES, "exact elimination of M + M' gives no negative pivot")
        found = _by_index_set(context, sets.negative, strict=False)
    return found or Verdict(UNDECIDED, witness.evidence if witness.word == UNDECIDED else UNSEEN)


def _by_diagonal(context: Context, strict: bool) -> Verdict | None:
    """No, for a negative diagonal entry, or if strict for one that is not positive."""
    low = np.flatnonzero(context.diagonal <= 0 if strict else context.diagonal < 0)
    if not low.size:
        return None
    i, v = int(low[np.argmin(context.diagonal[low])]), np.zeros(context.n)
    v[i] = 1.0
    return Verdict(
        NO, f"v'Mv = {entry(i, i)} = {context.diagonal[i]:.6g} for the unit vector v of index {i + 1}", (i,), v
    )


def _by_rounded_arithmetic(context: Context) -> Verdict:
    """A proof or a counterexample by floating-point factorizations, both verified."""
    for candidate in (np.ones(context.n), context.witness("h_plus")):
        if candidate is not None and context.form_is(lambda sign: sign <= 0, candidate):
            return Verdict(NO, f"v'Mv <= 0 for v = {shown(candidate)}", vector=candidate)
    if context.yes("symmetric", "h_plus"):
        return Verdict(YES, "it is symmetric and an H+-matrix")
    context.check()
    S = context.symmetric_part
    if not np.isfinite(S.data if is_sparse(S) else S).all():
        return Verdict(UNDECIDED, "M + M' overflows")
    if is_sparse(S) and _exact_sum(context, S) and h_plus_part(S, context.check):
        return Verdict(YES, "M + M' is an H+-matrix: its diagonal is positive and dominant after scaling the columns")
    context.check()
    outcome = certify.definite(S)
    if outcome.proved:
        return Verdict(YES, "Cholesky's factorization of (M + M') / 2 shifted by more than its rounding error succeeds")
    v = outcome.direction
    if v is not None and context.form_is(lambda sign: sign <= 0, v):
        return Verdict(NO, f"v'Mv <= 0 for v = {shown(v)}", vector=v)
    return Verdict(UNDECIDED, outcome.reason)


def _exact_sum(context: Context, S: Matrix) -> bool:
    """Whether M + M' was computed without rounding."""
    if context.yes("symmetric"):
        return bool(np.isfinite(S.data if is_sparse(S) else S).all())
    M, T = context.M, context.M.T
    with np.errstate(over="ignore", invalid="ignore"):
        lost = (S - M) - T
        lost_too = (S - T) - M
    return not any((part.data if is_sparse(part) else part).any() for part in (lost, lost_too))


def _by_support(context: Context) -> Verdict | None:
    """Semidefinite by M + M' without its zero rows, or by weak diagonal dominance."""
    S = context.symmetric_part
    sizes = np.asarray(abs(S).sum(axis=1)).ravel()
    support = np.flatnonzero(sizes)
    diagonal = np.asarray(S.diagonal())
    loose = support[diagonal[support] == 0]
    if loose.size:
        return _indefinite(context, S, int(loose[0]))
    if support.size < context.n:
        block = Context(context.M[support][:, support], context.deadline)
        found = positive_definite(block)
        if found.word == YES:
            return Verdict(
                YES, f"M + M' has {context.n - support.size} zero rows, and is positive definite without them"
            )
    return _weakly_dominant(context, S)


def _weakly_dominant(context: Context, S: Matrix) -> Verdict | None:
    if _exact_sum(context, S) and (signs(matrices.comparison(S), np.ones(context.n), context.check) >= 0).all():
        return Verdict(YES, "M + M' is weakly diagonally dominant with a nonnegative diagonal")
    return None


def _indefinite(context: Context, S: Matrix, i: int) -> Verdict | None:
    """A row of M + M' with a zero on the diagonal and another entry: v'Mv < 0 for some v with two nonzero entries."""
    row = matrices.dense(S[[i]])[0]
    j, v = int(np.abs(row).argmax()), np.zeros(context.n)
    v[i], v[j] = -np.sign(row[j]) * (abs(context.diagonal[j]) / abs(row[j]) + 1.0), 1.0
    if not context.form_is(lambda sign: sign < 0, v):
        return None
    return Verdict(NO, f"v'Mv < 0 for v with entries {v[i]:.6g} at {i} and 1 at {j}", (i, j), v)


def _by_index_set(context: Context, indices: tuple[int, ...], strict: bool) -> Verdict:
    """No, for a principal minor of M + M' that is negative, or zero if strict, with a vector if one is exact."""
    v = _vector(context, indices)
    right = v is not None and context.form_is((lambda sign: sign <= 0) if strict else (lambda sign: sign < 0), v)
    if v is not None and right:
        return Verdict(NO, f"v'Mv {'<=' if strict else '<'} 0 for v = {shown(v)}", indices, v)
    size = "not positive" if strict else "negative"
    return Verdict(NO, f"the minor {index_set(indices)} of M + M' is {size}", indices)


def _vector(context: Context, indices: tuple[int, ...]) -> Vector | None:
    """v with support in the index set, from the last pivot on it: S_PP x = -S_Pk, v = (x, 1); or from the last two."""
    v = np.zeros(context.n)
    if len(indices) <= RATIONAL:
        whole = context.whole_symmetric_part()
        S = [[whole[i][j] for j in indices] for i in indices]
        exact = _curvature(S)
        floats = None if exact is None else as_floats(exact)
        if floats is not None:
            v[list(indices)] = floats
            return v
    rows = list(indices)
    block = context.symmetric_part[rows][:, rows]
    try:
        v[rows] = np.linalg.eigh(matrices.dense(block))[1][:, 0]
    except np.linalg.LinAlgError:
        return None
    return v


def _curvature(S: linear.Rows) -> list[Fraction] | None:
    """The v = (x, 1) that minimizes v'Sv, exactly, if the leading block is nonsingular."""
    k = len(S) - 1
    x, free = linear.solve([row[:k] for row in S[:k]], [-row[k] for row in S[:k]])
    return None if x is None or free else [*x, Fraction(1)]
