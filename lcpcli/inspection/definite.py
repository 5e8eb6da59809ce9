"""Positive definite and semidefinite matrices, symmetric or not: the sign of v'Mv = v'(M + M')v / 2.

Small matrices are decided by exact elimination, larger ones by factors of S = M + M' that prove definiteness (see
`verify.matrix_classes`). A factorization that fails gives a v, and v'Mv is determined exactly.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli.clock import imports
from lcpcli.inspection.p_matrices import scaled_dominance
from lcpcli.inspection.verdict import (
    NO,
    UNDECIDED,
    YES,
    Context,
    Verdict,
    block,
    entry,
    index_set,
    signs,
    sums_exactly,
    text_of,
)
from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.patterns import affordable
from lcpcli.rational import elimination
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.matrix_classes import proof_of_definiteness

EXACT_FIRST = 20  # n up to which exact elimination, in milliseconds, precedes floating-point arithmetic
EXACT_LAST = 200  # n up to which exact elimination is tried while time is left; beyond, its integers are too long
RATIONAL = 16  # pivots up to which the vector of a pivot is computed exactly: its fractions stay short
MOST_SINGULAR = 500  # n up to which a dense factorization of a singular matrix takes hundredths of a second
DENOMINATOR = 60.0  # of which the denominators of a null space of small integers are divisors
RANK_TOLERANCE = 1e-10  # of the largest pivot: a pivot of singular matrices below it is rounding
UNSEEN = "neither a v with v'Mv < 0 nor a proof that there is none was found"


def positive_definite(context: Context) -> Verdict:
    """Decide whether v'Mv > 0 for every v != 0."""
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
    """Decide whether v'Mv >= 0 for every v."""
    if context.yes("skew_symmetric"):
        return Verdict(YES, "v'Mv = 0 for every v, as M' = -M")
    witness = context.verdicts["positive_definite"]
    found = context.implied("positive_definite") or _by_vector(context, witness.vector, False, witness.indices)
    found = found or _by_diagonal(context, strict=False)
    if found is None and context.n > EXACT_FIRST:
        found = _by_support(context)
    if found is None and context.n <= EXACT_LAST:
        sets = context.definiteness
        if sets.negative is None:
            return Verdict(YES, "exact elimination of M + M' gives no negative pivot")
        found = _by_index_set(context, sets.negative, strict=False)
    return found or Verdict(UNDECIDED, witness.evidence if witness.word == UNDECIDED else UNSEEN)


def _by_vector(
    context: Context, v: Vector | None, strict: bool, indices: tuple[int, ...] | None = None
) -> Verdict | None:
    """Return NO if v'Mv is proved to be negative, or, if strict, not to be positive; else None."""
    if v is None or not context.form_is_low(v, strict):
        return None
    return Verdict(NO, f"v'Mv {'<=' if strict else '<'} 0 for v = {text_of(v)}", indices, v)


def _by_diagonal(context: Context, strict: bool) -> Verdict | None:
    """Return NO if the least diagonal entry is negative, or, if strict, not positive; else None."""
    i = int(context.diagonal.argmin())
    if context.diagonal[i] > 0 or (context.diagonal[i] == 0 and not strict):
        return None
    found = f"v'Mv = {entry(i, i)} = {context.diagonal[i]:.6g} for the unit vector v of index {i + 1}"
    return Verdict(NO, found, (i,), context.vector((i,), (1,)))


def _by_rounded_arithmetic(context: Context) -> Verdict:
    """Find a proof or a counterexample by floating-point factorizations, both verified."""
    scaling = context.verdicts["h_plus"].vector if "h_plus" in context.verdicts else None
    found = _by_vector(context, np.ones(context.n), True) or _by_vector(context, scaling, True)
    if found is not None:
        return found
    if context.yes("symmetric", "h_plus"):
        return Verdict(YES, "it is symmetric and an H+-matrix")
    context.check()
    S = context.symmetric_part
    if not np.isfinite(abs(S).max()):
        return Verdict(UNDECIDED, "M + M' overflows")
    if is_sparse(S) and _is_exact(context, S) and scaled_dominance(S, context.check).word == YES:
        return Verdict(YES, "M + M' is an H+-matrix: its diagonal is positive and dominant after scaling the columns")
    context.check()
    if not affordable(S):
        return Verdict(UNDECIDED, "a factorization of M + M' may be too expensive")
    proved, v = proof_of_definiteness(S)
    if proved:
        return Verdict(YES, "Cholesky's factorization of (M + M') / 2 shifted by more than its rounding error succeeds")
    undecided = Verdict(UNDECIDED, "rounding errors prevent a proof, and no counterexample was found")
    return _by_vector(context, v, True) or undecided


