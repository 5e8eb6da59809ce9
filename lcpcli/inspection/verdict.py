"""Verdicts on classes of matrices, with their evidence; the table of all classes, and
the classes that the entries decide directly.

The entries of M are taken as exact numbers; if all have up to 14 digits, as their
shortest decimals. No "yes" or "no" depends on rounding: a result in double precision is
either guaranteed by an error bound or confirmed in exact arithmetic, otherwise the
class is "not decided". Entries with more digits are considered rounded numbers, such as
those of a covariance matrix: whether M is definite is not decided if that depends on
their rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from itertools import combinations, count

import numpy as np

from lcpcli import interrupts
from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.rational import elimination, numbers
from lcpcli.typing import Matrix, Vector

YES = "yes"
NO = "no"
UNDECIDED = "not decided"
MAX_ENTRIES = 6  # the most entries of a vector or index set in a sentence
# Nonzeros of v up to which the sign of v'Mv is determined exactly: 250000 products of
# integers.
EXACT_SUPPORT = 500

TITLES = {
    "h_plus": "H+-matrix",
    "skew_symmetric": "skew-symmetric",
    "copositive_plus": "copositive-plus",
}


def title(name: str) -> str:
    """Return the name of a class in words: "P-matrix" for p_matrix."""
    letter, is_matrix, _ = name.partition("_matrix")
    return TITLES.get(name) or (
        f"{letter.upper()}-matrix" if is_matrix else name.replace("_", " ")
    )


def called(name: str) -> str:
    """Return the words that follow "it is" for a matrix of a class."""
    words = title(name)
    if not words.endswith("-matrix"):
        return words
    return f"{'an' if words[0] in 'HM' else 'a'} {words}"


# A function that raises TimeIsUp at a limit, as `interrupts.raise_if_timed_out` does.
Check = Callable[[], None]


@dataclass(frozen=True, eq=False)
class Verdict:
    """The verdict on whether a matrix belongs to a class, with its entries as exact
    numbers.

    word : YES, NO or UNDECIDED.
    evidence : the evidence, or why the question is not decided, as a clause that counts
        rows and columns from 1.
    indices : the index set in the evidence, counted from 0; None if there is none.
    vector : the vector, shape (n,), for which the evidence holds exactly; None if there
        is none.
    """

    word: str
    evidence: str
    indices: tuple[int, ...] | None = None
    vector: Vector | None = None


def text_of(numbers: Sequence[float] | Vector) -> str:
    """Return a vector or index set for a sentence: complete if it is short, otherwise
    its first entries.
    """
    texts = [f"{number:.6g}" for number in numbers[:MAX_ENTRIES]]
    if len(numbers) > MAX_ENTRIES:
        texts.append("...")
    return f"({', '.join(texts)})"


def index_set(indices: Sequence[int]) -> str:
    """Return an index set for a sentence, counted from 1."""
    return "{" + text_of([i + 1 for i in indices])[1:-1] + "}"


def entry(i: int, j: int) -> str:
    """Return the name of an entry of M for a sentence, counted from 1."""
    return f"M({i + 1}, {j + 1})"


def index_sets(n: int) -> Iterator[tuple[int, ...]]:
    """Yield all nonempty subsets of n indices, in order of increasing size."""
    return (
        subset for size in range(1, n + 1) for subset in combinations(range(n), size)
    )


def blocks(
    A: elimination.Rows, check: Check
) -> Iterator[tuple[tuple[int, ...], elimination.Rows]]:
    """Yield every index set P with the principal submatrix A_PP, in order of increasing
    size.
    """
    for P in index_sets(len(A)):
        check()
        yield P, [[A[i][j] for j in P] for i in P]


class Context:
    """The matrix to classify, dense or sparse of shape (n, n), with the verdicts so far
    and a check of the limits.

    M : a multiple of the matrix, in which decimals are integers. unit : the factor.
    """

    def __init__(self, M: Matrix, check: Check) -> None:
        self.n, self.check = int(M.shape[0]), check
        self.M, self.unit = M, 1.0
        if matrices.is_sparse(M):
            data, self.unit = numbers.as_written(M.data)
            if self.unit > 1:
                self.M = M.copy()
                self.M.data = data
        else:
            self.M, self.unit = numbers.as_written(M)
        self.verdicts: dict[str, Verdict] = {}

    def shown(self, i: int, j: int) -> str:
        """Return an entry, with its name, for a sentence."""
        return f"{entry(i, j)} = {self.M[i, j] / self.unit:.6g}"

    def yes(self, *names: str) -> bool:
        """Return whether M is known to belong to all of these classes."""
        return all(
            name in self.verdicts and self.verdicts[name].word == YES for name in names
        )

    def implied(self, *names: str) -> Verdict | None:
        """Return YES by the first of these subclasses to which M is known to belong;
        otherwise None.
        """
        return next(
            (Verdict(YES, f"it is {called(name)}") for name in names if self.yes(name)),
            None,
        )

    def excluded(self, name: str, because: str = "it is not") -> Verdict | None:
        """Return NO, with its evidence, by a superclass to which M is known not to
        belong; otherwise None.
        """
        witness = self.verdicts[name]
        no = Verdict(NO, f"{because} {called(name)}", witness.indices, witness.vector)
        return no if witness.word == NO else None

    def low_diagonal(self, strict: bool = True) -> Verdict | None:
        """Return NO by the first diagonal entry that is negative, or, if `strict`, not
        positive; otherwise None.
        """
        low = np.flatnonzero(self.diagonal <= 0 if strict else self.diagonal < 0)
        if not low.size:
            return None
        i, size = int(low[0]), "not positive" if strict else "negative"
        return Verdict(NO, f"{self.shown(i, i)} is {size}", (i,))

    @cached_property
    def diagonal(self) -> Vector:
        """Return the diagonal of M."""
        return np.asarray(self.M.diagonal(), dtype=np.float64)

    @cached_property
    def symmetric_part(self) -> Matrix:
        """Return M + M', rounded once per entry; exact if M is symmetric. It is
        positive definite if and only if v'Mv > 0 for all v != 0.
        """
        total = self.M + self.M.T
        return total.tocsr() if matrices.is_sparse(self.M) else total

    @cached_property
    def rounding(self) -> float | None:
        """Return the relative change of the diagonal of M after which M is positive
        semidefinite, if the rounding of its entries decides whether it is definite,
        semidefinite or neither; otherwise None.
        """
        with imports:
            from lcpcli.verify.error_theorems import semidefinite_by_rounding
        return semidefinite_by_rounding(self.M)

    def by_rounding(self) -> Verdict | None:
        """Return UNDECIDED if the rounding of entries decides whether M is definite,
        otherwise None.
        """
        if self.rounding is None:
            return None
        change = numbers.approximate(Fraction(self.rounding), 1, 1)
        evidence = (
            "its entries are rounded: with changes of its diagonal by at most "
            f"{change}, relatively, it is positive semidefinite"
        )
        return Verdict(UNDECIDED, evidence)

    def whole(self) -> elimination.Rows:
        """Return a positive multiple of a small M in integers."""
        return numbers.integers(matrices.dense(self.M))

    @cached_property
    def definiteness(self) -> elimination.Definiteness:
        """Return the result of exact elimination of M + M', for a small M. May raise
        TimeIsUp."""
        return elimination.definiteness(
            elimination.symmetrized(self.whole()), self.check
        )

    def vector(self, P: Sequence[int], u: Sequence[Fraction | int]) -> Vector | None:
        """Return a positive integer multiple of the v with v_P = u and 0 elsewhere;
        None if floats do not represent it exactly.
        """
        whole = numbers.whole_multiple([Fraction(value) for value in u])
        if max(map(abs, whole)) > numbers.LARGEST_INTEGER:
            return None
        v = np.zeros(self.n)
        v[list(P)] = whole
        return v

    def form_is_low(self, v: Vector, strict: bool) -> bool:
        """Return whether v'Mv is proved to be negative, or, if `strict`, not positive;
        False if v is 0 or not finite.
        """
        if not np.isfinite(v).all() or not v.any():
            return False
        value = float(v @ matrices.product(self.M, v))
        size = float(np.abs(v) @ matrices.absolute_product(self.M, np.abs(v)))
        underflow = (
            (self.n * self.n + 1) * SMALLEST_NORMAL * max(1.0, float(np.abs(v).max()))
        )
        if abs(value) > (2 * self.n + 4) * EPS * size + underflow:
            return value < 0
        support = np.flatnonzero(v)
        if support.size > EXACT_SUPPORT:
            return False
        x, _ = numbers.in_integers(v[support])
        rows = numbers.integers(matrices.dense(self.M[support][:, support]))
        total = numbers.dot(x, [numbers.dot(row, x) for row in rows])
        return total < 0 or (strict and total == 0)


def signs(A: Matrix, d: Vector, check: Check) -> Vector:
    """Return the sign of every component of A d, -1, 0 or 1, exactly, for finite A of
    shape (n, n) and d of shape (n,): in floating-point arithmetic if rounding errors
    cannot change it, otherwise, after a call of `check` for each row, in exact
    arithmetic.
    """
    n = d.size
    value, size = matrices.product(A, d), matrices.absolute_product(A, np.abs(d))
    bound = (n + 2) * EPS * size + n * SMALLEST_NORMAL
    sign: Vector = np.sign(value)
    if np.array_equal(d, np.ones(n)) and sums_exactly(A, float(size.max(initial=0.0))):
        return sign
    for i in np.flatnonzero(~(np.abs(value) > bound)):
        check()
        part = (
            slice(A.indptr[i], A.indptr[i + 1])
            if matrices.is_sparse(A)
            else slice(None)
        )
        row, vector_part = (
            (A.data[part], d[A.indices[part]]) if matrices.is_sparse(A) else (A[i], d)
        )
        total = numbers.dot(
            numbers.in_integers(row)[0], numbers.in_integers(vector_part)[0]
        )
        sign[i] = (total > 0) - (total < 0)
    return sign


def sums_exactly(A: Matrix, largest: float) -> bool:
    """Return whether sums of entries up to `largest` are free of rounding errors, as
    all are multiples of a common power of two.
    """
    if not 0 < largest < np.inf:
        return False
    entries = A.data if matrices.is_sparse(A) else A
    units = np.ldexp(entries, 51 - int(np.frexp(largest)[1]))
    are_whole = np.isfinite(units).all() and np.array_equal(units, np.rint(units))
    return bool(are_whole and not ((units == 0) & (entries != 0)).any())


def symmetric(context: Context) -> Verdict:
    """Decide whether M' = M."""
    return _nonzero_entry(context, context.M - context.M.T) or Verdict(
        YES, "M' = M, entrywise"
    )


