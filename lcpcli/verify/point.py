"""A point with its residuals, always for the original M and q; and whether the known
solutions that a file contains solve its problem, to the digits in which they are
written.

A method may leave a z_j of 1e-17 where the solution is 0, and a row all of whose terms
are of that kind violates the tolerance relative to its terms, however small these are
compared with the numbers of the problem. So alternative points are tested in which such
z_j are at their bounds or at the reference point, and multipliers of inactive rows are
0; each of them is measured as any other point.

The q of large problems from other programs has entries such as 2e-16 next to others of
1 that are rounding errors of 0, as they were computed as sums that cancel. An entry is
replaced by 0 if its row is violated, and

- |q_i| is the only term of the row, so that it is not the error of a z_j of that size,
  and it is no integer,
- it is at most ROW_ROUNDING times the cap of the row, as rounding errors of the other
  numbers of its component may be,
- both as stored and after scaling by R, it is by a factor in ROUNDING_OF_Q smaller than
  each of the LARGER_SHARE largest nonzero |q_j| of this component, of which there are
  at least MIN_LARGER: a few large numbers do not make the others rounding errors,
- and LITERAL_STEPS of block principal pivoting from the basis of the point find no
  solution for q as stored.

For up to FEW_UNKNOWNS unknowns exact arithmetic decides instead. Entries of M and
bounds of z are never replaced. Bounds of rows without entries may be replaced for any
number of unknowns, as they cannot have another meaning (`model.rounded_rows`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
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
from lcpcli.typing import BasisStatus, Indices, Vector
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

# Relative residual up to which a known solution is accepted, whatever its digits.
ROUGH = 1e-3
# Limits on the digits that a known solution is assumed to have: at least 4, as integers
# are exact, and at most 7, as it may have been computed in single precision.
MIN_GIVEN_DIGITS, MAX_GIVEN_DIGITS = 4, 7
MAX_CLEANINGS = 4  # successive removals of rounding errors from a point
MAX_NAMED = 3  # entries of q that a message names
LARGEST_ROUNDED = 2.0**900  # terms of a row from which its sum may overflow
# The ratios of an entry of q to the smallest of the larger entries for which it may be
# a rounding error of 0. Smaller entries are considered data.
ROUNDING_OF_Q = 1e-24, 1e-12
# The larger entries are this fraction of the nonzero entries of q in a component of M,
# and at least so many.
LARGER_SHARE, MIN_LARGER = 1 / 3, 8
LITERAL_STEPS = 8  # steps of block pivoting, each at the cost of a factorization
AcceptanceTest: TypeAlias = Callable[
    [Problem, Vector, float], "tuple[bool | None, Rows | None]"
]


class Criterion:
    """The tolerance that a point must meet to be a solution: its relative residual, as
    defined in `measure`, is at most tol.

    A problem with numbers so large or small that products overflow or underflow is
    measured after scaling by powers of two. If no such scaling exists, or z is out of
    range after it, sums are computed exactly wherever double precision may overflow.

    acceptance_test : a function of a mixed problem with sparse M and moderate numbers,
        a z within its bounds, and a tolerance. It returns whether they meet this
        criterion, and the rows of z, None for what it does not decide; by default there
        is none.
    """

    is_linear = True  # whether the problem is linear

    def __init__(
        self,
        problem: Problem,
        tol: float = 1e-10,
        literal: bool = False,
        acceptance_test: AcceptanceTest | None = None,
    ) -> None:
        self.problem = problem
        self.tol = tol
        # Whether residuals are measured without scaling.
        self.is_plain = problem.is_moderate or literal
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
        """Return the scaling in which residuals are measured, in general the
        identity.
        """
        problem = self.problem
        units = None if self.is_plain else changes.scale(problem)
        return (
            units
            if units is not None and units.is_exact
            else changes.Scaled(problem, problem)
        )

    @cached_property
    def data(self) -> Problem:
        """Return the problem after the scaling in which residuals are measured."""
        return self.units.problem

    @cached_property
    def measure(self) -> Measure:
        if self.is_plain or self.units.is_identity:
            return Measure(self.problem)
        return Measure(self.data, self.units.z_inside)

    def for_point(self, z: Vector) -> Criterion:
        """Return the criterion with which a point is measured: one without scaling if z
        is out of range after scaling.
        """
        if self.is_plain or self.units.is_identity:
            return self
        if np.array_equal(self.units.z_outside(self.units.z_inside(z)), z):
            return self
        return Criterion(self.problem, self.tol, literal=True)

    def point(self, z: Vector) -> Point:
        return Point(self, z)

    def original(self, z: Vector) -> Vector:
        """Return a scaled z in the scale of the problem, projected on its bounds."""
        return self.problem.box.project(
            z if self.units.is_identity else self.units.z_outside(z)
        )

    @np.errstate(all="ignore")
    def residuals(self, Z: Vector) -> tuple[list[float], list[bool]]:
        """Return the natural residuals of m points, shape (m, n), and whether each is
        at the level of rounding errors.
        """
        inside = self.units.z_inside(Z)
        rows = self.measure.rows(inside)
        natural = [
            size(self.problem.box.gaps(z, w))
            for z, w in zip(Z, self.units.w_outside(rows.w), strict=True)
        ]
        return natural, self.measure.is_rounding(inside, rows).tolist()

    @cached_property
    def reference_solves(self) -> bool:
        """Return whether the reference point solves the problem, for all possible
        rounding errors in its w.
        """
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
        """Return the caps at the reference point, in the scale of the problem."""
        return self.units.w_outside(self.measure.caps(self.data.reference_point))

    @np.errstate(all="ignore")
    def bound(self, F: Vector) -> float:
        """Return the size of F(x) = M z - w' + q, with the z and w' of x, relative to
        the caps at the reference point. If it is small, so is the natural residual of
        z, as t -> mid(l, u, t) is nonexpansive.
        """
        return size(F / self._caps) if np.count_nonzero(F) else 0.0


class Point:
    """A z of shape (n,) with its residuals, each computed when it is first read.

    w : M z + q, rounded only once in rows where rounding errors decide whether z solves
        the problem.
    residual : the natural residual |min(z, w)|_inf in the scale of the problem, zero
        exactly at the solutions; with bounds, min(z, w) is z - mid(l, u, z - w) = max(z
        - u, min(z - l, w)).
    relative_residual : as defined in `measure`. It is infinite for NaN and overflow,
        and for a z beyond a bound, unless l_i = u_i.
    is_admissible : whether z is known to lie within its bounds, as iterates do;
        otherwise this is checked.
    negligible : the indices of the entries of q that are replaced by 0, as they are
        rounding errors (see above).
    """

    is_linear = True  # exact arithmetic may decide
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
        is_plain = self.criterion.is_plain
        self._inside = z if is_plain else self.criterion.units.z_inside(z)
        is_within_bounds = is_admissible and is_finite(z)
        self._beyond = (
            None
            if is_within_bounds
            else (z != criterion.problem.box.project(z)) | ~np.isfinite(z)
        )
        self._solves: bool | None = None

    @classmethod
    def of_solution(cls, criterion: Criterion, z: Vector) -> Point:
        """Return the point of a z that is known to meet the criterion."""
        point = cls.__new__(cls)
        point.criterion = criterion
        point.z = z
        point._inside = z
        point._beyond = None
        point._solves = True
        return point

    @cached_property
    def _plain(self) -> Rows:
        """Return the rows by one floating-point product; errors are infinite if sums
        may overflow.
        """
        rows = self.criterion.measure.rows(self._inside, self._product)
        return rows._replace(
            error=np.where(rows.full_terms < LARGEST_ROUNDED, rows.error, np.inf)
        )

    @cached_property
    @np.errstate(all="ignore")
    def _rows(self) -> Rows:
        """Return the rows, with sums that are rounded only once where rounding errors
        matter.
        """
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
        """Return w by one floating-point product, reused if it has been computed."""
        rows = self.__dict__.get("_plain")
        if rows is not None:
            return self.criterion.units.w_outside(rows.w)
        return (
            self.criterion.problem.w(self.z) if self._product is None else self._product
        )

    def solves(self) -> bool:
        """Return whether the relative residual is at most the tolerance; cheap bounds
        on it decide if they can.
        """
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
            and not is_sparse(problem.M)
            and (problem.n > FEW_UNKNOWNS or problem.facts.near_units is not None)
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
        """Return whether the natural residual is at most this fraction of that of 0, or
        at the level of rounding errors.
        """
        problem, w = self.criterion.problem, self.plain_w
        at_0 = problem.box.gaps(np.zeros(problem.n), problem.q)
        beyond = np.abs(problem.box.gaps(self.z, w)) - share * size(at_0)
        if (beyond <= 0).all():
            return True
        terms = np.abs(problem.q) + absolute_product(problem.M, np.abs(self.z))
        return bool((beyond <= ROW_ROUNDING * terms).all())

    @property
    def counted_as_0(self) -> str:
        """Return which entries of q are replaced by 0, as a clause for the user; "" if
        none are.
        """
        named = self._entries_in_words
        if self.rounded_rows is not None:
            named.append("sides of empty rows")
        return f"counting {listed(named)} as 0" if named else ""

    @property
    def remark(self) -> str:
        """Return which entries of q are replaced by 0, and which rows are violated as
        stored, as a clause for the user; "" if there are none.
        """
        if not self.negligible:
            return ""
        said = (
            [f"counting {listed(self._entries_in_words)} as 0"]
            if self._entries_in_words
            else []
        )
        if self.rounded_rows is not None:
            said.append(self.rounded_rows.statement)
        return "; ".join(said)

    @property
    def rounded_rows(self) -> RoundedRows | None:
        """Return the rows without entries that are considered satisfied, None if there
        are none.
        """
        return self.criterion.problem.rounded_rows if self.negligible else None

    @property
    def _entries_in_words(self) -> list[str]:
        """Return in words, with their values, the first entries of q that are replaced
        by 0, and how many more there are. Rows without entries in M are not mentioned.
        """
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
        """Return the scaled z, with z_i replaced by l_i where l_i = u_i."""
        box = self.criterion.data.box
        return (
            self._inside
            if self._beyond is None
            else np.where(box.fixed, box.lower, self._inside)
        )

    @cached_property
    @np.errstate(all="ignore")
    def distances_beyond(self) -> Vector | float:
        """Return by how much z is beyond its bounds: relative as in `Measure.distances`
        where l_i = u_i, otherwise infinity or 0.
        """
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
        """Return a residual for any z that a solver with one tolerance for all rows can
        reach: the largest v_i / c_i of z after projection on the bounds, or the
        distance to that projection, as `is_near` measures it, if that is larger.
        """
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
        """Return whether another point differs by at most tol, by default its
        tolerance, relative to the natural sizes of components.
        """
        max_distance = self.criterion.tol if tol is None else tol
        distances = self.criterion.measure.distances(other._inside, self._inside)
        return bool((distances <= max_distance + ROUNDING).all())

    @np.errstate(all="ignore")
    def nearly_solves(self) -> bool:
        """Return whether no violation is large by `Measure.is_near`, so that further
        tests of the point are worthwhile.
        """
        moved = self.criterion.problem.from_reference(self.z).any()
        return bool(moved and self.criterion.measure.is_near(self._inside, self._plain))

    @each_step(all="ignore")
    def alternatives(self) -> Generator[Point, None, None]:
        """Yield points that differ from this one by rounding errors of zeros and by
        what the tolerance of a method may leave (see above): first points with other
        components, then those for which entries of q are replaced by 0.
        """
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
        """Return another point for which the same entries of q are replaced by 0."""
        return Point(self.criterion, z, negligible=self.negligible)

    def _without_noise(self) -> Iterator[Point]:
        """Yield points without idle multipliers and, alternately, with the reference
        point in the rows that only rounding errors violate, as removing them from some
        rows may leave them in others.
        """
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
        """Return z with the reference point in the rows that only rounding errors
        violate.
        """
        measure, moved = self.criterion.measure, np.array(self._inside)
        used = columns_of(measure, self._rows_of_noise)
        moved[used] = measure.reference[used]
        return moved

    @cached_property
    def _rows_of_noise(self) -> Indices:
        """Return the rows that are violated although all their terms may be rounding
        errors of 0.
        """
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
    """Return the closest z within its bounds after each z_i is moved to a bound that it
    is closer to than w_i is to 0, both scaled by R and C.
    """
    units, box = measure.data.units, measure.data.box
    powers = np.clip(units.rows + units.columns, -LARGEST_POWER, LARGEST_POWER)
    return box.on_bounds(z, w, np.exp2(-powers))[0]


@np.errstate(divide="ignore")
def without_small_distances(measure: Measure, z: Vector) -> Vector:
    """Return z cleaned of small distances from the reference point.

    Components whose scaled distance is below SMALL_DISTANCE times both k and the
    largest distance in their component of M are set to the reference point; those that
    are as small themselves, and may be 0, are set to 0. Components of M whose rows are
    all satisfied at the reference point, for fixed other z_i, are set to it.
    """
    units, reference = measure.data.units, measure.reference
    distances = np.log2(np.abs(z - reference)) - units.columns
    sizes = measure.unsolved_sizes(z)
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


# Without it: `check` refuses solutions of programs from other solvers in which rows
# strictly between two sides have multipliers of 1e-11.
def without_idle_multipliers(measure: Measure, z: Vector, w: Vector) -> Vector:
    """Return z with 0 for those z_j that are the only terms of the w_i of a z_i
    strictly between its bounds.

    In a program, z_j is the multiplier of a row with two sides, and z_i = s_i its
    value. Complementarity requires one of them to be at its bound: s_i at a side, if it
    is closer to that than z_j is to 0 after scaling, as `on_bounds` decides; otherwise
    z_j = 0. As the row has no other term, even the smallest z_j violates it completely.
    """
    data, box = measure.data, measure.data.box
    low, high = box.vectors(z.size)
    is_between = (low < z) & (z < high) & (data.q == 0) & (w != 0)
    if not is_between.any():
        return z
    rows = is_between.nonzero()[0]
    if is_sparse(data.M):
        entries_before = np.append(0, np.cumsum(data.M.data != 0))
        number = np.diff(entries_before[data.M.indptr])[rows]
    else:
        number = np.count_nonzero(data.M[rows], axis=1)
    columns = columns_of(measure, rows[number == 1])
    columns = columns[(low[columns] <= 0) & (high[columns] >= 0)]
    freed: Vector = np.array(z)
    freed[columns] = 0.0
    return freed


def columns_of(measure: Measure, rows: Indices) -> Indices:
    """Return the indices j of the z_j that these rows of M contain."""
    M = measure.data.M
    if not is_sparse(M):
        return np.flatnonzero(M[rows].any(axis=0))
    parts = [slice(*M.indptr[i : i + 2]) for i in rows.tolist()]
    columns = [M.indices[part][M.data[part] != 0] for part in parts]
    return distinct(np.concatenate(columns)) if columns else rows


def with_sides(criterion: Criterion, z: Vector) -> tuple[Vector, Vector, Vector]:
    """Return q; q after the scaling in which z is measured; and z. In them, two-sided
    rows whose value is at a side have that side instead of q_i, which is 0, and 0
    instead of the value.
    """
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
    """Return the rows, among violated ones whose terms may be rounding errors of 0,
    whose q_i are replaced by 0: all of them, or none.

    inside : q after the scaling of the measure.
    """
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


# Without it: control in 3000 unknowns stalls where interior is called by name.
def with_small_components(problem: Problem, z: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the basis of z if it differs from z only by rounding,
    and some components of z are smaller than those of the reference point: computed as
    differences from it they lose digits.
    """
    largest = max(size(z), size(problem.reference_point))
    is_smaller = (np.abs(z) < np.abs(problem.reference_point)).any()
    for solution in islice(
        block_pivoting_points(problem, problem.box.basis_at(z)), 1 if is_smaller else 0
    ):
        if size(solution - z) <= SMALL_DISTANCE * largest:
            yield solution


