"""Classes of matrices: P, P0, sufficient, H+ and M-matrices, positive definite and
semidefinite, and copositive matrices; each is decided by a proof or a counterexample.

Principal minors. A P-matrix has only positive principal minors, a P0-matrix no negative
ones. Small matrices are decided by all their principal minors, in exact arithmetic.
Larger ones belong to P or P0 by an implication, or are ruled out by one minor, or by a
vector whose signs M reverses (M. Fiedler and V. Pták, Czechoslovak Mathematical Journal
12 (1962) 382-400): v_i (Mv)_i <= 0 for all i, v != 0, for P; v_i (Mv)_i < 0 wherever
v_i != 0 for P0.

Sufficient matrices. M is column sufficient if z_i (Mz)_i <= 0 for all i implies that
all are 0, and row sufficient if M' is column sufficient (R. W. Cottle, J.-S. Pang and
V. Venkateswaran, Linear Algebra Appl. 114/115 (1989) 231-249). Both imply P0. Small
matrices are decided exactly: let z be a counterexample of smallest support P, I the
indices with z_i (Mz)_i < 0, and J the others in P. M_PP + T is singular for the
diagonal T of -(Mz)_i / z_i. Its determinant is a sum over the principal minors from J
to P, each times a positive number; in a P0-matrix they are therefore all 0, and M_PP +
T is singular for every T >= 0 with support in I. No null vector of it vanishes on I, as
a multiple of it could be subtracted from z to make P smaller. So the null space of M_PP
+ t diag(1_I), t > 0, contains a counterexample; it suffices to examine all I and P.

H+ and M-matrices are P-matrices: they are strictly diagonally dominant after a positive
scaling d of the columns, with C d > 0 for the comparison matrix C (see
`verify.error_theorems`). There is no such d if C v <= 0 for some v >= 0, v != 0, as
C^-1 >= 0. d and v are computed in double precision and verified exactly.

Positive definite and semidefinite matrices, symmetric or not, are decided by the sign
of v'Mv = v'(M + M')v / 2: small ones by exact elimination, larger ones by factors of S
= M + M' (see `verify.error_theorems`). A factorization that fails yields a v, and the
sign of v'Mv is determined exactly. If entries are rounded numbers, rounding may have
moved zero eigenvalues to either side of 0: the class is then not decided.

Copositive matrices have v'Mv >= 0 for all v >= 0, strictly copositive ones > 0 for v !=
0; for copositive-plus ones, (M + M')v = 0 wherever v >= 0 and v'Mv = 0. Small matrices
are decided exactly, with S = M + M' and one linear system per index set P. S is
copositive unless, for some P with det S_PP < 0, u = -S_PP^-1 e is nonnegative (K. P.
Hadeler, Linear Algebra Appl. 49 (1983) 79-89; R. W. Cottle, G. J. Habetler and C. E.
Lemke, ibid. 3 (1970) 295-310); then u'S_PP u = -e'u < 0. The zeros of a copositive form
are sums of those of minimal support, where S_PP has only the null vector u > 0 (R.
Hildebrand, ibid. 459 (2014) 154-174). Of any size, a sum of a positive semidefinite
matrix and one without negative entries is copositive, such as that of contact with
friction (D. E. Stewart and J. C. Trinkle, Int. J. Numer. Methods Eng. 39 (1996)
2673-2691), in any order of the rows.
"""

from __future__ import annotations

from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.inspection import verdict
from lcpcli.inspection.verdict import (
    NO,
    UNDECIDED,
    YES,
    Context,
    Verdict,
    entry,
    index_set,
    text_of,
)
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.patterns import affordable
from lcpcli.linalg.units import half_power
from lcpcli.rational import elimination, numbers
from lcpcli.rational.rank import has_rank
from lcpcli.typing import Indices, Matrix, Vector
from lcpcli.verify.error_theorems import (
    proof_of_definiteness,
    scaling,
    semidefinite_by_rounding,
    semidefinite_within,
)

# n up to which the leading minors of C are computed exactly, in about a second.
EXACT_MINORS = 64
# Steps of power iteration for a v that rules out d; it is verified, whatever its
# accuracy.
STEPS = 300
# Components of v below this, relative to the largest one, have not converged and are
# set to 0.
ZERO = 1e-9


def h_plus(context: Context) -> Verdict:
    """Decide whether M_ii > 0, and M_ii d_i > sum of |M_ij| d_j, j != i, in every row
    for some d > 0."""
    decision = context.low_diagonal() or scaled_dominance(context.M, context.check)
    if decision.word == YES and context.yes("symmetric"):  # then M is positive definite
        return context.by_rounding() or decision
    return decision