def skew_symmetric(context: Context) -> Verdict:
    """Decide whether M' = -M."""
    return _nonzero_entry(context, context.symmetric_part) or Verdict(
        YES, "M' = -M, entrywise"
    )


def _nonzero_entry(context: Context, difference: Matrix) -> Verdict | None:
    """Return NO with the first pair of entries of M whose difference is not 0; None if
    there is none.
    """
    if (position := _first(difference)) is None:
        return None
    i, j = position
    shown, other = context.shown(i, j), context.shown(j, i)
    return (
        Verdict(NO, f"{shown} is not 0", (i,))
        if i == j
        else Verdict(NO, f"{shown}, {other}", position)
    )


def z_matrix(context: Context) -> Verdict:
    """Decide whether no entry off the diagonal is positive."""
    if (position := _first(matrices.comparison(context.M) < context.M)) is None:
        return Verdict(YES, "no entry off the diagonal is positive")
    return Verdict(NO, f"{context.shown(*position)} is positive", position)


def _first(A: Matrix) -> tuple[int, int] | None:
    """Return row and column of the first nonzero entry; None if there is none."""
    if matrices.is_sparse(A):
        rows, columns = A.nonzero()
        return (int(rows[0]), int(columns[0])) if rows.size else None
    i, j = divmod(int((A != 0).argmax()), A.shape[1])
    return (i, j) if A[i, j] else None


