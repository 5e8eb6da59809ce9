"""Proofs that no z within its bounds has w = A z + b with the required signs.

J. Farkas, Theorie der einfachen Ungleichungen, Journal für die reine und angewandte
Mathematik 124 (1902) 1-27: either some z >= 0 has A z + b >= 0, or there is y >= 0 with
A'y <= 0 and b'y < 0, and never both, as 0 <= y'(A z + b) = (A'y)'z + b'y.

With bounds l <= z <= u, let y_i >= 0 if w_i >= 0 is required (in a problem, if only l_i
is finite), y_i <= 0 if w_i <= 0 is required (if only u_i is finite), y_i of any sign if
w_i = 0 is required (if neither is finite), and y_i = 0 if w_i may have either sign.
Then 0 <= y'(A z + b) <= b'y + sum_j sup {(A'y)_j t : l_j <= t <= u_j} for any such z:
if the right-hand side is negative, there is none.

A proof computed in floating-point arithmetic is accepted only after a check without
rounding (D. Applegate, W. Cook, S. Dash and D. Espinoza, Exact solutions to linear
programming problems, Operations Research Letters 35 (2007) 693-699).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from fractions import Fraction
from itertools import chain, islice, product
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, remaining
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.box import BASIC, ORTHANT, UPPER, WORDS, Box
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination, numbers
from lcpcli.rational.dictionary import Dictionary
from lcpcli.rational.exact_problem import ExactProblem, fractions_of
from lcpcli.rational.numbers import rounded
from lcpcli.rational.tree import Unknowns
from lcpcli.rational.written import are_decimals, are_same, as_written, in_integers
from lcpcli.typing import Indices, Mask, Matrix, Vector

# A column with |A'y| below this times |A|'|y| is treated as one with A'y = 0.
ACTIVE_COLUMN = 1e-8
SNAP = 1e-9  # entries of y below this times the largest one are treated as 0
# The largest relative distance of each entry of y from the exact proof of which it is
# an approximation.
PROOF_RTOL = 1e-6
# The smallest ratio of the terms of a row to their sum for which the sum is considered
# an effect of rounding: at most six digits of it are correct.
MIN_CANCELLATION = 1e10
# Unknowns of the largest linear system that is solved exactly: about a second at worst.
LARGEST_EXACT = 48
LARGEST_BY_FLINT = 400  # the same with FLINT
# Limit on the number of entries times the bits of the largest: one or two seconds.
MAX_BITS = 10_000_000
# Estimated seconds of a system, up to which a correction, which may take two systems of
# longer numbers, takes less than a second.
MAX_SECONDS = 0.1


def sides(box: Box, n: int) -> tuple[Vector, Vector, Mask, Mask]:
    """Return the n lower and upper bounds of a box, and which of them are finite."""
    lower, upper = box.vectors(n)
    return lower, upper, np.isfinite(lower), np.isfinite(upper)


@np.errstate(all="ignore")
def refutes(
    A: Matrix, b: Vector, y: Vector, box: Box = ORTHANT, rows: Box | None = None
) -> bool:
    """Return whether y proves that no such z exists, for finite A of shape (m, n), b
    and y (m,).

    box : the bounds of z.
    rows : the bounds that determine the required signs of w, by default the same: A is
        then square, or all bounds are 0 and infinity.

    The result is True only for a proof that holds without rounding, so never for a
    system that has a solution; False proves nothing. The conditions are:

    - y has the signs of multipliers, and its exact total, b'y with the suprema, is
      negative;
    - the exact (A'y)_j is not positive if u_j is infinite, and not negative if l_j is.
      Floating-point arithmetic shows this if the computed value is farther from 0 than
      a bound on its rounding error; the other columns are summed in integers. A margin
      would not be enough: with A'y = delta > 0 there may be a solution of size |b'y| /
      delta.
    - If only the last test fails, because y is rounded, y is corrected in rational
      arithmetic: an exact solution of A'y = 0 in those columns, on the support of y,
      has to pass all tests; or, if there is none because rounding of A has made the
      columns independent, one with A'y < 0 close to y. y is then that proof rounded.
      This is done for at most LARGEST_EXACT columns and entries, or LARGEST_BY_FLINT.
    """
    return scope(A, b, y, box, rows) is not Scope.NOTHING


class Scope(Enum):
    """The data for which a vector is a proof: none; these doubles; or these, and all
    others that round to them."""

    NOTHING = "nothing"
    DOUBLES = "doubles"
    ALL_ROUNDED = "all data that round to these doubles"


@np.errstate(all="ignore")
def scope(
    A: Matrix, b: Vector, y: Vector, box: Box = ORTHANT, rows: Box | None = None
) -> Scope:
    """Return for which data y proves that no such z exists, as `refutes` does."""
    of = Multiplied(A, b, y, box, rows)
    if not of.may_be_proof():
        return Scope.NOTHING
    if of.is_certain_for_all():
        return Scope.ALL_ROUNDED
    return Scope.DOUBLES if _refutes_doubles(of) else Scope.NOTHING


def _refutes_doubles(of: Multiplied) -> bool:
    """Return whether y, or a vector close to it, is a proof for the doubles in exact
    arithmetic."""
    if (of.excess <= of.error).all() and of.holds(fractions_of(of.y), of.is_certain):
        return True
    part = matrices.dense(of.rows[:, np.flatnonzero(of.is_active)])
    if (
        not part.size
        or max(part.shape) > max_exact_unknowns()
        or not np.isfinite(part).all()
    ):
        return False
    if remaining() <= 0:
        raise TimeIsUp
    corrected_y = corrected(numbers.row_integers(part.T)[0], fractions_of(of.y))
    return (
        corrected_y is not None
        and of.are_signs(np.array(corrected_y))
        and of.holds(corrected_y)
    )


@np.errstate(all="ignore")
def cancellation(A: Matrix, b: Vector, y: Vector, box: Box = ORTHANT) -> float:
    """Return by how much the terms of A z exceed their sum, in at least one row and for
    every z as above, if A'y violates sign conditions, which may be due to the rounding
    of A alone; 0 if y does not show this, or the ratio is below MIN_CANCELLATION.

    In that case 0 <= b'y + sum_j (A'y)_j z_j, where each (A'y)_j is a rounding error of
    its terms: data that have been rounded to double precision do not determine whether
    there is such a z.
    """
    of = Multiplied(A, b, y, box)
    wrong = of.excess > -of.error
    is_rounding = (of.excess <= of.y.size * EPS * of.size).all() and (
        of.size[wrong] > SMALLEST_NORMAL / EPS
    ).all()
    total = (
        -of.largest_total(of.everywhere, 0.0, of.error, SNAP)
        if of.has_signs and is_rounding
        else 0.0
    )
    if not total > 0:
        return 0.0
    # y'(A z) is at least `total`, and exceeds it by at most the terms of b'y, as A z +
    # b has the required signs.
    among = total / (total + 2 * of.terms)
    times = float(
        among * 0.5 / ((of.excess + of.error)[wrong] / of.size[wrong]).max(initial=EPS)
    )
    return times if times >= MIN_CANCELLATION else 0.0


class Multiplied:
    """A'y in floating-point arithmetic, with bounds on its rounding errors, on the
    support of a y that may be a proof, as for `refutes`.

    has_signs : whether y is finite, not 0, and has the signs of multipliers. excess :
        by how much (A'y)_j exceeds 0 on a side where z_j has no bound, -inf if it has
        both bounds. is_active : the columns in which A'y violates its sign condition,
        or is so small that it may be 0, if z_j has no bound there, or one so far away
        that rounding of A'y decides. total, terms : b'y plus the suprema, without those
        in which rounding decides, and the sum of the |terms|.
    """

    @np.errstate(all="ignore")
    def __init__(
        self, A: Matrix, b: Vector, y: Vector, box: Box, rows: Box | None = None
    ) -> None:
        self.support = np.flatnonzero(y)
        self.y, self.b = y[self.support], b[self.support]
        self.rows = A if self.support.size == y.size else A[self.support]
        row_box = box if rows is None else rows
        *_, self._low, self._high = sides(row_box.part(self.support), self.y.size)
        self.has_signs = bool(
            self.support.size and np.isfinite(self.y).all() and self.are_signs(self.y)
        )
        self._bounds = sides(box, A.shape[1])
        lower, upper, low, high = self._bounds
        absolute = abs(self.rows)
        image = self.rows.T @ self.y
        self.size = absolute.T @ np.abs(self.y)
        # In the other columns A'y is exactly 0.
        self.used = np.asarray(absolute.sum(axis=0)).ravel() > 0
        self.error = (
            4 * (self.y.size + 2) * (EPS * self.size + SMALLEST_NORMAL) * self.used
        )
        self.excess = np.maximum(
            np.where(high, -np.inf, image), np.where(low, -np.inf, -image)
        )
        # The bound at which (A'y)_j z_j is largest.
        largest_at = np.where(image > 0, upper, lower)
        self.supremum = np.where(np.isfinite(largest_at), largest_at, 0.0) * image
        self.bound_sizes = np.maximum(
            np.where(low, np.abs(lower), 0.0), np.where(high, np.abs(upper), 0.0)
        )
        self.everywhere = np.ones(image.size, dtype=bool)
        # Columns in which A'y may be 0, but its rounding error times a distant bound
        # may decide the sign of the total.
        is_hidden = self.used & (np.abs(image) <= self.error)
        certain_total = self.b @ self.y + self.supremum[~is_hidden].sum()
        is_hidden &= self.bound_sizes * self.error >= abs(certain_total) / (
            8 * image.size
        )
        self.supremum[is_hidden] = 0.0
        self.total = float(self.b @ self.y + self.supremum.sum())
        self.terms = float(
            np.abs(self.b) @ np.abs(self.y) + np.abs(self.supremum).sum()
        )
        self.is_certain = (
            (np.abs(image) > self.error)
            & (self.excess < 0)
            & ((largest_at == 0) | ~np.isfinite(largest_at))
        )
        self.is_active = is_hidden | self.used & (
            self.excess >= -self.error - ACTIVE_COLUMN * self.size
        )

    @property
    def active_columns(self) -> list[int]:
        """Return the columns in which A'y may be 0."""
        is_almost_zero = self.is_active & (self.excess <= ACTIVE_COLUMN * self.size)
        columns: list[int] = is_almost_zero.nonzero()[0].tolist()
        return columns

    def are_signs(self, y: Any) -> bool:
        """Return whether numbers on the support have the signs of multipliers."""
        return not ((self._low & (y < 0)).any() or (self._high & (y > 0)).any())

    def largest_total(
        self, counted: Mask, change: Vector | float, error: Vector, margin: float = 0.0
    ) -> float:
        """Return an upper bound on the total over these columns, for changes of y up to
        `change` and errors of A'y up to `error`, with a relative margin.
        """
        supremum = self.supremum[counted]
        rounding = 4 * (self.y.size + self.bound_sizes.size + 2)
        terms = np.abs(self.b) @ np.abs(self.y) + np.abs(supremum).sum()
        rest = 2 * (
            (np.abs(self.b) * change).sum() + self.bound_sizes[counted] @ error[counted]
        )
        return float(
            self.b @ self.y
            + supremum.sum()
            + rest
            + (rounding * EPS + margin) * terms
            + SMALLEST_NORMAL
        )

    @np.errstate(all="ignore")
    def may_be_proof(self) -> bool:
        """Return whether floating-point arithmetic leaves open that a vector close to y
        is a proof; NaN, where products overflow, leaves it open."""
        is_beyond = self.excess > self.error + ACTIVE_COLUMN * self.size
        is_positive = self.total > SNAP * self.terms
        return self.has_signs and not (is_beyond.any() or is_positive)

    def is_certain_for_all(self) -> bool:
        """Return whether floating-point arithmetic proves that every problem whose data
        are these, or round to these, has y or a vector close to it as a proof.

        The bounds on rounding errors of sums of k terms, 4 (k + 2) EPS of the terms,
        are at least seven times these errors, which are at most k EPS / 2. What is left
        exceeds the effect of data that differ by at most EPS / 2, relatively.
        """
        return self.is_clear() or self.has_proof_nearby()

    @np.errstate(all="ignore")
    def is_clear(self) -> bool:
        """Return whether floating-point arithmetic proves that y is a proof exactly as
        it is, with a margin larger than all rounding errors.
        """
        if (
            not self.has_signs
            or not ((self.excess + self.error < 0) | ~self.used).all()
        ):
            return False
        return self.largest_total(self.everywhere, 0.0, self.error) < 0

    @np.errstate(all="ignore")
    def has_proof_nearby(self) -> bool:
        """Return whether floating-point arithmetic proves that a y' close to y is a
        proof: A'y' = 0 exactly in the columns where A'y is almost 0 or violates its
        sign condition, by an `enclosure`, and the other conditions hold with a margin
        larger than all rounding errors.
        """
        with imports:
            from lcpcli.verify.enclosure import enclosure, is_enclosable
        is_open = self.is_active
        if not is_enclosable(int(is_open.sum()), self.y.size):
            return False
        if (
            change := enclosure(
                matrices.dense(self.rows[:, np.flatnonzero(is_open)]).T, self.y
            )
        ) is None:
            return False
        error = self.error + 2 * (abs(self.rows).T @ change)
        may_turn = (self._low | self._high) & (change > 0) & (np.abs(self.y) <= change)
        beyond = (self.excess + error < 0) | is_open | ~self.used
        return (
            bool(beyond.all() and not may_turn.any())
            and self.largest_total(~is_open, change, error) < 0
        )

    def holds(self, y: Sequence[Fraction], certain: Mask | bool = False) -> bool:
        """Return whether a rational y on the support, with the right signs, is a proof,
        in exact arithmetic.

        certain : columns that are known to have the right sign and add nothing to the
            total.
        """
        multiple, _ = numbers.over_one_denominator(y)
        lower, upper, low, high = self._bounds
        total = numbers.product(self.b, multiple)
        for j in np.flatnonzero(self.used & np.logical_not(certain)).tolist():
            value = numbers.product(matrices.dense(self.rows[:, [j]])[:, 0], multiple)
            if (value > 0 and not high[j]) or (value < 0 and not low[j]):
                return False
            bound = float(upper[j] if value > 0 else lower[j])
            total += value * Fraction(bound) if value and bound else 0
        return total < 0


def corrected(
    A: Sequence[Sequence[int]], y: Sequence[Fraction], quickly: bool = True
) -> list[Fraction] | None:
    """Return y changed, mainly in its large entries, so that A y = 0; or, if A is
    nonsingular, so that A y < 0, provided that y approximates such a vector. None if
    there is none.

    quickly : whether only an A, of at least one row, that is small enough to be solved
        exactly in about a second is attempted.
    """
    if quickly and (
        max(len(A), len(A[0])) > max_exact_unknowns()
        or len(A) * len(A[0]) * elimination.bits(A) > MAX_BITS
        or elimination.duration(A) > MAX_SECONDS
    ):
        return None
    # Pivots are chosen among the large entries, whose relative change is smallest.
    order = sorted(range(len(y)), key=lambda k: -abs(y[k]))
    rows, values = [[row[k] for k in order] for row in A], [y[k] for k in order]
    multiple, divisor = numbers.over_one_denominator(values)
    changes = elimination.particular(
        rows, [-numbers.dot(row, multiple) for row in rows]
    )
    corrected_values = (
        None
        if changes is None
        else [v + change / divisor for v, change in zip(values, changes, strict=True)]
    )
    # The only solution of A y = 0 is 0: A is nonsingular.
    if (
        corrected_values is not None
        and not any(corrected_values)
        and len(rows) == len(order)
    ):
        corrected_values = _beyond(rows, values)
    return (
        None
        if corrected_values is None
        else [value for _, value in sorted(zip(order, corrected_values, strict=True))]
    )


def _beyond(
    rows: Sequence[Sequence[int]], y: Sequence[Fraction]
) -> list[Fraction] | None:
    """Return the vector with A y < 0 in all rows of a nonsingular A if y is a multiple
    of it up to rounding: if the rows are almost dependent, y is almost their null
    vector, and rounding of A decides the sign of A y.
    """
    terms = [
        sum(abs(value * factor) for value, factor in zip(row, y, strict=True))
        for row in rows
    ]
    common = max(term.denominator for term in terms)
    if (
        direction := elimination.solve(rows, [int(-term * common) for term in terms])[0]
    ) is None:
        return None
    k = max(range(len(y)), key=lambda i: abs(y[i]))
    factor = y[k] / direction[k] if direction[k] else Fraction(0)
    close = all(
        abs(factor * value - original) <= Fraction(PROOF_RTOL) * abs(original)
        for value, original in zip(direction, y, strict=True)
    )
    return [factor * value for value in direction] if factor > 0 and close else None


def max_exact_unknowns() -> int:
    """Return the number of unknowns of the largest linear system that is solved
    exactly.
    """
    return LARGEST_BY_FLINT if elimination.library() else LARGEST_EXACT


# Entries of M in the rows of a proof, plus unknowns, up to which integer proofs are
# searched for.
MAX_ENTRIES = 2_000
# Entries of M in the rows of a proof, plus unknowns, up to which y is tested exactly,
# which takes about a tenth of a second.
MAX_TERMS = 20_000
SIMPLE_DENOMINATORS = (100, 10**6)  # the largest denominators of simple fractions
# Values of the largest entry of y before it is rounded to small integers.
SMALL = np.arange(1.0, 65.0)
# Values of the largest entry of y before it is rounded and then corrected.
GRIDS = (2**6, 2**12, 2**20, 2**30)


@np.errstate(all="ignore")
def refutes_as_written(problem: Problem, y: Vector) -> bool:
    """Return whether y, of shape (n,), or a vector close to it, proves that a problem
    has no solution with the numbers as written (see `rational.written`): of arrays, for
    the doubles and for their shortest decimals.
    """
    is_of_text = problem.written is not None
    if not (is_of_text or refutes(problem.M, problem.q, y, problem.box)):
        return False
    of = Multiplied(problem.M, problem.q, y, problem.box)
    if not of.may_be_proof():
        return False
    if of.is_certain_for_all() or (not is_of_text and are_same(problem)):
        return True
    whole = in_integers(problem, of.support)
    used = of.bound_sizes[of.used & (of.excess < np.inf)]
    if whole is not None and are_decimals(used):
        return refutes(*whole, y, problem.box)
    if not (is_of_text or _exceeds_rounding(of)):
        return False
    data = _of_rows_as_written(problem, of.support)
    exact = fractions_of(y)
    candidates = chain((exact,), _small(problem, y), _simple(data, y, quickly=True))
    if any(map(data.refuted_by, candidates)):
        return True
    corrected_y = _corrected(data, exact, of.active_columns, quickly=True)
    return corrected_y is not None and data.refuted_by(corrected_y)


def _exceeds_rounding(of: Multiplied) -> bool:
    """Return whether the total is farther from 0 than the rounding of those entries of
    b that have more digits than a decimal that somebody wrote."""
    long = numbers.are_rounded(of.b)
    return -of.total > EPS / 2 * float(np.abs(of.b[long]) @ np.abs(of.y[long]))


def _of_rows_as_written(problem: Problem, support: Indices) -> ExactProblem:
    """Return the problem with its numbers as written, perhaps with zeros in the rows
    that are not in the support."""
    is_plain = problem.formulation.exact_conditions() is None
    if is_plain and (problem.written is None or problem.written.are_short()):
        return ExactProblem.of_rows(problem, support, numbers.shortest_decimal)
    return as_written(problem)


def exact_proof(data: ExactProblem, y: Vector) -> list[Fraction] | None:
    """Return a vector close to a multiple of y, shape (n,), that proves the problem
    infeasible, in integers without common divisor; None if there is none. The
    candidates are small integers, simple fractions, and y, perhaps changed so that M'y
    = 0 where it almost is.
    """
    if not (np.isfinite(y).all() and y.any()):
        return None
    candidates = chain(_small(data.problem, y), _simple(data, y, quickly=False))
    proof = next(filter(data.refuted_by, candidates), None)
    return None if proof is None else list(map(Fraction, numbers.whole_multiple(proof)))


def simplified(data: ExactProblem, y: list[Fraction]) -> list[Fraction]:
    """Return small integers close to a multiple of a proof y that are a proof too; y if
    there are none.
    """
    return next(
        filter(data.refuted_by, _small(data.problem, numbers.rounded_direction(y))), y
    )


def whole_proofs(problem: Problem, y: Vector, small: bool) -> Iterator[Vector]:
    """Yield vectors of integers close to a multiple of y that are proofs for the double
    precision numbers of a problem, or for their shortest decimals.

    small : whether integers up to 64 are yielded, or else those up to 2^53.
    """
    support = np.flatnonzero(y)
    if _entries(problem, support) > MAX_ENTRIES:
        return
    roundings = list(_small(problem, y)) if small else []
    for data in _data_of_rows(problem, support) if roundings or not small else ():
        for candidate in roundings if small else _simple(data, y, quickly=True):
            whole = numbers.whole_multiple(candidate)
            if max(map(abs, whole)) <= numbers.LARGEST_INTEGER and data.refuted_by(
                candidate
            ):
                yield rounded(map(Fraction, whole))


def is_exact(problem: Problem, y: Vector) -> bool:
    """Return whether y is a proof exactly as it is, for the numbers of a problem as
    written; also False if it has so many terms that a test takes long.
    """
    of = Multiplied(problem.M, problem.q, y, problem.box)
    if of.is_clear():
        return True
    if _entries(problem, of.support) > MAX_TERMS:
        return False
    data = _of_rows_as_written(problem, of.support)
    return data.refuted_by(fractions_of(y))


def _data_of_rows(problem: Problem, support: Indices) -> Iterator[ExactProblem]:
    """Yield some rows of a problem as exact numbers: the double precision numbers
    themselves, then their shortest decimals if they differ.
    """
    for number in (Fraction, numbers.shortest_decimal):
        yield (data := ExactProblem.of_rows(problem, support, number))
        if all(scale == 1 for scale in data.scales):
            return


def _entries(problem: Problem, support: Indices) -> int:
    """Return the number of entries of M in some rows, plus the number of unknowns."""
    rows = problem.M[support]
    return int(rows.nnz if is_sparse(rows) else rows.size) + problem.n


@np.errstate(all="ignore")
def _small(problem: Problem, y: Vector) -> Iterator[list[Fraction]]:
    """Return multiples of y rounded to small integers, the smallest first, that are
    proofs as far as floating-point arithmetic shows.
    """
    support = np.flatnonzero(y)
    roundings = np.rint(np.multiply.outer(SMALL, y[support] / np.abs(y).max()))
    rows, (lower, upper) = problem.M[support], problem.box.vectors(problem.n)
    products, sizes = roundings @ rows, np.abs(roundings) @ abs(rows)
    bounds = np.where(products > 0, upper, lower)
    # The supremum is infinite if (A'y)_j violates its sign condition.
    suprema = np.where(
        np.abs(products) > EPS * problem.n * sizes, products * bounds, 0.0
    )
    proving = np.flatnonzero(roundings @ problem.q[support] + suprema.sum(axis=1) < 0)
    vectors = np.zeros((proving.size, problem.n))
    vectors[:, support] = roundings[proving]
    return map(fractions_of, vectors)


def _simple(data: ExactProblem, y: Vector, quickly: bool) -> Iterator[list[Fraction]]:
    """Yield vectors of simple fractions close to y, and some corrected so that M'y = 0
    exactly where it may be 0, the simplest first.

    quickly : whether to stop when integers exceed 2^53, and to correct by small linear
        systems only; otherwise y itself is yielded last.
    """
    snapped = fractions_of(np.where(np.abs(y) < SNAP * np.abs(y).max(), 0.0, y))
    of = Multiplied(data.problem.M, data.problem.q, y, data.problem.box)
    active = of.active_columns
    largest, smallest = (
        extreme(abs(value) for value in snapped if value) for extreme in (max, min)
    )
    units = product(SIMPLE_DENOMINATORS, (largest, smallest))
    simple = (
        [(value / unit).limit_denominator(max_denominator) for value in snapped]
        for max_denominator, unit in units
    )
    yield from islice(simple, 2)
    for grid in GRIDS:
        steps = [Fraction(round(grid * value / largest)) for value in snapped]
        candidate = _corrected(data, steps, active, quickly) or steps
        yield candidate
        if (
            quickly
            and max(map(abs, numbers.whole_multiple(candidate)))
            > numbers.LARGEST_INTEGER
        ):
            break
    yield from simple
    if not quickly:
        exact = fractions_of(y)
        yield exact
        yield _corrected(data, exact, active, quickly) or exact


def _corrected(
    data: ExactProblem, y: list[Fraction], active: list[int], quickly: bool
) -> list[Fraction] | None:
    """Return y, `corrected` on its support so that M'y vanishes in the active
    columns."""
    columns, _ = data.with_transpose(y)
    if not any(columns[j] for j in active):
        return y
    support = [i for i in range(data.n) if y[i]]
    common = math.lcm(*(data.scales[i] for i in support))
    A = [
        [data.rows[i].get(j, 0) * (common // data.scales[i]) for i in support]
        for j in active
    ]
    if (corrected_values := corrected(A, [y[i] for i in support], quickly)) is None:
        return None
    corrections = dict(zip(support, corrected_values, strict=True))
    return [corrections.get(i, value) for i, value in enumerate(y)]


def farkas_vector(
    data: ExactProblem, check: Callable[[], None]
) -> list[Fraction] | None:
    """Return a y that passes `data.refuted_by`, in integers without a common divisor;
    None if some z within its bounds has w with the required signs.

    If there is no such z, the phase 1 pivoting of a dictionary stops at a row that
    shows that one of these signs is violated wherever all earlier ones hold; y consists
    of its coefficients. `check` may raise at each pivot.
    """
    unknowns, n = Unknowns(data, check), data.n
    rows, factors, nonfixed = unknowns.forms()
    for k in unknowns.boxes:
        del rows[unknowns.w(k)], factors[unknowns.w(k)]
    equations = [k for k in nonfixed if unknowns.choices[k] == (BASIC,)]
    for k in equations:
        w, opposite = unknowns.w(k), len(WORDS) * n + k
        rows[opposite], factors[opposite] = [-value for value in rows[w]], -factors[w]
    required = {
        *nonfixed,
        *(unknowns.zero(k, UPPER) for k in unknowns.boxes),
    }.difference(equations)
    dictionary = Dictionary(rows, list(nonfixed), required, check)
    if (
        violated := next(
            (form for form in factors if not dictionary.require(form)), None
        )
    ) is None:
        return None
    multiples = dict(
        zip(dictionary.cobasic, dictionary.rows[violated][1:], strict=True)
    ) | {violated: -dictionary.divisor}
    y = numbers.zeros(n)
    for form in factors.keys() & multiples.keys():
        y[form % n] -= int(multiples[form]) * factors[form]
    return [Fraction(value) for value in numbers.whole_multiple(y)]
