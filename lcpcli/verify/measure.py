"""The measure of how far a point is from solving a problem: a componentwise backward
error with a cap.

A z within its bounds violates row i by v_i: by |w_i| strictly between the bounds, by
the part of w_i that violates its sign condition at a bound, and by 0 if both bounds are
equal. This is compared with the terms of that row, |q|_i + (|M| |z|)_i. If v_i is at
most tol times these in all rows, z is the exact solution of a problem each of whose
numbers differs by at most tol, relatively, from the original one: W. Oettli and W.
Prager, Compatibility of approximate solution of linear equations with given error
bounds for coefficients and right-hand sides, Numerische Mathematik 6 (1964) 405-409.
Neither the scaling of rows and columns nor the sizes of other rows matter.

With bounds far from 0, rows have large terms that cancel. Therefore the terms t_i are
those at the reference point of the problem, |q_ref|_i + (|M| |z - z_ref|)_i, if these
are smaller, but at least FINEST times the terms above.

That alone would accept a z that tends to infinity in a problem without solution. So
each row also has a cap,

    c_i = max(|q_ref|_i, k / R_i),

where k belongs to the connected component of M that contains the row, and R, C are the
scaling factors of its rows and columns (by equilibration): k is the largest violation
of a row j at z_ref, times R_j, or distance of a z_j at a bound from z_ref, divided by
C_j. If all of these are 0, k is the largest R_j |q_ref|_j, or infinite if all of those
are 0 too; a q_ref at the level of rounding errors of the terms is replaced by 0. The
relative residual is the largest v_i / min(t_i, c_i), with 0/0 = 0. Rounding z, or the
data, may cause violations of ROUNDING times the terms; a violation up to this size is
treated as at most ROUNDING, unless these terms exceed DROWNED c_i.

A basic z_j below SMALLEST_NORMAL lies on the grid of subnormal numbers, so that each
row may in addition be violated by NEAR_ZERO |M_ij| if that is a rounding error compared
with the largest |q_ref|_i, otherwise by 2^-1074 |M_ij|. That holds for z_j itself, not
for products of larger numbers that underflow.

Every array has the shape (n,) for one point, or (m, n) for one point of each of m
problems.

For a large dense M, w = M z + q alone often decides, without |M| |z| and the scaling
factors of M: the terms of row i lie between |q|_i and |q|_i + max |M_ij| |z|_1, and the
cap is at least |q|_i. If no M_ij is 0, R_i is inverse to the geometric mean of row i,
so that a row with a violation v_j at z = 0 implies c_i >= v_j R_j / R_i for the few
rows that remain undecided.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import (
    LARGEST_DOUBLE,
    ROUNDING,
    ROW_ROUNDING,
    SMALLEST_NORMAL,
    are_moderate,
    number_of,
)
from lcpcli.linalg.matrices import (
    absolute_product,
    accurate_residual,
    is_sparse,
    product,
    row_errors,
)
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Mask, Vector

if TYPE_CHECKING:
    from lcpcli.model.right_hand_sides import Block

# The terms at the reference point are assumed to be at least this fraction of the terms
# |q| + |M| |z|.
FINEST = 0.01
# If the terms exceed the cap by this factor, their rounding errors reach the eighth
# digit of the cap, and are no longer tolerated.
DROWNED = 1e8
# Unknowns up to which numbers that may be rounding errors are taken literally, as exact
# arithmetic decides in a short time.
FEW_UNKNOWNS = 20
# Rounding errors below this fraction of the tolerated violation, or of the violation,
# are ignored.
NEGLIGIBLE_ROUNDING = 0.1
# A violation below this relative to the terms of its row and to q_ref may be removed by
# cleaning rounding errors from z.
NEAR_VIOLATION = 1e-8
SMALLEST = math.ulp(0.0)
# An error SMALLEST in a subnormal z_j may be amplified to this by linear systems with
# entries of different sizes.
NEAR_ZERO = SMALLEST_NORMAL * 2.0**-20


class Rows(NamedTuple):
    """w = M z + q at a point, its terms t, the full terms |q| + |M| |z|, and bounds on
    the rounding errors in w.

    grid : the violations of each row that the spacing of subnormal z_j may cause; None
        if no z_j is so small.
    """

    w: Vector
    terms: Vector
    full_terms: Vector
    error: Vector
    grid: Vector | None = None

    def part(self, rows: Indices | int) -> Rows:
        parts = (None if values is None else values[rows] for values in self)
        return Rows(*parts)  # type: ignore[arg-type]

    def satisfied(self, rows: Sequence[int]) -> Rows:
        """Return the rows with w = 0 in some of them, without rounding error."""
        w, error = self.w.copy(), self.error.copy()
        w[rows], error[rows] = 0.0, 0.0
        return self._replace(w=w, error=error)


class Measure:
    """The measure for a problem, or for each problem of a block, with numbers whose
    products are in the range of double precision.
    """

    def __init__(
        self, data: Problem | Block, inside: Callable[[Vector], Vector] | None = None
    ) -> None:
        """inside : transforms a z of the problem to the scaling of these data, if that
        differs."""
        self.data, self._inside = data, inside

    def rows(self, z: Vector, w: Vector | None = None) -> Rows:
        """Return the rows at z, with w by one product of M and z or its distance from
        the reference point, whichever has the smaller rounding error.

        w : M z + q if it is known, and z_ref = 0.
        """
        data = self.data
        w, row_magnitudes = self._w_and_terms(z, data.q, w)
        error = row_errors(data.M, z, row_magnitudes)
        if data.reference_z is None:
            return Rows(w, row_magnitudes, row_magnitudes, error, self.grid(z))
        far = self.rows_from_reference(z - data.reference_z, row_magnitudes)
        w = np.where(far.error < error, far.w, w)
        return far._replace(w=w, error=np.minimum(error, far.error), grid=self.grid(z))

    def rows_from_reference(self, distance: Vector, row_magnitudes: Vector) -> Rows:
        """Return the rows at z_ref + distance, a point that double precision may not
        represent.

        row_magnitudes : |q| + |M| |z| for this point.
        """
        w, far = self._w_and_terms(distance, self.data.q_ref)
        terms = np.minimum(row_magnitudes, np.maximum(far, FINEST * row_magnitudes))
        return Rows(
            w,
            terms,
            row_magnitudes,
            row_errors(self.data.M, distance, far) + self.data.q_error,
        )

    def grid(self, z: Vector) -> Vector | None:
        """Return by how much rounding of basic subnormal z_j may change each row; None
        if no z_j is so small.
        """
        box, units = self.data.box, np.ones(z.shape)
        units = units if self._inside is None else self._inside(units)
        tiny = (
            (np.abs(z) < SMALLEST_NORMAL * units)
            & (z != 0)
            & (box.lower < z)
            & (z < box.upper)
        )
        if not np.count_nonzero(tiny):
            return None
        return np.asarray(
            absolute_product(self.data.M, np.where(tiny, NEAR_ZERO * units, 0.0).T).T
        )

    def _w_and_terms(
        self, z: Vector, q: Vector, w: Vector | None = None
    ) -> tuple[Vector, Vector]:
        """Return w = M z + q, unless it is known, and |M| |z| + |q|."""
        w = product(self.data.M, z.T).T + q if w is None else w
        return w, absolute_product(self.data.M, np.abs(z).T).T + np.abs(q)

    def violations(self, z: Vector, w: Vector) -> Vector:
        """Return the violation v_i of each row, for z within its bounds."""
        return np.maximum(self.data.box.excess(z, w), 0.0)

    def surely_solves(self, z: Vector, rows: Rows, tol: float) -> Mask:
        """Return whether the relative residual is at most tol for all possible rounding
        errors in w; shape () or (m,).

        c_i is at least |q_ref|_i; it is computed only if this lower bound does not
        decide.
        """
        worst = self.data.box.excess(z, rows.w) + rows.error
        min_caps = np.abs(self.data.q_ref)
        if self.data.reference_z is not None:  # else the terms include it
            min_caps = np.minimum(min_caps, rows.terms)
        closed = worst <= tol * min_caps
        if np.count_nonzero(closed) == closed.size:
            return np.ones(closed.shape[:-1], dtype=bool)
        solved: Mask = np.asarray(closed.all(axis=-1))
        if solved.ndim and not isinstance(self.data, Problem) and solved.any():
            some = (~solved).nonzero()[0]
            solved[some] = Measure(self.data.part(some)).surely_solves(
                z[some], rows.part(some), tol
            )
            return solved
        return self.allows(worst, z, rows, tol)

    def allows(
        self, violations: Vector, z: Vector, rows: Rows, tol: float, factor: float = 1.0
    ) -> Mask:
        """Return whether violations are at most `factor` times the tolerated ones;
        shape () or (m,). Caps are computed only if the result differs between their
        lower bound |q_ref|_i and infinity.
        """
        surely = np.asarray(
            (
                violations <= factor * self.allowed(rows, np.abs(self.data.q_ref), tol)
            ).all(axis=-1)
        )
        if (
            surely
            | (violations > factor * self.allowed(rows, np.inf, tol)).any(axis=-1)
        ).all():
            return surely
        return np.asarray(
            (violations <= factor * self.allowed(rows, self.caps(z), tol)).all(axis=-1)
        )

    def surely_fails(self, z: Vector, rows: Rows, tol: float) -> Mask:
        """Return whether the relative residual exceeds tol for all possible caps and
        rounding errors in w.
        """
        min_violations = self.data.box.excess(z, rows.w) - rows.error
        return np.asarray(
            (min_violations > self.allowed(rows, np.inf, tol)).any(axis=-1)
        )

    def size(self, z: Vector, rows: Rows) -> float:
        """Return the largest violation relative to the largest |q_ref|_i: a cheap
        number for comparing points of one problem.
        """
        return float(
            quotients(self.violations(z, rows.w).max(), np.abs(self.data.q_ref).max())
        )

    def is_near(self, z: Vector, rows: Rows) -> bool:
        """Return whether no violation is large compared with the terms of its row and
        the largest |q_ref|_i, so that it may be caused by rounding errors.
        """
        terms = np.maximum(rows.terms, np.abs(self.data.q_ref).max())
        return bool((self.violations(z, rows.w) <= NEAR_VIOLATION * terms).all())

    def largest_ratio(self, z: Vector, rows: Rows) -> Vector:
        """Return an upper bound on the relative residual for all possible rounding
        errors in w; shape () or (m,).
        """
        worst = np.maximum(self.data.box.excess(z, rows.w) + rows.error, 0.0)
        return np.asarray(self.ratios(worst, rows, self.caps(z)).max(axis=-1))

    def ratios(self, violations: Vector, rows: Rows, caps: Vector) -> Vector:
        """Return v_i / min(t_i, c_i), at most ROUNDING for a v_i that rounding may
        cause."""
        ratios = quotients(violations, np.minimum(rows.terms, caps))
        return np.where(
            violations <= self.allowed(rows, caps, 0.0),
            np.minimum(ratios, ROUNDING),
            ratios,
        )

    def allowed(self, rows: Rows, caps: Vector | float, tol: float) -> Vector:
        """Return the largest violation of each row that is tolerated for this tol."""
        rounding = np.minimum(
            np.minimum(rows.full_terms, DROWNED * caps), LARGEST_DOUBLE
        )
        sizes = np.minimum(np.minimum(rows.terms, caps), LARGEST_DOUBLE)
        allowed = np.maximum(tol * sizes, ROUNDING * rounding)
        if rows.grid is None:
            return allowed
        largest = np.abs(self.data.q_ref).max(axis=-1, keepdims=True)
        return allowed + np.where(
            rows.grid <= ROUNDING * largest,
            rows.grid,
            (SMALLEST / NEAR_ZERO) * rows.grid,
        )

    @property
    def reference(self) -> Vector:
        """Return z_ref."""
        reference_z = self.data.reference_z
        return np.zeros(self.data.q.shape) if reference_z is None else reference_z

    @cached_property
    def reference_violations(self) -> Vector:
        """Return the violations at z_ref."""
        return self.violations(self.reference, self.data.q_ref)

    @cached_property
    def reference_w(self) -> Vector:
        """Return q_ref, with 0 for entries at the level of rounding errors."""
        q_ref, reference_z = self.data.q_ref, self.data.reference_z
        if reference_z is None:
            return q_ref
        return np.where(
            np.abs(q_ref) <= ROUNDING * self._w_and_terms(reference_z, self.data.q)[1],
            0.0,
            q_ref,
        )

    @np.errstate(divide="ignore")
    def unsolved_sizes(self, z: Vector) -> Vector:
        """Return log2 of k for each component by violations at z_ref and distances from
        it, minus infinity if all of these are 0.
        """
        box, units = self.data.box, self.data.units
        at_bound = ((z == box.lower) | (z == box.upper)) & (box.lower < box.upper)
        moved = np.where(at_bound, np.abs(z - self.reference), 0.0)
        if not np.count_nonzero(moved):
            return self._violated_sizes
        return np.maximum(
            self._violated_sizes,
            units.largest(np.log2(moved) - units.columns, units.column_part),
        )

    @cached_property
    @np.errstate(divide="ignore")
    def _violated_sizes(self) -> Vector:
        """Return the part of `unsolved_sizes` that the violations at z_ref
        contribute.
        """
        units = self.data.units
        violations = self.violations(self.reference, self.reference_w)
        return units.largest(np.log2(violations) + units.rows, units.row_part)

    @np.errstate(divide="ignore")
    def component_sizes(self, z: Vector) -> Vector:
        """Return log2 of k for each component, shape (..., parts); it may be
        infinite.
        """
        sizes, units = self.unsolved_sizes(z), self.data.units
        is_known = sizes > -np.inf
        if np.count_nonzero(is_known) == is_known.size:
            return sizes
        sizes = np.where(
            is_known,
            sizes,
            units.largest(
                np.log2(np.abs(self.reference_w)) + units.rows, units.row_part
            ),
        )
        return np.where(sizes > -np.inf, sizes, np.inf)

    @np.errstate(over="ignore")
    def caps(self, z: Vector) -> Vector:
        """Return the cap c_i of each row."""
        units = self.data.units
        sizes = np.exp2(self.component_sizes(z)[..., units.row_part] - units.rows)
        return np.maximum(sizes, np.abs(self.data.q_ref))

    @np.errstate(invalid="ignore")
    def natural_sizes(self, z: Vector) -> Vector:
        """Return the natural size k C_j of each z_j; 0 in a component whose k is
        infinite.
        """
        units = self.data.units
        sizes = self.component_sizes(z)[..., units.column_part]
        return np.where(sizes < np.inf, np.exp2(sizes + units.columns), 0.0)

    @np.errstate(divide="ignore", invalid="ignore")
    def distances(self, z: Vector, other: Vector) -> Vector:
        """Return |z_j - other_j| relative to the natural size k C_j, or to u_j - l_j if
        that is smaller; if l_j = u_j, relative to the larger one of k C_j and |l_j|. It
        is infinite in a component without a natural size.
        """
        box, natural = self.data.box, self.natural_sizes(other)
        natural = np.minimum(
            natural, np.where(box.fixed, np.inf, box.upper - box.lower)
        )
        natural = np.where(box.fixed, np.maximum(natural, np.abs(box.lower)), natural)
        return quotients(np.abs(z - other), natural)

    def is_rounding(self, z: Vector, rows: Rows) -> Mask:
        """Return whether all violations are at most twice what ROUNDING tolerates;
        shape () or (m,).
        """
        return self.allows(self.violations(z, rows.w), z, rows, 0.0, factor=2.0)

    def doubtful(self, z: Vector, rows: Rows, tol: float) -> Mask:
        """Return the rows in which rounding errors in w may decide whether z solves the
        problem, or are not small compared with a violation or a w_i at a bound.
        """
        excess = self.data.box.excess(z, rows.w)
        worst = excess + rows.error
        allowed = self.allowed(rows, self.caps(z), tol)
        decisive = (worst > NEGLIGIBLE_ROUNDING * allowed) & (
            rows.error > NEGLIGIBLE_ROUNDING * worst
        )
        return decisive | (
            (excess < np.abs(rows.w))
            & (rows.error > NEGLIGIBLE_ROUNDING * np.abs(rows.w))
        )


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def quotients(violations: Vector, sizes: Vector) -> Vector:
    """Return violations / sizes with 0/0 = 0, and infinity if either is NaN."""
    quotients = np.where(violations == 0, 0.0, violations / sizes)
    return np.where(np.isnan(quotients), np.inf, quotients)


def rounded_once(problem: Problem, z: Vector, rows: Indices) -> Vector | list[float]:
    """Return (M z + q)_i for some rows, computed exactly and then rounded; infinite if
    that overflows.
    """
    M, q = problem.M[rows], problem.q[rows]
    if (
        are_moderate(M.data if is_sparse(M) else M)
        and are_moderate(z)
        and are_moderate(q)
    ):
        return np.asarray(0.0 - accurate_residual(M, z, -q))
    with imports:
        from lcpcli.rational import numbers
    if is_sparse(M):
        spans = [slice(*M.indptr[i : i + 2]) for i in range(rows.size)]
        parts = [(M.data[span], z[M.indices[span]]) for span in spans]
    else:
        parts = [(row[row != 0], z[row != 0]) for row in M]
    return [
        numbers.rounded_sum(*part, value)
        for value, part in zip(q.tolist(), parts, strict=True)
    ]


# Rows of M from which on |M| |z| takes longer than a test that needs few of its rows.
MIN_FILTERED = 64
# Fraction of the rows up to which selecting rows of M saves time in |M| |z|.
MAX_ROWS = 0.25
# Caps computed from means of logarithms are reduced by this factor for their rounding.
CERTAIN = 0.99


def decision(measure: Measure, z: Vector, w: Vector, tol: float) -> bool | None:
    """Return whether the relative residual of a z within its bounds, with w = M z + q,
    is at most tol for all possible rounding errors in w; None if these bounds do not
    decide.
    """
    problem = measure.data
    assert isinstance(problem, Problem)
    M, rows = problem.M, None
    excess = problem.box.excess(z, w)
    min_terms = np.abs(problem.q)
    sizes = np.abs(z)
    if M.shape[0] >= MIN_FILTERED:
        if _fails_worst_row(M, excess, min_terms, sizes, tol):
            return False
        largest_error = (
            ROW_ROUNDING * (min_terms + problem.largest * float(sizes.sum()))
            + min_terms.size * SMALLEST_NORMAL
        )
        # The rows that are not decided by |q|_i alone.
        rows = (excess + largest_error > tol * min_terms).nonzero()[0]
        if rows.size <= MAX_ROWS * min_terms.size:
            min_terms, M, excess = min_terms[rows], M[rows], excess[rows]
        else:
            rows = None
    terms = min_terms + absolute_product(M, sizes)
    errors = row_errors(M, z, terms)
    largest = excess + errors
    is_closed = largest <= tol * min_terms
    if number_of(is_closed) == terms.size:
        return True
    # Even infinite caps, as in a component without natural size, do not decide.
    if number_of(largest <= tol * terms) < terms.size:
        fails = excess - errors > max(tol, ROUNDING) * terms
        return False if number_of(fails) else None
    is_open = ~is_closed
    largest = largest[is_open]
    rows = is_open.nonzero()[0] if rows is None else rows[is_open]
    caps = least_caps(problem, measure.reference_violations, rows)
    if caps is not None and number_of(largest <= tol * caps) == rows.size:
        return True
    return True if (largest <= tol * measure.caps(z)[rows]).all() else None


def _fails_worst_row(
    M: Vector, excess: Vector, min_terms: Vector, sizes: Vector, tol: float
) -> bool:
    """Return whether the row with the largest excess violates its sign condition by
    more than the tolerance for its terms, which only this row of M shows."""
    worst = slice(row := int(excess.argmax()), row + 1)
    if not excess[row] > 2 * tol * min_terms[row]:
        return False
    terms = min_terms[worst] + absolute_product(M[worst], sizes)
    error = row_errors(M[worst], sizes, terms)[0]
    return bool(excess[row] - error > max(tol, ROUNDING) * terms[0])


def least_cap(problem: Problem, absolute: Vector) -> float:
    """Return a lower bound on the caps of all rows of an LCP with a dense M and a
    negative q_i, from |M|: the ratio of the geometric means of two rows is at least
    that of the extreme entries; 0 if M has a zero."""
    least = np.minimum.reduce(absolute, axis=None)
    return float(CERTAIN * -min(problem.q.tolist()) * least / problem.largest)


def least_caps(problem: Problem, violations: Vector, rows: Indices) -> Vector | None:
    """Return lower bounds on the caps of these rows, for a dense M without zeros or
    close to one before in a sequence, and the violations at the reference point;
    otherwise None.
    """
    near = problem.facts.near_units
    if near is not None:
        units, digits = near
        powers_of_rows = np.log2(np.maximum(violations, 0.0)) + units.rows
        sizes = units.largest(powers_of_rows, units.row_part)
        powers = sizes[units.row_part[rows]] - units.rows[rows] - digits
        return np.asarray(CERTAIN * np.exp2(powers))
    means = problem.facts.row_means
    if means is None:
        return None
    worst = int(violations.argmax())
    # The scaling factors of the rows are inverse to their geometric means.
    return np.asarray(CERTAIN * violations[worst] * np.exp2(means[rows] - means[worst]))