def m_matrix(context: Context) -> Verdict:
    """Decide whether M is a nonsingular M-matrix: a Z-matrix that is an H+-matrix."""
    if not context.yes("z_matrix"):
        return Verdict(NO, "it is not a Z-matrix")
    word = context.verdicts["h_plus"].word
    undecided = "whether it is an H+-matrix is not decided"
    return Verdict(
        word,
        {YES: "it is a Z-matrix and an H+-matrix", NO: "it is not an H+-matrix"}.get(
            word, undecided
        ),
    )


def scaled_dominance(M: Matrix, check: verdict.Check) -> Verdict:
    """Decide whether M, with positive diagonal, is an H+-matrix."""
    C, e = matrices.comparison(M), np.ones(M.shape[0])
    row = verdict.signs(C, e, check)
    if (row > 0).all():
        return Verdict(
            YES, "it is strictly diagonally dominant: d = (1, ..., 1)", vector=e
        )
    if (row <= 0).all():
        return _not_dominant(e)
    if (
        d := scaling(M, lambda d: bool((verdict.signs(C, d, check) > 0).all()), check)
    ) is not None:
        evidence = (
            f"scaling the columns of M by d = {text_of(d)} makes it strictly "
            "diagonally dominant"
        )
        return Verdict(YES, evidence, vector=d)
    v, diagonal = e, C.diagonal()
    # Power iteration with I + J, which may converge to a Perron vector v >= 0 of J = I
    # - D^-1 C.
    for _ in range(STEPS):
        check()
        v = 2 * v - matrices.product(C, v) / diagonal
        if not np.isfinite(v).all() or not v.max() > 0:
            v = np.zeros(e.size)
            break
        v = v / v.max()
    v[v < ZERO] = 0.0
    if v.any() and (verdict.signs(C, v, check) <= 0).all():
        return _not_dominant(v)
    if e.size > EXACT_MINORS:
        return Verdict(
            UNDECIDED, "neither a scaling d nor a vector that rules one out is known"
        )
    first = elimination.definiteness(numbers.integers(matrices.dense(C)), check)
    indices = first.zero or first.negative
    if indices is None:
        return Verdict(
            YES,
            "all leading minors of its comparison matrix are positive, in exact "
            "arithmetic",
        )
    return Verdict(
        NO,
        f"the minor {index_set(indices)} of its comparison matrix is not positive",
        indices,
    )


def _not_dominant(v: Vector) -> Verdict:
    return Verdict(
        NO,
        f"M_ii v_i <= sum of |M_ij| v_j, j != i, in every row for v = {text_of(v)}",
        vector=v,
    )


# n up to which all 2^n - 1 = 16383 minors are computed, in half a second.
ALL_MINORS = 14
ALL_PAIRS = 8  # n up to which all 3^n = 6561 pairs of index sets are examined
# n up to which eigenvectors are computed, in a fraction of a second.
MAX_WITH_VECTORS = 300
# n up to which all pairs of a dense matrix are examined: 32 MB for each n x n array.
PAIRS = 2000
# Pairs whose minor is computed exactly: those with the smallest minors in
# floating-point arithmetic, one of which is negative if any is.
CANDIDATES = 10
# Components of an eigenvector below this, relative to the largest one, are rounding
# errors and set to 0.
EIGENVECTOR_RTOL = 1e-13


def p_matrix(context: Context) -> Verdict:
    """Decide whether every principal minor is positive."""
    decision = context.implied("positive_definite", "h_plus") or _by_symmetry(
        context, "positive_definite"
    )
    return decision or _by_minors(context, strict=True)


def p0_matrix(context: Context) -> Verdict:
    """Decide whether no principal minor is negative."""
    decision = context.implied("p_matrix", "positive_semidefinite") or _by_symmetry(
        context, "positive_semidefinite"
    )
    return decision or _by_minors(context, strict=False)


def _by_symmetry(context: Context, name: str) -> Verdict | None:
    """Decide for symmetric M, which is P if and only if it is positive definite, and P0
    if and only if it is positive semidefinite; None for other M.
    """
    if not context.yes("symmetric"):
        return None
    return context.excluded(name, "it is symmetric and not") or context.by_rounding()