def _is_exact(context: Context, S: Matrix) -> bool:
    """Return whether M + M' was computed without rounding."""
    M, T = context.M, context.M.T
    with np.errstate(over="ignore", invalid="ignore"):
        return not any((lost != 0).sum() for lost in ((S - M) - T, (S - T) - M))


def _by_support(context: Context) -> Verdict | None:
    """Decide semidefiniteness by M + M' without its zero rows, by weak diagonal dominance, or by a zero on the diagonal
    beside another entry."""
    S = context.symmetric_part
    support = np.flatnonzero(abs(S).sum(axis=1))
    loose = support[S.diagonal()[support] == 0]
    if loose.size:
        i, v = int(loose[0]), np.zeros(context.n)
        row = matrices.dense(S[[i]])[0]
        j = int(np.abs(row).argmax())
        v[i], v[j] = -np.sign(row[j]) * (abs(context.diagonal[j]) / abs(row[j]) + 1.0), 1.0
        found = f"v'Mv < 0 for v with entries {v[i]:.6g} at {i + 1} and 1 at {j + 1}"
        return Verdict(NO, found, (i, j), v) if context.form_is_low(v, strict=False) else None
    if support.size < context.n:
        part = Context(context.M[support][:, support], context.check)
        if positive_definite(part).word == YES:
            zero_rows = f"M + M' has {context.n - support.size} zero rows"
            return Verdict(YES, f"{zero_rows}, and is positive definite without them")
    if _is_exact(context, S) and (signs(matrices.comparison(S), np.ones(context.n), context.check) >= 0).all():
        return Verdict(YES, "M + M' is weakly diagonally dominant with a nonnegative diagonal")
    return None


def _by_index_set(context: Context, indices: tuple[int, ...], strict: bool) -> Verdict:
    """Return NO by a principal minor of M + M' that is negative, or zero if strict, with a vector if it is exact."""
    minor = f"the minor {index_set(indices)} of M + M' is {'not positive' if strict else 'negative'}"
    return _by_vector(context, _vector(context, indices), strict, indices) or Verdict(NO, minor, indices)


def _vector(context: Context, indices: tuple[int, ...]) -> Vector | None:
    """Return v with support in the index set P: (x, 1) with S_PP x = -S_Pk without the last pivot k, exactly if P is
    small, else an eigenvector of the least eigenvalue."""
    if len(indices) <= RATIONAL:
        *S, last = block(context.whole_symmetric_part(), indices)
        x, free = elimination.solve([row[:-1] for row in S], [-value for value in last[:-1]])
        exact = None if x is None or free else context.vector(indices, [*x, Fraction(1)])
        if exact is not None:
            return exact
    rows = list(indices)
    v = np.zeros(context.n)
    try:
        v[rows] = np.linalg.eigh(matrices.dense(context.symmetric_part[rows][:, rows]))[1][:, 0]
    except np.linalg.LinAlgError:
        return None
    return v


def semidefinite_rank(S: Matrix) -> int | None:
    """Return the rank of a symmetric S of shape (n, n) if floating point proves that S is positive semidefinite, else
    None: n if a factorization does. A singular S is semidefinite if some S_PP is definite and the columns outside of P
    are combinations of those in P, for which a guess is rounded to multiples of 1 / DENOMINATOR and checked exactly.
    """
    P = np.flatnonzero(matrices.row_maxima(S))
    S = S[P][:, P]
    if not P.size or S.diagonal().min() <= 0 or not affordable(S):
        return None
    if proof_of_definiteness(S)[0]:
        return P.size
    if P.size > MOST_SINGULAR:
        return None
    with imports:
        from scipy.linalg import get_lapack_funcs, solve_triangular
    A = matrices.dense(S)
    (pstrf,) = get_lapack_funcs(("pstrf",), (A,))
    R, order, rank, is_singular = pstrf(A, tol=RANK_TOLERANCE * A.diagonal().max())
    if not is_singular:
        return None
    order -= 1
    whole = np.rint(DENOMINATOR * solve_triangular(R[:rank, :rank], R[:rank, rank:]))
    null_space = np.vstack((whole, -DENOMINATOR * np.eye(P.size - rank)))
    A = A[order][:, order]
    if not sums_exactly(A, float((np.abs(A) @ np.abs(null_space)).max())) or (A @ null_space).any():
        return None
    return int(rank) if proof_of_definiteness(A[:rank, :rank])[0] else None