def strictly_diagonally_dominant(context: Context) -> Verdict:
    """Decide whether |M_ii| > sum of |M_ij|, j != i, for every row i."""
    if (i := weak_row(context.M, context.check)) is None:
        return Verdict(YES, "in every row |M_ii| exceeds the sum of the other |M_ij|")
    return Verdict(
        NO, f"row {i + 1}: |M_ii| does not exceed the sum of the other |M_ij|", (i,)
    )


def weak_row(M: Matrix, check: Check) -> int | None:
    """Return the first row that is not strictly diagonally dominant, or None. `check`
    may raise TimeIsUp.
    """
    weak = np.flatnonzero(
        signs(matrices.comparison(M), np.ones(M.shape[0]), check) <= 0
    )
    return int(weak[0]) if weak.size else None


LARGER = """h_plus m_matrix positive_definite positive_semidefinite p_matrix p0_matrix
column_sufficient row_sufficient copositive strictly_copositive copositive_plus"""
# The module of each class, in which a function of that name decides it; it may use the
# verdicts on the classes before it.
CLASSES = {
    **dict.fromkeys(
        ("symmetric", "skew_symmetric", "z_matrix", "strictly_diagonally_dominant"),
        "verdict",
    ),
    **dict.fromkeys(LARGER.split(), "classes"),
}


@np.errstate(all="ignore")
def classify(M: Matrix, last: str = "", steps: float = math.inf) -> dict[str, Verdict]:
    """Return for each of CLASSES, or up to the class `last`, whether M belongs to it.

    M is dense or sparse of shape (n, n) with finite entries. At the time limit,
    expensive tests stop and no further ones are started, but implications are still
    reported.

    steps : the limit on steps of exact elimination and of searches, at which they stop
        too.
    """
    if not M.shape[0]:
        return dict.fromkeys(CLASSES, Verdict(YES, "M has no entries"))
    counter = count()

    def check() -> None:
        if next(counter) >= steps:
            raise TimeIsUp
        interrupts.raise_if_timed_out()

    context = Context(M, check)
    for name, file in CLASSES.items():
        with imports:
            decide = getattr(import_module(f"lcpcli.inspection.{file}"), name)
        try:
            context.verdicts[name] = decide(context)
        except TimeIsUp:
            why = (
                "the time was used up"
                if steps == math.inf
                else "it takes too many steps"
            )
            context.verdicts[name] = Verdict(UNDECIDED, why)
        if name == last:
            break
    return context.verdicts
