"""Whether a point solves a problem, and its residuals, always for the original M and q;
and whether the known solutions of a problem solve it, to the digits with which they are
given.

A method leaves a z_j of 1e-17 where 0 is meant, and a row whose terms are all of that
kind is violated by its own terms, however small these are beside the numbers of the
problem. So points are tried in which such z_j are at their bounds or at the reference
point, and multipliers of rows that are not active at 0; each of them is then measured
as any other.

The q of large problems from other sources has entries like 2e-16 beside 1 that are
rounding of 0, as they were computed as sums that cancel. An entry counts as 0 if its
row is violated, and

- |q_i| is the only term of the row, so that no z_j of that size was computed wrong, and
  no whole number,
- it is at most ROW_ROUNDING of the cap of the row, as rounding of the other numbers of
  its part of the problem may be,
- as it is and in the units of M, it is by a factor in ROUNDING_OF_Q smaller than each
  of the LARGER_SHARE largest |q_j| != 0 of this part, which are at least MIN_LARGER:
  a few large numbers do not make rounding of the others,
- and LITERAL_STEPS of block pivoting from the states of the point find no solution for
  q as it is.

For up to FEW_UNKNOWNS exact arithmetic decides. Entries of M and bounds never count as
0. Sides of rows without entries may, for any number of unknowns, as nothing else can be
meant by them (`model.rounded_rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import islice, product
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from lcpcli.clock import imports
from lcpcli.errors import listed
from lcpcli.linalg.doubles import (
    ROUNDING,
    ROW_ROUNDING,
    SMALL_DISTANCE,
    distinct,
    each_step,
    is_finite,
    size,
)
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import absolute_product, is_sparse, row_parts
from lcpcli.linalg.units import LARGEST_POWER
from lcpcli.model import changes
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, States, Vector
from lcpcli.verify.measure import (
    FEW_UNKNOWNS,
    Measure,
    Rows,
    decision,
    quotients,
    rounded_once,
)

if TYPE_CHECKING:
    from lcpcli.model.rounded_rows import RoundedRows

# The relative residual up to which z counts as a rounded solution, whatever its digits.
ROUGH = 1e-3
# Digits that are attributed to a z: whole numbers are meant exactly, others may be
# singles.
MIN_GIVEN_DIGITS, MAX_GIVEN_DIGITS = 4, 7
MAX_CLEANINGS = 4  # of a point, one after another
MAX_NAMED = 3  # entries of q that a message names
LARGEST_ROUNDED = 2.0**900  # terms of a row from which its sum may overflow
# Of the least of the larger entries of q: an entry that may be rounding of 0.
ROUNDING_OF_Q = 1e-24, 1e-12
# Of the entries of q that are not 0, in a part of M.
LARGER_SHARE, MIN_LARGER = 1 / 3, 8
LITERAL_STEPS = 8  # of block pivoting, each at the cost of a factorization
AcceptanceTest: TypeAlias = Callable[
    [Problem, Vector, float], "tuple[bool | None, Rows | None]"
]


class Criterion:
    """What a point must satisfy to count as a solution: its relative residual, as
    defined in `measure`, is at most tol.

    A problem with numbers so large or small that products over- or underflow is
    measured in other units, powers of two. If none are found, or z is out of range in
    them, sums are exact instead wherever doubles may overflow. acceptance_test : says
    for a mixed problem with sparse M and moderate numbers, a z within its bounds and a
    tolerance whether they meet this criterion, and the rows of z, None for what is not
    sure; by default there is none.
    """

    is_linear = True  # whether the problem of its points is

    def __init__(
        self,
        problem: Problem,
        tol: float = 1e-10,
        literal: bool = False,
        acceptance_test: AcceptanceTest | None = None,
    ) -> None:
        self.problem = problem
        self.tol = tol
        self._is_literal = literal
        self.acceptance_test = None
        if (
            acceptance_test is not None
            and problem.is_moderate
            and problem.is_mixed
            and is_sparse(problem.M)
        ):
            self.acceptance_test = acceptance_test

    @cached_property
    def units(self) -> changes.Scaled:
        problem = self.problem
        units = (
            None if problem.is_moderate or self._is_literal else changes.scale(problem)
        )
        return (
            units
            if units is not None and units.is_exact
            else changes.Scaled(problem, problem)
        )

    @cached_property
    def data(self) -> Problem:
        """Return the problem in the units in which residuals are measured."""
        return self.units.problem

    @cached_property
    def measure(self) -> Measure:
        return Measure(
            self.data, None if self.units.is_identity else self.units.z_inside
        )

    def for_point(self, z: Vector) -> Criterion:
        """Return the criterion to measure a point by: a literal one if its z is out of
        range in other units."""
        if self.units.is_identity or np.array_equal(
            self.units.z_outside(self.units.z_inside(z)), z
        ):
            return self
        return Criterion(self.problem, self.tol, literal=True)

    def point(self, z: Vector) -> Point:
        return Point(self, z)

    def original(self, z: Vector) -> Vector:
        """Return z in the original units, within its bounds."""
        return self.problem.box.project(
            z if self.units.is_identity else self.units.z_outside(z)
        )

    @np.errstate(all="ignore")
    def residuals(self, Z: Vector) -> tuple[list[float], list[bool]]:
        """Return the natural residuals of m points, shape (m, n), and which of them are
        no more than rounding."""
        inside = self.units.z_inside(Z)
        rows = self.measure.rows(inside)
        natural = [
            size(self.problem.box.gaps(z, w))
            for z, w in zip(Z, self.units.w_outside(rows.w), strict=True)
        ]
        return natural, self.measure.is_rounding(inside, rows).tolist()

    @cached_property
    def reference_solves(self) -> bool:
        """Return whether the reference point of the problem solves it, whatever the
        rounding errors in its w are."""
        problem = self.problem
        return bool(
            (
                problem.box.excess(problem.reference_point, problem.q_ref)
                + problem.q_error
                <= 0
            ).all()
        )

    @cached_property
    def _caps(self) -> Vector:
        """Return the caps at the reference point, in the original units."""
        return self.units.w_outside(self.measure.caps(self.data.reference_point))

    @np.errstate(all="ignore")
    def bound(self, F: Vector) -> float:
        """Return the size of F(x) = M z - w' + q, with the z and w' of x, relative to
        the caps at the reference point: where it is small, so is the natural residual
        of z, as t -> mid(l, u, t) is nonexpansive."""
        return size(F / self._caps) if np.count_nonzero(F) else 0.0


class Point:
    """A z of shape (n,) with its measures, each computed when it is first read.

    w : M z + q, rounded once in rows where rounding errors decide whether z solves the
        problem.
    residual : the natural residual |min(z, w)|_inf in the problem's units, zero exactly
        at the solutions; with bounds, min(z, w) is z - mid(l, u, z - w) = max(z - u,
        min(z - l, w)).
    relative_residual : as defined in `measure`. NaN and overflow count as infinity, and
        so does a z beyond a bound, unless l_i = u_i.
    is_admissible : whether z is known to lie within its bounds, as iterates do;
        otherwise this is checked.
    negligible : the indices of entries of q that count as 0, as they are rounding of it
        (see above).
    """

    is_linear = True  # so that exact arithmetic may decide
    _product: Vector | None = None
    negligible: Sequence[int] = ()

    def __init__(
        self,
        criterion: Criterion,
        z: Vector,
        is_admissible: bool = True,
        negligible: Sequence[int] = (),
    ) -> None:
        self.criterion = criterion.for_point(z)
        self.z = z
        self.negligible = negligible
        self._inside = self.criterion.units.z_inside(z)
        is_within_bounds = is_admissible and is_finite(z)
        self._beyond = (
            None
            if is_within_bounds
            else (z != criterion.problem.box.project(z)) | ~np.isfinite(z)
        )
        self._solves: bool | None = None

    @classmethod
    def of_solution(cls, criterion: Criterion, z: Vector) -> Point:
        point = cls.__new__(cls)
        point.criterion = criterion
        point.z = z
        point._inside = z
        point._beyond = None
        point._solves = True
        return point

    @cached_property
    def _plain(self) -> Rows:
        rows = self.criterion.measure.rows(self._inside, self._product)
        return rows._replace(
            error=np.where(rows.full_terms < LARGEST_ROUNDED, rows.error, np.inf)
        )

    @cached_property
    @np.errstate(all="ignore")
    def _rows(self) -> Rows:
        """Return the rows, with sums that are rounded only once where rounding
        matters."""
        plain = self._plain
        criterion = self.criterion
        z = self._inside
        doubtful = criterion.measure.doubtful(z, plain, criterion.tol) | ~np.isfinite(
            plain.w
        )
        rows = np.flatnonzero(doubtful)
        if not rows.size:
            return plain
        w = plain.w.copy()
        for part in row_parts(rows.size):
            w[rows[part]] = rounded_once(criterion.data, z, rows[part])
        return plain._replace(w=w)

    @cached_property
    @np.errstate(all="ignore")
    def w(self) -> Vector:
        return self.criterion.units.w_outside(self._rows.w)

    @property
    def plain_w(self) -> Vector:
        """Return w by one product, which may be known."""
        rows = self.__dict__.get("_plain")
        if rows is not None:
            return self.criterion.units.w_outside(rows.w)
        return (
            self.criterion.problem.w(self.z) if self._product is None else self._product
        )

    def solves(self) -> bool:
        """Return whether the relative residual is at most the tolerance, by bounds on
        it as far as they decide."""
        if self._solves is None:
            self._solves = self._decision()
        return self._solves

    def _decision(self) -> bool:
        criterion = self.criterion
        problem = self.criterion.problem
        measure = self.criterion.measure
        tol = criterion.tol
        is_admissible = self._beyond is None
        decided = None
        is_plain = is_admissible and not self.negligible
        if is_plain and criterion.acceptance_test is not None:
            decided, rows = criterion.acceptance_test(problem, self.z, tol)
            if rows is not None:
                self._plain = rows
        if (
            decided is None
            and is_admissible
            and not np.count_nonzero(problem.from_reference(self.z))
        ):
            decided = criterion.reference_solves or (
                False if problem.reference_z is None else None
            )
        if decided is not None:
            return decided
        has_bounds = (
            problem.is_moderate
            and problem.n > FEW_UNKNOWNS
            and not is_sparse(problem.M)
        )
        with np.errstate(all="ignore"):
            if is_plain and has_bounds and problem.reference_z is None:
                self._product = problem.w(self.z)
                decided = decision(measure, self.z, self._product, tol)
            if decided is None and is_admissible:
                rows = (
                    self._plain
                    if is_plain
                    else self._plain.satisfied(list(self.negligible))
                )
                solves = bool(measure.surely_solves(self._inside, rows, tol))
                decided = solves or (
                    False if measure.surely_fails(self._inside, rows, tol) else None
                )
            return (
                self.relative_residual <= max(tol, ROUNDING)
                if decided is None
                else decided
            )

    def leaves(self, share: float) -> bool:
        """Return whether the natural residual is at most this share of that of 0, or
        rounding."""
        problem, w = self.criterion.problem, self.plain_w
        at_0 = problem.box.gaps(np.zeros(problem.n), problem.q)
        beyond = np.abs(problem.box.gaps(self.z, w)) - share * size(at_0)
        if (beyond <= 0).all():
            return True
        terms = np.abs(problem.q) + absolute_product(problem.M, np.abs(self.z))
        return bool((beyond <= ROW_ROUNDING * terms).all())

    @property
    def counted_as_0(self) -> str:
        """Return which entries of q count as 0, as a clause for the user; "" if there
        are none."""
        named = self._entries
        if self.rounded_rows is not None:
            named.append("sides of empty rows")
        return f"counting {listed(named)} as 0" if named else ""

    @property
    def remark(self) -> str:
        """Return which entries of q count as 0, and which rows do not hold as the
        numbers stand, as a clause for the user; "" if there are none."""
        if not self.negligible:
            return ""
        said = [f"counting {listed(self._entries)} as 0"] if self._entries else []
        if self.rounded_rows is not None:
            said.append(self.rounded_rows.statement)
        return "; ".join(said)

    @property
    def rounded_rows(self) -> RoundedRows | None:
        """Return the rows without entries that count as satisfied, if any do."""
        return self.criterion.problem.rounded_rows if self.negligible else None

    @property
    def _entries(self) -> list[str]:
        """Return the entries of q that count as 0, other than those of such rows."""
        rounded = self.rounded_rows
        rows = [] if rounded is None else rounded.rows.tolist()
        entries = [i for i in self.negligible if i not in rows]
        problem = self.criterion.problem
        q, first = problem.q, 0
        if entries and problem.block_form is not None:
            q = with_sides(self.criterion, self.z)[0]
            first = problem.block_form.variables
        named = [
            f"q{i + 1} = {q[i]:.1e}"
            if problem.q[i]
            else f"side {-q[i]:.1e} of row {i - first + 1}"
            for i in entries[:MAX_NAMED]
        ]
        more = len(entries) - len(named)
        return [*named, f"{more} more of q"] if more else named

    @property
    @np.errstate(all="ignore")
    def size(self) -> float:
        return self.criterion.measure.size(self._inside, self._plain)

    @cached_property
    @np.errstate(all="ignore")
    def relative_residuals(self) -> Vector:
        measure = self.criterion.measure
        z = self._inside
        rows = self._rows
        violations = measure.violations(self._at_fixed, rows.w)
        violations[list(self.negligible)] = 0.0
        return np.maximum(
            measure.ratios(violations, rows, measure.caps(z)), self.distances_beyond
        )

    @cached_property
    def _at_fixed(self) -> Vector:
        """Return z, as it is measured, with l_i in place of z_i where l_i = u_i."""
        box = self.criterion.data.box
        return (
            self._inside
            if self._beyond is None
            else np.where(box.fixed, box.lower, self._inside)
        )

    @cached_property
    @np.errstate(all="ignore")
    def distances_beyond(self) -> Vector | float:
        """Return by how much z is beyond its bounds: where l_i = u_i as
        `Measure.distances`; else infinity or 0."""
        if self._beyond is None or not self._beyond.any():
            return 0.0
        distances = (
            self.criterion.measure.distances(self._inside, self._at_fixed) - ROUNDING
        )
        return np.where(
            self._beyond & ~self.criterion.problem.box.fixed,
            np.inf,
            np.maximum(distances, 0.0),
        )

    @property
    def relative_residual(self) -> float:
        return size(self.relative_residuals)

    @property
    @np.errstate(all="ignore")
    def scaled_residual(self) -> float:
        """Return for any z the measure that a solver with one tolerance for all rows
        can reach: the larger one of the largest v_i / c_i of z put on the bounds, and
        how far that moves z, as `is_near` measures it."""
        criterion, measure = self.criterion, self.criterion.measure
        if not np.isfinite(self.z).all():
            return np.inf
        moved = Point(
            criterion,
            criterion.original(on_bounds(measure, self._inside, self._plain.w)),
        )
        z = moved._inside
        largest = size(quotients(measure.violations(z, moved._rows.w), measure.caps(z)))
        return max(largest, float(measure.distances(self._inside, z).max(initial=0.0)))

    @cached_property
    @np.errstate(all="ignore")
    def residual(self) -> float:
        return (
            size(self.criterion.problem.box.gaps(self.z, self.w))
            if np.isfinite(self.z).all()
            else np.inf
        )

    def is_near(self, other: Point, tol: float | None = None) -> bool:
        """Return whether another point differs by no more than its tolerance, or the
        given one, in the units of M."""
        max_distance = self.criterion.tol if tol is None else tol
        distances = self.criterion.measure.distances(other._inside, self._inside)
        return bool((distances <= max_distance + ROUNDING).all())

    @np.errstate(all="ignore")
    def nearly_solves(self) -> bool:
        """Return whether no violation is large by `Measure.is_near`: the point is then
        worth a closer look."""
        moved = self.criterion.problem.from_reference(self.z).any()
        return bool(moved and self.criterion.measure.is_near(self._inside, self._plain))

    @each_step(all="ignore")
    def alternatives(self) -> Generator[Point, None, None]:
        """Yield points that differ from this one by what rounding and a method's
        tolerance leave of zeros (see above): first points with other components, and
        then those for which entries of q count as 0."""
        criterion = self.criterion
        measure = self.criterion.measure
        z = self._inside
        if not self.negligible and (rounded := criterion.problem.rounded_rows):
            satisfied = Point(criterion, self.z, negligible=rounded.rows.tolist())
            satisfied._plain = self._plain
            yield satisfied
            yield from satisfied.alternatives()
            return
        points, start = [self], z
        while True:
            cleaned = on_bounds(
                measure, start, (self._plain if start is z else measure.rows(start)).w
            )
            if not np.array_equal(cleaned, z):
                points.append(self._at(criterion.original(cleaned)))
                yield points[-1]
            if start is not z or np.array_equal(
                start := without_small_distances(measure, z), z
            ):
                break
        for point in points[:]:
            for cleaned_point in point._without_noise():
                points.append(cleaned_point)
                yield cleaned_point
        if criterion.problem.reference_z is not None:
            yield from map(self._at, with_small_components(criterion.problem, self.z))
        for point in points:
            negligible = negligible_q(
                measure, *with_sides(criterion, point.z), point._rows_of_noise
            )
            if negligible.size:
                basis = criterion.problem.box.basis_at(point.z)
                yield from map(
                    self._at, block_pivoting_points(criterion.problem, basis)
                )
                counted = [*self.negligible, *negligible.tolist()]
                other = Point(criterion, point.z, negligible=counted)
                other._plain = point._plain
                yield other

    def _at(self, z: Vector) -> Point:
        """Return another point, for which the same entries count as 0."""
        return Point(self.criterion, z, negligible=self.negligible)

    def _without_noise(self) -> Iterator[Point]:
        """Yield points without idle multipliers and, in turn, with the reference point
        in the rows that noise alone violates, as what is removed from some rows may
        leave noise in others."""
        point, measure = self, self.criterion.measure
        for _ in range(MAX_CLEANINGS):
            before = point
            z = without_idle_multipliers(measure, point._inside, point._plain.w)
            if not np.array_equal(z, point._inside):
                point = self._at(self.criterion.original(z))
                yield point
            z = point._at_reference_in_noise
            if not np.array_equal(z, point._inside):
                point = self._at(self.criterion.original(z))
                yield point
            if point is before:
                return

    @property
    def _at_reference_in_noise(self) -> Vector:
        """Return z with the reference point in the rows that noise alone violates."""
        measure, moved = self.criterion.measure, np.array(self._inside)
        used = columns_of(measure, self._rows_of_noise)
        moved[used] = measure.reference[used]
        return moved

    @cached_property
    def _rows_of_noise(self) -> Indices:
        """Return the rows that are violated although all their terms may be rounding of
        0."""
        measure = self.criterion.measure
        z = self._inside
        rows = self._plain
        caps = measure.caps(z)
        small = (rows.full_terms <= ROW_ROUNDING * caps) & (caps < np.inf)
        small[list(self.negligible)] = False
        return (
            small
            & (
                measure.violations(z, rows.w)
                > measure.allowed(rows, caps, self.criterion.tol)
            )
        ).nonzero()[0]


def on_bounds(measure: Measure, z: Vector, w: Vector) -> Vector:
    """Return the nearest admissible z, on the bounds that it is closer to than w_i is
    to 0, in the units of M."""
    units, box = measure.data.units, measure.data.box
    powers = np.clip(units.rows + units.columns, -LARGEST_POWER, LARGEST_POWER)
    return box.on_bounds(z, w, np.exp2(-powers))[0]


@np.errstate(divide="ignore")
def without_small_distances(measure: Measure, z: Vector) -> Vector:
    """Return z with the reference point in place of components at distances from it
    that are small beside k and beside the largest in their component of M, and 0 in
    place of those that are as small themselves and may be 0; and with the reference
    point in all components whose rows it satisfies, as they are with the other z_i in
    place."""
    units, reference = measure.data.units, measure.reference
    distances, sizes = (
        np.log2(np.abs(z - reference)) - units.columns,
        measure.unsolved_sizes(z),
    )
    small = np.minimum(units.largest(distances, units.column_part), sizes)[
        units.column_part
    ]
    small += np.log2(SMALL_DISTANCE)
    is_solved = ~(sizes > -np.inf)
    on_reference = np.where(distances <= small, reference, z)
    if measure.data.reference_z is not None:
        tiny = np.log2(np.abs(on_reference)) - units.columns <= small
        on_reference = np.where(
            tiny & (measure.data.box.project(np.zeros_like(z)) == 0), 0.0, on_reference
        )
    while True:
        cleaned = np.where(is_solved[units.column_part], reference, on_reference)
        violated = is_solved[units.row_part] & (
            measure.violations(cleaned, measure.reference_w) > 0
        )
        if not violated.any():
            return cleaned
        is_solved[units.row_part[violated]] = False


def without_idle_multipliers(measure: Measure, z: Vector, w: Vector) -> Vector:
    """Return z with 0 in place of those z_j that alone make up the w_i of a z_i between
    its bounds.

    In a program, z_j is the multiplier of a row between two sides, and z_i = s_i its
    value. Of the two, one is at its end: s_i at a side, if it is closer to that than
    z_j to 0 in the units of M, which `on_bounds` has seen to, or else z_j is 0. The row
    has no other term, so that it is violated completely by the smallest z_j."""
    data, box = measure.data, measure.data.box
    low, high = box.vectors(z.size)
    is_between = (low < z) & (z < high) & (data.q == 0) & (w != 0)
    if not is_between.any():
        return z
    rows = is_between.nonzero()[0]
    M = data.M[rows]
    number = (
        np.bincount(M.nonzero()[0], minlength=rows.size)
        if is_sparse(M)
        else np.count_nonzero(M, axis=1)
    )
    columns = columns_of(measure, rows[np.equal(number, 1)])
    columns = columns[(low[columns] <= 0) & (high[columns] >= 0)]
    freed: Vector = np.array(z)
    freed[columns] = 0.0
    return freed


def columns_of(measure: Measure, rows: Indices) -> Indices:
    """Return the components that these rows of M use."""
    M = measure.data.M
    if not is_sparse(M):
        return np.flatnonzero(M[rows].any(axis=0))
    parts = [slice(*M.indptr[i : i + 2]) for i in rows.tolist()]
    columns = [M.indices[part][M.data[part] != 0] for part in parts]
    return distinct(np.concatenate(columns)) if columns else rows


def with_sides(criterion: Criterion, z: Vector) -> tuple[Vector, Vector, Vector]:
    """Return q, and the same in the units in which z is measured, with the sides of
    two-sided rows that their values are at in place of the q_i of these rows, which are
    0; and z without these values."""
    problem = criterion.problem
    q = problem.q
    rest = z
    form = problem.block_form
    if form is not None and form.ranges:
        low, high = problem.box.vectors(z.size)
        values = np.arange(z.size - form.ranges, z.size)
        values = values[(z[values] == low[values]) | (z[values] == high[values])]
        q, rest = q.copy(), z.copy()
        # Each value occurs in its row alone.
        q[problem.M[values].nonzero()[1]] = -z[values]
        rest[values] = 0.0
    return q, criterion.units.w_inside(q), rest


@np.errstate(divide="ignore")
def negligible_q(
    measure: Measure, q: Vector, inside: Vector, z: Vector, rows: Indices
) -> Indices:
    """Return those of some violated rows, whose terms may be rounding of 0, whose q_i
    count as 0; all, or none. inside : q in the units of the measure."""
    parts = measure.data.units.row_part
    if (
        q.size <= FEW_UNKNOWNS
        or (q[rows] == np.rint(q[rows])).any()
        or z[columns_of(measure, rows)].any()
    ):
        return rows[:0]
    in_units = np.log2(np.abs(inside)) + measure.data.units.rows
    for sizes, number in product(
        (np.log2(np.abs(q)), in_units), distinct(parts[rows]).tolist()
    ):
        sorted_sizes = np.sort(sizes[(parts == number) & (inside != 0)])
        larger = sorted_sizes[
            sorted_sizes.size - int(np.ceil(LARGER_SHARE * sorted_sizes.size)) :
        ]
        if larger.size < MIN_LARGER:
            return rows[:0]
        factors = sizes[rows[parts[rows] == number]] - larger[0]
        if factors.min() < np.log2(ROUNDING_OF_Q[0]) or factors.max() > np.log2(
            ROUNDING_OF_Q[1]
        ):
            return rows[:0]
    return rows


def with_small_components(problem: Problem, z: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the states of z if it differs from z by rounding, and
    components of z are smaller than those of the reference point: as differences from
    it they lose digits."""
    largest = max(size(z), size(problem.reference_point))
    is_smaller = (np.abs(z) < np.abs(problem.reference_point)).any()
    for solution in islice(
        block_pivoting_points(problem, problem.box.basis_at(z)), 1 if is_smaller else 0
    ):
        if size(solution - z) <= SMALL_DISTANCE * largest:
            yield solution