def _by_minors(context: Context, strict: bool) -> Verdict:
    """Decide by a minor that rules out M, by all minors if they are few, or by a vector
    whose signs M reverses."""
    size = "not positive" if strict else "negative"
    if (low := context.low_diagonal(strict)) is not None:
        return low
    if (pair := _pair(context, strict)) is not None:
        return Verdict(NO, f"the principal minor {index_set(pair)} is {size}", pair)
    if context.n <= ALL_MINORS:
        for indices, minor in elimination.principal_minors(
            context.whole(), context.check
        ):
            if minor < 0 or (strict and minor == 0):
                return Verdict(
                    NO, f"the principal minor {index_set(indices)} is {size}", indices
                )
        return Verdict(
            YES,
            f"none of its {2**context.n - 1} principal minors is {size}, in "
            "exact arithmetic",
        )
    if (v := _sign_reversal(context, strict)) is not None:
        bound = "<= 0" if strict else "< 0"
        return Verdict(
            NO,
            f"v_i (Mv)_i {bound} wherever v_i is not 0, for v = {text_of(v)}",
            vector=v,
        )
    return _undecided(context, "principal minors")


def _pair(context: Context, strict: bool) -> tuple[int, int] | None:
    """Return the indices of a principal minor of order 2 that is exactly negative, or
    zero if `strict`; None if there is none among those examined.
    """
    M, diagonal = context.M, context.diagonal
    if matrices.is_sparse(M):
        product = M.multiply(M.T).tocoo()
        rows = product.row
        columns = product.col
        values = product.data
    elif context.n <= PAIRS:
        values = (M * M.T).ravel()
        rows, columns = np.divmod(np.arange(values.size), context.n)
    else:
        return None
    above_diagonal = np.flatnonzero((rows < columns) & (values > 0))
    rows, columns = rows[above_diagonal], columns[above_diagonal]
    excess = values[above_diagonal] / diagonal[rows] / diagonal[columns]
    likely = np.flatnonzero(excess >= 1 - 1e-15)
    for k in likely[np.argsort(-excess[likely], kind="stable")][:CANDIDATES]:
        pair = int(rows[k]), int(columns[k])
        minor = elimination.determinant(
            numbers.integers(matrices.dense(M[list(pair)][:, list(pair)]))
        )
        if minor < 0 or (strict and minor == 0):
            return pair
    return None


def _sign_reversal(context: Context, strict: bool) -> Vector | None:
    """Return a real eigenvector of a nonpositive eigenvalue if M reverses its signs
    exactly; otherwise None.
    """
    if context.n > MAX_WITH_VECTORS:
        return None
    context.check()
    M = matrices.dense(context.M)
    with suppress(np.linalg.LinAlgError):
        values, vectors = np.linalg.eig(M)
        for k in np.flatnonzero((values.imag == 0) & (values.real <= 0)):
            v = np.array(vectors[:, k].real)
            v[np.abs(v) < EIGENVECTOR_RTOL * np.abs(v).max()] = 0.0
            products = verdict.signs(M, v, context.check) * np.sign(v)
            if (products <= 0 if strict else products[v != 0] < 0).all():
                return v
    return None


def row_sufficient(context: Context) -> Verdict:
    """Decide whether z_i (M'z)_i <= 0 for all i implies that all of these are 0."""
    if context.yes("symmetric"):
        column_verdict = context.verdicts["column_sufficient"]
        return Verdict(
            column_verdict.word,
            "it is symmetric, so this is column sufficiency",
            column_verdict.indices,
            column_verdict.vector,
        )
    return column_sufficient(context, "M'z")


def column_sufficient(context: Context, product: str = "Mz") -> Verdict:
    """Decide whether z_i (Mz)_i <= 0 for all i, or the same for another product,
    implies that all of these are 0."""
    decision = context.implied("p_matrix", "positive_semidefinite") or context.excluded(
        "p0_matrix"
    )
    if decision is not None:
        return decision
    if context.n > ALL_PAIRS:
        return Verdict(
            UNDECIDED,
            f"3^{context.n} pairs of index sets are too many; no sufficient condition "
            "that is tested holds",
        )
    if not context.yes("p0_matrix"):
        return Verdict(UNDECIDED, "whether it is a P0-matrix is not decided")
    M = context.whole()
    A = M if product == "Mz" else list(map(list, zip(*M, strict=True)))
    for P, part in verdict.blocks(A, context.check):
        if elimination.determinant(part):
            continue
        t = max(abs(v) for row in part for v in row) or 1
        for inside in verdict.index_sets(len(P)):
            context.check()
            # If (A + t diag(1_I)) z = 0 and z is not 0 on I, then z_i (Az)_i = -t z_i^2
            # on I, and 0 elsewhere: z is a counterexample.
            shifted = [
                [v + t * (i == j and i in inside) for j, v in enumerate(row)]
                for i, row in enumerate(part)
            ]
            _, free = elimination.solve(shifted, [0] * len(part))
            u = next((z for z in free if any(z[i] for i in inside)), None)
            if u is not None:
                claim = f"z_i ({product})_i <= 0 for all i and < 0 for one"
                z = context.vector(P, u)
                support = f"for a z with support {index_set(P)}, in exact arithmetic"
                return Verdict(
                    NO,
                    f"{claim}, {support if z is None else f'z = {text_of(z)}'}",
                    P,
                    z,
                )
    return Verdict(
        YES,
        f"no z on any of {2**context.n - 1} index sets is a counterexample, in "
        "exact arithmetic",
    )