def block_pivoting_points(problem: Problem, basis: BasisStatus) -> Iterator[Vector]:
    """Yield the z of at most LITERAL_STEPS steps of block principal pivoting from a
    basis; the pivoting stops at a solution.
    """
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
    """Return the problem without its wrong known solutions, and a clause for each of
    these that says why.

    z is wrong if its relative residual is above ROUGH, and no changes of its components
    by 1 in their last digit, which matter if M is ill-conditioned, satisfy the
    conditions on each z_i and w_i.
    """
    if not problem.solutions:
        return problem, []
    criterion = Criterion(problem)
    reasons = [
        _why_wrong(Point(criterion, z, is_admissible=False)) for z in problem.solutions
    ]
    valid_solutions = tuple(
        z for z, why in zip(problem.solutions, reasons, strict=True) if not why
    )
    if len(valid_solutions) == len(reasons):
        return problem, []
    names = (
        ["solution"]
        if len(reasons) == 1
        else [f"solution[{k}]" for k in range(len(reasons))]
    )
    complaints = [
        f"{name}: {why}" for name, why in zip(names, reasons, strict=True) if why
    ]
    return problem.having(solutions=valid_solutions), complaints


@np.errstate(over="ignore", invalid="ignore")
def _why_wrong(point: Point) -> str:
    """Return why a known solution is wrong, as a clause; "" if it is not."""
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
    """Return a 1 in the last digit of each z_i, if all have as many significant
    digits, or decimals, as the longest one.
    """
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