def block_pivoting_points(problem: Problem, basis: States) -> Iterator[Vector]:
    """Yield the z of the first steps of block pivoting from a basis, as long as there
    are any."""
    with imports:
        from lcpcli.basis.exchanges import BasicSolutions
    solutions = BasicSolutions(problem)
    with suppress(SingularMatrix):
        for basic_solution in islice(
            solutions.block_principal_pivoting(basis), LITERAL_STEPS
        ):
            yield problem.box.project(basic_solution.z)
            if not solutions.count_violations(basic_solution):
                return


def without_wrong_solutions(problem: Problem) -> tuple[Problem, list[str]]:
    """Return the problem without its wrong known solutions, and what is wrong with each
    of these, as a clause.

    z is wrong if its relative residual is above ROUGH and no changes of its components
    by a unit in the last digit, which matter where M is ill-conditioned, make it
    satisfy the conditions on each z_i and w_i.
    """
    if not problem.solutions:
        return problem, []
    criterion = Criterion(problem)
    faults = [
        _fault(Point(criterion, z, is_admissible=False)) for z in problem.solutions
    ]
    valid_solutions = tuple(
        z for z, fault in zip(problem.solutions, faults, strict=True) if not fault
    )
    if len(valid_solutions) == len(faults):
        return problem, []
    names = (
        ["solution"]
        if len(faults) == 1
        else [f"solution[{k}]" for k in range(len(faults))]
    )
    complaints = [
        f"{name}: {fault}" for name, fault in zip(names, faults, strict=True) if fault
    ]
    return replace(problem, solutions=valid_solutions), complaints