# n up to which exact elimination, in milliseconds, precedes floating-point arithmetic.
EXACT_FIRST = 20
# n up to which exact elimination is attempted while time remains; beyond, its integers
# are too long.
EXACT_LAST = 200
# Pivots up to which the vector of a pivot is computed exactly: its fractions stay
# short.
RATIONAL = 16
# n up to which a dense factorization of a singular matrix takes hundredths of a second.
MAX_SINGULAR = 500
# A common multiple of the denominators 1 to 6, 10, 12 and 15: null vectors of matrices
# of small integers usually have such denominators.
DENOMINATOR = 60.0
# Pivots below this, relative to the largest one, are rounding errors of a singular
# matrix.
RANK_TOLERANCE = 1e-10


def positive_definite(context: Context) -> Verdict:
    """Decide whether v'Mv > 0 for every v != 0."""
    decision = _by_diagonal(context, strict=True) or context.by_rounding()
    if decision is not None:
        return decision
    if context.n > EXACT_FIRST:
        decision = _by_rounded_arithmetic(context)
        if decision.word != UNDECIDED or context.n > EXACT_LAST:
            return decision
    sets = context.definiteness
    if sets.zero is None and sets.negative is None:
        return Verdict(YES, "exact elimination of M + M' gives only positive pivots")
    return _by_index_set(context, sets.zero or sets.negative or (), strict=True)


def positive_semidefinite(context: Context) -> Verdict:
    """Decide whether v'Mv >= 0 for every v."""
    if context.yes("skew_symmetric"):
        return Verdict(YES, "v'Mv = 0 for every v, as M' = -M")
    if (rounded := context.by_rounding()) is not None:
        return rounded
    witness = context.verdicts["positive_definite"]
    decision = context.implied("positive_definite") or _by_vector(
        context, witness.vector, False, witness.indices
    )
    decision = decision or _by_diagonal(context, strict=False)
    if decision is None and context.n > EXACT_FIRST:
        decision = _by_support(context)
    if decision is None and context.n <= EXACT_LAST:
        sets = context.definiteness
        if sets.negative is None:
            return Verdict(YES, "exact elimination of M + M' gives no negative pivot")
        decision = _by_index_set(context, sets.negative, strict=False)
    unseen = "neither a v with v'Mv < 0 nor a proof that there is none is known"
    return decision or Verdict(
        UNDECIDED, witness.evidence if witness.word == UNDECIDED else unseen
    )


def _by_vector(
    context: Context, v: Vector | None, strict: bool, P: tuple[int, ...] | None = None
) -> Verdict | None:
    """Return NO if v'Mv is proved to be negative, or, if `strict`, not to be positive;
    otherwise None.
    """
    if v is None or not context.form_is_low(v, strict):
        return None
    return Verdict(NO, f"v'Mv {'<=' if strict else '<'} 0 for v = {text_of(v)}", P, v)


def _by_diagonal(context: Context, strict: bool) -> Verdict | None:
    """Return NO if the smallest diagonal entry is negative, or, if `strict`, not
    positive; otherwise None.
    """
    i = int(context.diagonal.argmin())
    if context.diagonal[i] > 0 or (context.diagonal[i] == 0 and not strict):
        return None
    evidence = f"v'Mv = {context.shown(i, i)} for v = e_{i + 1}"
    return Verdict(NO, evidence, (i,), context.vector((i,), (1,)))


def _by_rounded_arithmetic(context: Context) -> Verdict:
    """Decide by floating-point factorizations; the proof or the counterexample is
    verified.
    """
    scaling = (
        context.verdicts["h_plus"].vector if "h_plus" in context.verdicts else None
    )
    decision = _by_vector(context, np.ones(context.n), True) or _by_vector(
        context, scaling, True
    )
    if decision is not None:
        return decision
    if context.yes("symmetric", "h_plus"):
        return Verdict(YES, "it is symmetric and an H+-matrix")
    context.check()
    S = context.symmetric_part
    if not np.isfinite(abs(S).max()):
        return Verdict(UNDECIDED, "M + M' overflows")
    if (
        matrices.is_sparse(S)
        and _is_exact(context, S)
        and scaled_dominance(S, context.check).word == YES
    ):
        return Verdict(
            YES,
            "M + M' is an H+-matrix: its diagonal is positive and dominant "
            "after scaling the columns",
        )
    context.check()
    if not affordable(S):
        return Verdict(UNDECIDED, "a factorization of M + M' may be too expensive")
    proved, v = proof_of_definiteness(S)
    if proved:
        return Verdict(
            YES,
            "Cholesky's factorization of (M + M') / 2 shifted by more than its "
            "rounding error succeeds",
        )
    undecided = Verdict(
        UNDECIDED, "rounding errors prevent a proof, and no counterexample is known"
    )
    return _by_vector(context, v, True) or undecided


def _is_exact(context: Context, S: Matrix) -> bool:
    """Return whether M + M' was computed without rounding."""
    M, T = context.M, context.M.T
    return not any((lost != 0).sum() for lost in ((S - M) - T, (S - T) - M))


def _by_support(context: Context) -> Verdict | None:
    """Decide by M + M' without its zero rows, by weak diagonal dominance, or by a zero
    on the diagonal of a nonzero row; None if these do not decide.
    """
    S = context.symmetric_part
    support = np.flatnonzero(abs(S).sum(axis=1))
    if pair := _zero_diagonal_pair(context):
        (i, j), v = pair, np.zeros(context.n)
        v[i] = -np.sign(S[i, j]) * (abs(context.diagonal[j]) / abs(S[i, j]) + 1.0)
        v[j] = 1.0
        evidence = f"v'Mv < 0 for v with entries {v[i]:.6g} at {i + 1} and 1 at {j + 1}"
        return (
            Verdict(NO, evidence, (i, j), v)
            if context.form_is_low(v, strict=False)
            else None
        )
    if support.size < context.n:
        part = Context(context.M[support][:, support], context.check)
        if positive_definite(part).word == YES:
            zero_rows = f"M + M' has {context.n - support.size} zero rows"
            return Verdict(YES, f"{zero_rows}, and is positive definite without them")
    if (
        _is_exact(context, S)
        and (
            verdict.signs(matrices.comparison(S), np.ones(context.n), context.check)
            >= 0
        ).all()
    ):
        return Verdict(
            YES, "M + M' is weakly diagonally dominant with a nonnegative diagonal"
        )
    return None


def _zero_diagonal_pair(context: Context) -> tuple[int, int] | None:
    """Return i and j with M_ii = 0 and M_ij + M_ji != 0; None if there are none."""
    zero = np.flatnonzero(context.diagonal == 0)
    rows = abs(context.symmetric_part[zero])
    loose = np.flatnonzero(rows.sum(axis=1))
    return (
        (int(zero[loose[0]]), int(matrices.dense(rows[loose[:1]])[0].argmax()))
        if loose.size
        else None
    )


def _by_index_set(context: Context, indices: tuple[int, ...], strict: bool) -> Verdict:
    """Return NO by a principal minor S_PP of S = M + M' that is negative, or zero if
    `strict`. It has a vector as well if that can be verified: (x, 1) with S_PP x =
    -S_Pk without the last pivot k, computed exactly if P is small, otherwise an
    eigenvector of the smallest eigenvalue.
    """
    v, rows = None, list(indices)
    if len(indices) <= RATIONAL:
        whole = elimination.symmetrized(context.whole())
        *S, last = [[whole[i][j] for j in indices] for i in indices]
        x, free = elimination.solve(
            [row[:-1] for row in S], [-value for value in last[:-1]]
        )
        v = None if x is None or free else context.vector(indices, [*x, Fraction(1)])
    if v is None:
        with suppress(np.linalg.LinAlgError):
            eigenvector = np.linalg.eigh(
                matrices.dense(context.symmetric_part[rows][:, rows])
            )[1][:, 0]
            v = np.zeros(context.n)
            v[rows] = eigenvector
    minor = (
        f"the minor {index_set(indices)} of M + M' is "
        f"{'not positive' if strict else 'negative'}"
    )
    return _by_vector(context, v, strict, indices) or Verdict(NO, minor, indices)


# The limit on pivots of exact elimination and other steps that decide whether S is
# semidefinite: the second number plus the first divided by n^3.
DEFINITENESS_STEPS, MIN_DEFINITENESS_STEPS = 1.5e7, 20.0
# n up to which semidefiniteness is tested in floating-point arithmetic if it is not
# decided exactly: a second.
MAX_FLOAT_ROWS = 2000