@np.errstate(over="ignore", invalid="ignore")
def _fault(point: Point) -> str:
    problem = point.criterion.problem
    z = point.z
    w = point.w
    relative = point.relative_residuals
    lower = problem.lower
    upper = problem.upper
    if (relative <= ROUGH).all():
        return ""
    change = _last_digit(z)
    change_of_w = absolute_product(problem.M, change)
    wrong = (z < lower - change) | (z > upper + change)
    wrong |= ((w < -change_of_w) & (z < upper - change)) | (
        (w > change_of_w) & (z > lower + change)
    )
    if not wrong.any():
        return ""
    i = int(np.argmax(np.where(wrong, relative, 0.0)))
    worst = f"z{i + 1} = {z[i]:.3g} and w{i + 1} = {w[i]:.3g}"
    return (
        f"is not a solution: its residual is {point.residual:.2g}, with {worst}; it "
        "is ignored"
    )


def _last_digit(z: Vector) -> Vector:
    """Return one unit in the last digit of each z_i, if all have as many digits or
    decimals as the longest."""
    spelt = [
        repr(value).removesuffix(".0").partition("e")
        for value in np.abs(z[z != 0]).tolist()
    ]
    if not spelt:
        return np.zeros(z.size)
    digits = max(len(text.replace(".", "").strip("0")) for text, _, _ in spelt)
    decimals = max(
        len(text.partition(".")[2]) - int(power or 0) for text, _, power in spelt
    )
    digits = min(max(digits, MIN_GIVEN_DIGITS), MAX_GIVEN_DIGITS)
    coarsest = 10.0 ** (1 - MIN_GIVEN_DIGITS) * float(np.abs(z).max())
    return 10.0 ** (1 - digits) * np.abs(z) + min(10.0**-decimals, coarsest)