class Definiteness(NamedTuple):
    """Whether a symmetric S is positive definite, and whether it is semidefinite, as
    words of `verdict`. within : if neither is decided, the relative change of the
    diagonal of S after which S is semidefinite; None if that is not known.
    """

    definite: str
    semidefinite: str
    within: float | None = None


def definiteness(S: Matrix) -> Definiteness:
    """Decide whether a symmetric S of shape (n, n) is positive definite or
    semidefinite: in floating-point arithmetic if the margin exceeds rounding errors;
    otherwise, unless its entries are rounded numbers, by all tests of classes of
    matrices, including exact arithmetic.
    """
    n, rank = S.shape[0], semidefinite_rank(S)
    if rank is not None:
        return Definiteness(YES if rank == n else NO, YES)
    if (within := semidefinite_by_rounding(S)) is not None:
        return Definiteness(UNDECIDED, UNDECIDED, within)
    if _is_clearly_indefinite(S):
        return Definiteness(NO, NO)
    steps = MIN_DEFINITENESS_STEPS + DEFINITENESS_STEPS / n**3
    verdicts = verdict.classify(S, "positive_semidefinite", steps)
    words = (
        verdicts[name].word for name in ("positive_definite", "positive_semidefinite")
    )
    definite, semidefinite = words
    if semidefinite == UNDECIDED and n <= MAX_FLOAT_ROWS:
        within = semidefinite_within(S)
    return Definiteness(definite, semidefinite, within)


@np.errstate(all="ignore")
def _is_clearly_indefinite(S: Matrix) -> bool:
    """Return whether a factorization of a symmetric S that fails yields a v with v'Sv <
    0 for all possible rounding errors of products and of the entries of S.
    """
    if not S.diagonal().min() > 0 or not affordable(S):
        return False
    v = proof_of_definiteness(S)[1]
    if v is None:
        return False
    terms = float(np.abs(v) @ matrices.absolute_product(S, np.abs(v)))
    return float(v @ matrices.product(S, v)) < -4 * (v.size + 4) * EPS * terms


@np.errstate(all="ignore")
def semidefinite_rank(S: Matrix) -> int | None:
    """Return the rank of a symmetric S of shape (n, n) if floating-point arithmetic
    proves that S is positive semidefinite, otherwise None.

    The rows and columns of zeros are left out first. The rank is the number of the
    others if a factorization proves that they are those of a definite matrix. A
    singular S is semidefinite if some S_PP is definite and the columns outside P are
    combinations of those in P. This is proved by combinations that are rounded to
    multiples of 1 / DENOMINATOR and checked exactly, or by the rank.
    """
    nonzero = np.flatnonzero(matrices.row_maxima(S))
    S = S[nonzero][:, nonzero]
    if not nonzero.size or S.diagonal().min() <= 0 or not affordable(S):
        return None
    if (is_definite := proof_of_definiteness(S)[0]) or nonzero.size > MAX_SINGULAR:
        return nonzero.size if is_definite else None
    A = matrices.dense(S)
    whole, _ = numbers.as_written(A)
    if not np.array_equal(whole, np.rint(whole)):
        return None  # columns of rounded numbers are no exact combinations
    with imports:
        from scipy.linalg import get_lapack_funcs, solve_triangular
    (pstrf,) = get_lapack_funcs(("pstrf",), (A,))
    D = np.exp2(-half_power(A.diagonal()))
    R, order, rank, is_singular = pstrf(matrices.scaled(A, D, D), tol=RANK_TOLERANCE)
    if not is_singular:
        return None
    first, others = order[:rank] - 1, order[rank:] - 1
    if not proof_of_definiteness(A[first][:, first])[0]:
        return None
    combined = solve_triangular(R[:rank, :rank], R[:rank, rank:])
    guess = np.rint(DENOMINATOR * D[first, np.newaxis] * combined / D[others])
    null_space = np.vstack((guess, -DENOMINATOR * np.eye(others.size)))
    whole = whole[:, order - 1]
    largest = float((np.abs(whole) @ np.abs(null_space)).max())
    if verdict.sums_exactly(whole, largest) and not (whole @ null_space).any():
        return int(rank)
    return int(rank) if has_rank(whole, first, np.arange(rank)) else None


# n up to which all 2^n - 1 index sets are examined, each by a linear system in exact
# arithmetic.
ALL_SETS = 9


def copositive(context: Context) -> Verdict:
    """Decide whether v'Mv >= 0 for every v >= 0."""
    if (decision := context.implied("positive_semidefinite")) is not None:
        return decision
    if context.symmetric_part.min() >= 0:
        return Verdict(YES, "no entry of M + M' is negative")
    S, n = context.symmetric_part, context.n
    # The vector of ones, and sums of one or two coordinate vectors.
    vectors = [np.ones(n), np.zeros(n), np.zeros(n)]
    vectors[1][int(context.diagonal.argmin())] = vectors[2][
        list(np.unravel_index(int(S.argmin()), S.shape))
    ] = 1.0
    for v in vectors:
        if context.form_is_low(v, strict=False):
            return Verdict(NO, f"v'Mv < 0 for v = {text_of(v)} >= 0", vector=v)
    decision = _without_nonnegative_rows(context)
    if decision is not None or context.n > ALL_SETS:
        return decision or _undecided(context)
    for P, S_PP in verdict.blocks(
        elimination.symmetrized(context.whole()), context.check
    ):
        u, free = elimination.solve(S_PP, [-1] * len(P))
        if u is not None and not free and min(u) >= 0:  # then u'Su < 0
            return _excluded(context, P, u, "v'Mv < 0")
    return Verdict(
        YES,
        f"none of {2**context.n - 1} index sets supports a v >= 0 with v'Mv < "
        "0, in exact arithmetic",
    )


def strictly_copositive(context: Context) -> Verdict:
    """Decide whether v'Mv > 0 for every v >= 0, v != 0."""
    decision = (
        context.implied("positive_definite")
        or context.low_diagonal()
        or context.excluded("copositive")
    )
    if decision is not None:
        return decision
    if context.symmetric_part.min() >= 0:
        return Verdict(
            YES, "no entry of M + M' is negative, and its diagonal is positive"
        )
    return _by_zeros(context, plus=False)


def copositive_plus(context: Context) -> Verdict:
    """Decide whether M is copositive, and (M + M')v = 0 for every v >= 0 with v'Mv =
    0."""
    decision = context.implied(
        "positive_semidefinite", "strictly_copositive"
    ) or context.excluded("copositive")
    if decision is None and (pair := _zero_diagonal_pair(context)):
        i, j = pair
        evidence = f"{entry(i, i)} = 0, but {entry(i, j)} + {entry(j, i)} is not"
        return Verdict(NO, evidence, pair, context.vector((i,), (1,)))
    return decision or _by_zeros(context, plus=True)


def _without_nonnegative_rows(context: Context) -> Verdict | None:
    """Return YES if M + M' is positive semidefinite without its rows that have no
    negative entry, such as those of the slacks of friction cones; UNDECIDED if that
    depends on rounding and there are too many index sets; otherwise None.
    """
    rows = nonnegative_rows(context.symmetric_part)
    rest = outside(rows, context.n)
    if not rows.size or not rest.size:
        return None
    part = Context(context.M[rest][:, rest], context.check)
    # Opposite directions of friction have opposite rows.
    first = np.flatnonzero(merged(part.M).first == np.arange(rest.size))
    if first.size < rest.size:
        part = Context(part.M[first][:, first], context.check)
    part.verdicts["positive_definite"] = positive_definite(part)
    rest_verdict = positive_semidefinite(part)
    are_nonnegative = f"M + M' has no negative entry in {_named(context, rows)}"
    if rest_verdict.word == YES:
        evidence = f"{are_nonnegative}, and is positive semidefinite without them"
        return Verdict(YES, evidence)
    if (
        rest_verdict.word == UNDECIDED
        and part.rounding is not None
        and context.n > ALL_SETS
    ):
        evidence = f"{are_nonnegative}; without them {rest_verdict.evidence}"
        return Verdict(UNDECIDED, evidence)
    return None


def _named(context: Context, rows: Indices) -> str:
    """Return a phrase for some rows."""
    is_one = rows.size == 1
    if np.array_equal(rows, np.flatnonzero(context.diagonal == 0)):
        number = "the row" if is_one else f"the {rows.size} rows"
        return f"{number} where its diagonal is 0"
    return f"row {rows[0] + 1}" if is_one else f"{rows.size} of its rows"


def nonnegative_rows(S: Matrix) -> Indices:
    """Return the indices of the rows of a symmetric matrix without a negative entry.
    The matrix is copositive if it is so without these rows and columns.
    """
    return np.flatnonzero(np.asarray((S < 0).sum(axis=1)).ravel() == 0)


def outside(indices: Indices, n: int) -> Indices:
    """Return the indices from 0 to n - 1 that are not among these."""
    others = np.ones(n, dtype=np.bool_)
    others[indices] = False
    return np.flatnonzero(others)


class Merged(NamedTuple):
    """Which rows of M are equal or opposite, together with its columns: v'Mv is a
    function of the sums of sign_i v_i over all i with the same first_i, the first of
    these indices.
    """

    first: Indices
    sign: Vector


def merged(M: Matrix) -> Merged:
    """Return which rows of M, with their columns, are equal or opposite."""
    first_with: dict[tuple[bytes, ...], int] = {}
    first, sign = np.arange(M.shape[0]), np.ones(M.shape[0])
    both = matrices.compressed(M), matrices.compressed(M.T)
    for i in range(M.shape[0]):
        key: list[bytes] = []
        for A in both:
            row_entries = slice(A.indptr[i], A.indptr[i + 1])
            order = np.argsort(A.indices[row_entries])
            data, indices = A.data[row_entries][order], A.indices[row_entries][order]
            if not key and data.size and data[0] < 0:
                sign[i] = -1.0
            key += [indices.tobytes(), (sign[i] * data).tobytes()]
        first[i] = first_with.setdefault(tuple(key), i)
    return Merged(first, sign)


def ends_at_solution(M: Matrix, q: Vector, check: verdict.Check) -> bool:
    """Return whether q'v >= 0 for all v >= 0 with v'Mv = 0 is proved for a copositive
    M: Lemke's method then yields a solution (R. W. Cottle, J.-S. Pang, R. E. Stone,
    The Linear Complementarity Problem (1992), section 4.4). This holds for contact with
    friction if no contact is redundant.

    It is so if M + M' without its nonnegative rows is positive definite as a function
    of the sums of `Merged`: v'Mv = 0 then implies that v consists of opposite pairs and
    components of the nonnegative rows.
    """
    S = matrices.symmetric_part(M)
    rows = nonnegative_rows(S)
    rest = outside(rows, M.shape[0])
    if q[rows].min(initial=0.0) < 0 or not rest.size:
        return not rest.size and q.min(initial=0.0) >= 0
    part = M[rest][:, rest]
    first, sign = merged(part)
    representatives = np.flatnonzero(first == np.arange(rest.size))
    for i in representatives.tolist():
        sides = (q[rest][(first == i) & (sign == side)] for side in (1.0, -1.0))
        if sum(side.min(initial=np.inf) for side in sides) < 0:
            return False
    return (
        positive_definite(
            Context(part[representatives][:, representatives], check)
        ).word
        == YES
    )


def _undecided(context: Context, what: str = "index sets") -> Verdict:
    """Return UNDECIDED, as there are too many index sets or minors."""
    unseen = "no sufficient condition or counterexample is known"
    return Verdict(UNDECIDED, f"2^{context.n} - 1 {what} are too many; {unseen}")


def _excluded(
    context: Context, P: tuple[int, ...], u: list[Fraction], claim: str
) -> Verdict:
    """Return NO by the v with v_P = u, with the vector if double precision represents a
    multiple of it exactly.
    """
    v = context.vector(P, u)
    if v is None:
        return Verdict(
            NO,
            f"{claim} for some v >= 0 with support {index_set(P)}, in exact arithmetic",
            P,
        )
    return Verdict(NO, f"{claim} for v = {text_of(v)} >= 0", P, v)


def _by_zeros(context: Context, plus: bool) -> Verdict:
    """Decide whether a copositive M is strictly copositive, or copositive-plus, by the
    zeros v >= 0 of minimal support of v'Mv: for these some v_P > 0 spans the null space
    of S_PP.
    """
    if context.n > ALL_SETS or not context.yes("copositive"):
        return (
            _undecided(context)
            if context.n > ALL_SETS
            else Verdict(UNDECIDED, "copositivity is not decided")
        )
    whole = elimination.symmetrized(context.whole())
    for P, S in verdict.blocks(whole, context.check):
        _, free = elimination.solve(S, [0] * len(P))
        u = free[0] if len(free) == 1 else [Fraction(0)]
        u = [-value for value in u] if sum(u) < 0 else u
        if min(u) > 0 and not plus:
            return _excluded(context, P, u, "v'Mv = 0")
        if min(u) > 0 and any(
            sum(row[i] * value for i, value in zip(P, u, strict=True)) for row in whole
        ):
            return _excluded(context, P, u, "v'Mv = 0 but (M + M')v is not")
    zero = (
        "(M + M')v = 0 whenever v'Mv = 0 and v >= 0"
        if plus
        else "v'Mv = 0 for v >= 0 only if v = 0"
    )
    return Verdict(YES, f"it is copositive, and {zero}, in exact arithmetic")
