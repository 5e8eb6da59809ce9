"""Changes of variables, each with its inverse transformation: a problem with other
scaling, or with its reference point moved to 0, and several changes one after another;
others are in `presolve`. And a mixed problem as an LCP, for methods that accept only z
>= 0: finite lower bounds are shifted to 0, variables with only an upper bound are
reflected, free ones are split by one common extra column, z_F = p - t e (which keeps M
positive semidefinite if it is), and a box gets its upper bound as a row, with a
multiplier v: [M I; -I 0]. Fixed variables are eliminated.

Sides so far from 0 that they are likely to mean infinite ones, as 1e20 and 1e30 do,
become infinite if the user says so. Otherwise they are sides, but a method does better
if it first solves the problem `relaxed` (see `far_sides`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import ROW_ROUNDING, are_moderate, in_range, sizes
from lcpcli.linalg.matrices import is_sparse, product, unit_columns
from lcpcli.linalg.units import LARGEST_POWER, equilibrate
from lcpcli.model.box import (
    BASIC,
    LARGEST_X,
    LOWER,
    UPPER,
    Box,
    as_intervals,
    transformed_bound,
)
from lcpcli.model.far_sides import FarSides
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Indices, Mask, Vector

# Far sides that are not left out are moved to this multiple of the largest other side;
# the basis of a solution is almost always the same.
NEARER = 1e5
CLEAR = 1e-9  # relative to the terms of w: above this it is no rounding
MAX_RATIO = 1e3  # of two moved sides: a larger ratio is reduced to this by a power
# Sizes up to which sides and bounds, and entries of the matrix, make no difference to
# the methods: for programs, of which costs and sides may differ by as much, and for
# other problems, whose methods hardly depend on the size of q.
USUAL_IN_PROGRAM, USUAL = 2.0**10, 2.0**30
# Real programs have entries up to 2^23, and some, such as QPILOTNO, are solved by PIQP
# in the given units alone.
USUAL_ENTRY = 2.0**28
MODERATE_POWER = 300  # the power of two up to which R q is usually left unchanged


@dataclass(eq=False, repr=False)
class Change:
    """A problem in variables other than the original ones, with the transformation and
    its inverse: `start` and `back` of x, `residual` back of F, and `multipliers` back
    of Farkas' y, if it proves the original problem infeasible too; unless a subclass
    says otherwise, they remain the same. Where both are the same problem, it is the
    identity."""

    problem: Problem
    original: Problem
    # Whether a basis of one problem is also that of the other.
    keeps_states: ClassVar[bool] = False

    @property
    def is_identity(self) -> bool:
        return self.problem is self.original

    @property
    def is_exact(self) -> bool:
        """Return whether it is certain that nothing was rounded or lost, so that both
        problems have the same solutions."""
        return self.is_identity

    def start(self, x: Vector) -> Vector:
        return x

    def back(self, x: Vector) -> Vector:
        return x

    def residual(self, F: Vector) -> Vector:
        return F

    def multipliers(self, y: Vector) -> Vector:
        return self.residual(y)


@dataclass(eq=False, repr=False)
class Composed(Change):
    """A change of variables after another one; they are undone in reverse."""

    first: Change
    second: Change

    @property
    def is_exact(self) -> bool:
        return self.first.is_exact and self.second.is_exact

    def start(self, x: Vector) -> Vector:
        return self.second.start(self.first.start(x))

    def back(self, x: Vector) -> Vector:
        return self.first.back(self.second.back(x))

    def residual(self, F: Vector) -> Vector:
        return self.first.residual(self.second.residual(F))

    def multipliers(self, y: Vector) -> Vector:
        return self.first.multipliers(self.second.multipliers(y))


def composed(problem: Problem, *steps: Callable[[Problem], Change]) -> Change:
    """Return the change that consists of these, each of which applies to the problem
    after the one before."""
    change = Change(problem, problem)
    for step in steps:
        later = step(change.problem)
        change = Composed(later.problem, problem, change, later)
    return change


@dataclass(eq=False, repr=False)
class Scaled(Change):
    """The problem of R M C, R q, l / C and u / C, with its inverse transformation: z =
    C z', w = w' / R, F = F' / R; without R and C it is the problem itself, and no
    vector is copied. If R and C are powers of two, neither direction rounds."""

    R: Any = None
    C: Any = None

    def z_inside(self, z: Vector) -> Vector:
        return z if self.C is None else z / self.C

    def z_outside(self, z: Vector) -> Vector:
        return z if self.C is None else self.C * z

    def w_inside(self, w: Vector) -> Vector:
        return w if self.R is None else self.R * w

    def w_outside(self, w: Vector) -> Vector:
        return w if self.R is None else w / self.R

    def residual(self, F: Vector) -> Vector:
        return self.w_outside(F)

    def start(self, x: Vector) -> Vector:
        z = self.original.box.z_of(x)
        return 0.5 * (self.z_inside(z) - self.w_inside(z - 2 * x))

    @property
    def is_exact(self) -> bool:
        """Return whether nothing over- or underflows, where R and C are powers of
        two."""
        if self.is_identity:
            return True
        with np.errstate(all="ignore"):
            back = (
                matrices.scaled(self.problem.M, 1 / self.R, 1 / self.C)
                - self.original.M
            )
            box, scaled_box = self.original.box, self.problem.box
            keeps_bounds = np.all(scaled_box.lower * self.C == box.lower) and np.all(
                scaled_box.upper * self.C == box.upper
            )
            keeps_q = np.array_equal(self.problem.q / self.R, self.original.q)
            return bool(keeps_q and keeps_bounds and abs(back).max() == 0)

    def multipliers(self, y: Vector) -> Vector:
        """Return R y times a power of two that keeps it in range, as `in_range` chooses
        it."""
        return in_range(y, self.R)

    @np.errstate(over="ignore")
    def back(self, x: Vector) -> Vector:
        """Return x in the original variables: infinite where z overflows, and the most
        negative number where w does."""
        z = self.problem.box.z_of(x)
        return np.maximum(
            0.5 * (self.z_outside(z) - self.w_outside(z - 2 * x)), -LARGEST_X
        )


def scale(problem: Problem, moderate: int = MODERATE_POWER) -> Scaled:
    """Return the equilibrated problem; M is copied once. An R q whose largest entry has
    a power of two beyond `moderate` is scaled to size about 1. Where no powers of two
    in range achieve that, nothing changes."""
    R, C = equilibrate(problem.M, problem.q, problem.row_maxima)
    rows, columns = np.log2(R), np.log2(C)
    size = float(
        (np.frexp(problem.q)[1] + rows).max(where=problem.q != 0, initial=-np.inf)
    )
    with np.errstate(over="ignore"):
        # R q comes into range as far as R and C allow.
        if abs(size) > moderate and size != -np.inf:
            low = max(-LARGEST_POWER - rows.min(), columns.max() - LARGEST_POWER)
            high = min(LARGEST_POWER - rows.max(), columns.min() + LARGEST_POWER)
            t = np.exp2(np.clip(-size, low, high) if low <= high else 0.0)
            R, C = R * t, C / t
        is_in_range = np.isfinite(R * problem.q).all()
    return (
        in_units(problem, R, C)
        if is_in_range
        else Scaled(problem, problem, np.ones(R.size), np.ones(R.size))
    )


def in_units(problem: Problem, R: Vector, C: Vector) -> Scaled:
    """Return the problem scaled by these positive diagonals, each of shape (n,); itself
    if all are 1."""
    if not (np.count_nonzero(R != 1.0) or np.count_nonzero(C != 1.0)):
        return Scaled(problem, problem, R, C)
    M, q = matrices.scaled(problem.M, R, C), R * problem.q
    # So that it is not copied again.
    (M.data if is_sparse(M) else M).setflags(write=False)
    with np.errstate(over="ignore"):
        lower, upper = (
            transformed_bound(bound / C, bound)
            for bound in (problem.lower, problem.upper)
        )
    return Scaled(Problem(M, q, lower=lower, upper=upper), problem, R, C)


def is_far_from_one(problem: Problem) -> bool:
    """Return whether numbers of the problem are so large or small that products of a
    few over- or underflow."""
    return not all(
        map(
            are_moderate,
            (problem.M.data if is_sparse(problem.M) else problem.M, problem.q),
        )
    )


def is_of_usual_size(problem: Problem) -> bool:
    """Return whether the numbers of the problem are of usual size, so that no scaling
    needs to be computed: all nonzero ones but single entries of M or, for a program,
    the medians of its costs and of its sides."""
    smallest, largest = sizes(problem.row_maxima)
    if largest > USUAL_ENTRY or smallest < 1 / USUAL_ENTRY:
        return False
    block_form = problem.block_form
    if block_form is not None:
        k, limit = block_form.variables, USUAL_IN_PROGRAM
        sides = _median_size(problem.q[k:])
        bounds = problem.box.vectors(problem.n) if sides == 1.0 else ()
        medians = sides, _median_size(problem.q[:k]), *map(_median_size, bounds)
        return all(1 / limit <= size <= limit for size in medians)
    smallest, largest = problem.sizes_of_q
    if problem.is_mixed:
        ends = np.concatenate(problem.box.vectors(problem.n))
        least, most = sizes(ends[np.isfinite(ends)])
        smallest, largest = min(smallest, least), max(largest, most)
    return bool(smallest >= 1 / USUAL and largest <= USUAL)


def _median_size(values: Vector) -> float:
    """Return the median of the nonzero finite sizes; 1 if there are none."""
    found = np.abs(values[(values != 0) & np.isfinite(values)])
    return median(found) if found.size else 1.0


def median(values: Vector) -> float:
    """Return the median of at least one value, without the masked arrays that
    numpy.median loads."""
    ordered = np.sort(values)
    middle = ordered[(values.size - 1) // 2], ordered[values.size // 2]
    return float(middle[0] / 2 + middle[1] / 2)


class Shifted(Change):
    """The problem of M, M z + q and l - z <= z' <= u - z for the reference point z,
    with its inverse transformation."""

    keeps_states = True

    def start(self, x: Vector) -> Vector:
        return x - self.original.reference_point / 2

    def back(self, x: Vector) -> Vector:
        """Return the x of the original problem; a z at a bound stays at that bound."""
        z = self.problem.box.z_of(x)
        at = self.original.box.add_within(
            z, self.problem.box, self.original.reference_point
        )
        return np.clip(0.5 * (at - (z - 2 * x)), -LARGEST_X, LARGEST_X)

    @property
    def is_exact(self) -> bool:
        return self.original.has_small_integers


def shifted(problem_before: Problem) -> Change:
    """Return the problem with its reference point moved to 0; M is shared. Where it is
    0, nothing changes."""
    if (reference_z := problem_before.reference_z) is None:
        return Change(problem_before, problem_before)
    with np.errstate(over="ignore"):
        box = problem_before.box.shifted_by(reference_z)
    terms = np.abs(problem_before.q) + matrices.absolute_product(
        problem_before.M, np.abs(reference_z)
    )
    problem = Problem(
        problem_before.M, problem_before.q_ref, lower=box.lower, upper=box.upper
    )
    new_fields: dict[str, Any] = {"terms_of_q": terms}
    if problem_before.block_form is None:  # else facts are those of the form
        new_fields["facts"] = problem_before.facts
    return Shifted(problem.having(**new_fields), problem_before)


@dataclass(eq=False, repr=False)
class StandardForm(Change):
    """An LCP whose solutions are those of a mixed problem, with its inverse
    transformation.

    original : the mixed problem, n unknowns z.
    problem : the LCP, with unknowns p >= 0 for the variables `kept_columns`, then t if
        some are free, then v for those `boxed`, which remain: z = corner + sign p
        - t on free ones; w' = sign w + v, - sum of free w, upper - lower - p.
    """

    kept_columns: Indices
    boxed: Indices
    sign: Vector

    # Methods that need this form use no start.
    def start(self, x: Vector) -> Vector:  # noqa: ARG002
        return np.zeros(self.problem.n)

    @property
    def is_exact(self) -> bool:
        return self.original.has_small_integers

    def back(self, x: Vector) -> Vector:
        unknowns = self.problem.box.z_of(x)
        w_of_form = self.problem.box.reflected(x) - x
        w = np.zeros(self.original.n)
        w[self.kept_columns] = w_of_form[: self.kept_columns.size]
        w[self.boxed] -= unknowns[unknowns.size - self.boxed.size :]
        z = self.original.box.project(
            self.original.box.corner + self.multipliers(unknowns)
        )
        return self.original.box.x_of(z, self.sign * w)

    def multipliers(self, y: Vector) -> Vector:
        """Return a Farkas vector y for the mixed problem from one for the LCP; z -
        corner is mapped likewise."""
        multipliers = np.zeros(self.original.n)
        multipliers[self.kept_columns] = (
            self.sign[self.kept_columns] * y[: self.kept_columns.size]
        )
        if self.original.box.free.any():
            multipliers[self.original.box.free] -= y[self.kept_columns.size]
        return multipliers

    @property
    def are_parts_of_free(self) -> Mask:
        """Return which unknowns of the LCP are parts of free variables: the p of these,
        and t."""
        free = self.original.box.free
        of_v = np.zeros(self.problem.n, dtype=bool)
        of_v[: self.kept_columns.size] = np.broadcast_to(free, self.original.n)[
            self.kept_columns
        ]
        of_v[self.kept_columns.size : self.problem.n - self.boxed.size] = True
        return of_v

    def restricted(self, active: Mask, inactive: Mask) -> tuple[Box, Box] | None:
        """Return the bounds of z, and bounds that represent the signs of w, if those
        unknowns of the LCP that are active have w' = 0, and those that are inactive are
        0; None if no z is within such bounds."""
        box, n = self.original.box, self.original.n
        lower, upper = box.vectors(n)
        basic, at_corner, at_upper, below, has_v = np.zeros((5, n), dtype=bool)
        kept_rows = slice(self.kept_columns.size)
        v = slice(self.problem.n - self.boxed.size, None)
        basic[self.kept_columns] = active[kept_rows]
        at_corner[self.kept_columns] = inactive[kept_rows]
        at_upper[self.boxed] = active[v]
        below[self.boxed] = inactive[v]
        has_v[self.boxed] = True
        at_corner &= ~box.free
        low, high = (np.where(at_corner, box.corner, bound) for bound in (lower, upper))
        low = np.where(at_upper, upper, low)
        if (low > high).any():
            return None
        # Where w >= 0 is required, and where w <= 0 is.
        rises = np.where(has_v, below, basic | np.isinf(upper))
        falls = basic | np.isinf(lower)
        return Box(low, high), Box(
            np.where(falls, -np.inf, 0.0), np.where(rises, np.inf, 0.0)
        )


def standard_form(original: Problem) -> StandardForm:
    """Return the LCP of a problem, itself if it is one, else with M copied. If all
    variables are fixed, they are treated as boxed."""
    if not original.is_mixed:
        return StandardForm(
            original, original, np.arange(original.n), np.arange(0), np.ones(original.n)
        )
    box = original.box
    kept_columns = (
        np.flatnonzero(~box.fixed) if not box.fixed.all() else np.arange(original.n)
    )
    low, high = np.isfinite(box.lower), np.isfinite(box.upper)
    boxed = kept_columns[(low & high)[kept_columns]]
    sign = np.where(high & ~low, -1.0, 1.0)
    q = original.w(box.corner) if box.corner.any() else original.q
    M = matrices.scaled(
        original.M[kept_columns][:, kept_columns],
        sign[kept_columns],
        sign[kept_columns],
    )
    q = sign[kept_columns] * q[kept_columns]
    if box.free.any():  # E'ME and E'q for E = [I, -e_F]
        free = box.free[kept_columns]
        column, row = -(M @ free.astype(float)), -(free.astype(float) @ M)
        corner = np.array([[-float(column[free].sum())]])
        M = matrices.stack([[M, column[:, np.newaxis]], [row[np.newaxis], corner]])
        q = np.append(q, -q[free].sum())
    if boxed.size:
        E = unit_columns(q.size, np.searchsorted(kept_columns, boxed), is_sparse(M))
        zero = (
            matrices.compressed((boxed.size, boxed.size))
            if is_sparse(M)
            else np.zeros((boxed.size, boxed.size))
        )
        M = matrices.stack([[M, E], [-E.T, zero]])
        q = np.append(q, box.upper[boxed] - box.lower[boxed])
    return StandardForm(
        Problem(M, q, name=original.name), original, kept_columns, boxed, sign
    )


def with_infinity(problem: Problem, infinity: float) -> Problem:
    """Return the problem without bounds of at least the size `infinity` and, for a
    block form, without such row sides.

    Raises ProblemError for a lower bound of at least `infinity`, or an upper bound of
    at most minus `infinity`.
    """
    origin = problem.origin
    before = conditions_of(problem)
    kept_columns = np.arange(problem.n)
    block_form = problem.block_form
    blocks = None if block_form is None else block_form.blocks(before)
    if block_form is not None and blocks is not None:
        changed, first = blocks.with_infinity(infinity), problem.n - block_form.ranges
        after = changed.conditions()
        kept_columns = np.append(
            kept_columns[:first], first + np.flatnonzero(changed.ranges[blocks.ranges])
        )
        origin = block_form.with_ranges(kept_columns.size - first)
    else:
        low, high = as_intervals(
            ("lower", "upper"), before.lower, before.upper, problem.n, infinity=infinity
        )
        after = before._replace(lower=low, upper=high)
    if all(map(np.array_equal, after[1:], before[1:])):
        return problem
    starts = {
        name: start[kept_columns]
        for name in ("x0", "x1")
        if (start := getattr(problem, name)) is not None
    }
    solutions = tuple(z[kept_columns] for z in problem.solutions)
    return replace(
        problem,
        **after._asdict(),
        origin=origin,
        verdict="",
        solutions=solutions,
        **starts,
    )


@dataclass(eq=False, repr=False)
class Relaxed(Change):
    """A problem without far sides, in the variables of the original one, where the
    multipliers of rows without any other side are fixed at 0. The two problems share
    only the solutions within the sides.

    sides : the far sides that are dropped. moved_sides : the other far sides. is_moved
        : whether these have been moved closer; then the two problems share only the
        bases of their solutions, if these do not depend on how far away such a side is.
    """

    sides: FarSides
    moved_sides: FarSides
    is_moved: bool = True
    keeps_states = True

    def start(self, x: Vector) -> Vector:
        return np.where(self.sides.rows, 0.0, x)

    @np.errstate(invalid="ignore")  # of infinite bounds, which have not moved
    def back(self, x: Vector) -> Vector:
        relaxed, box = self.problem, self.original.box
        basis = relaxed.box.basis_of(x)
        lower, upper = box.vectors(x.size)
        x = np.where(basis == BASIC, x, x - (self.original.q - relaxed.q) / 2)
        at_lower = self.moved_sides.lower & (basis == LOWER)
        at_upper = self.moved_sides.upper & (basis == UPPER)
        x = np.where(at_lower, x + (lower - relaxed.lower) / 2, x)
        return np.where(at_upper, x + (upper - relaxed.upper) / 2, x)

    @np.errstate(all="ignore")
    def met(self, x: Vector) -> FarSides:
        """Return the sides that the z and w of an x violate."""
        z, (lower, upper) = self.problem.box.z_of(x), self.original.box.vectors(x.size)
        w, sides = self.original.w(z), self.sides
        has_wrong_sign = np.where(upper == np.inf, w < 0, w > 0)
        return sides._replace(
            lower=sides.lower & (z < lower),
            upper=sides.upper & (z > upper),
            rows=sides.rows & has_wrong_sign,
        )

    @np.errstate(all="ignore")
    def idle(self, x: Vector) -> FarSides:
        """Return those far sides of this problem without which an x would solve it as
        well: the w of their unknowns are rounding of 0."""
        relaxed, z = self.problem, self.problem.box.z_of(x)
        terms = matrices.absolute_product(relaxed.M, np.abs(z)) + np.abs(relaxed.q)
        is_rounding = np.abs(relaxed.w(z)) <= CLEAR * terms
        moved_sides, is_zero = self.moved_sides, z == 0
        return FarSides(
            moved_sides.lower & is_rounding,
            moved_sides.upper & is_rounding,
            moved_sides.rows & is_zero,
        )

    @np.errstate(all="ignore")
    def needed(self, y: Vector) -> FarSides:
        """Return those sides without which a y proves that there is no z, and with
        which it may not."""
        columns, sides = product(self.original.M.T, y), self.sides
        terms = matrices.absolute_product(self.original.M.T, np.abs(y))
        columns = np.where(np.abs(columns) > ROW_ROUNDING * terms, columns, 0.0)
        return sides._replace(
            lower=sides.lower & (y < 0),
            upper=sides.upper & (y > 0),
            # A z moves by -M'y, towards the side or away from it.
            rows=sides.rows & (self.original.q * columns > 0),
        )


def relaxed(
    problem: Problem, sides: FarSides | None = None, is_moved: bool = True
) -> Change:
    """Return the problem without far sides, or without these ones, and with the other
    far sides closer, if they are to be moved. Where there are none, nothing changes."""
    if not problem.has_far_sides:
        return Change(problem, problem)
    assert problem.far_sides is not None
    far, _, reach = problem.far_sides
    sides = far if sides is None else sides
    counted = far.without(sides)
    _, q, low, high = conditions_of(problem)
    if is_moved and counted.number:
        pairs = list(zip((low, high, q), counted, strict=True))
        sizes = np.concatenate([np.abs(each[mask]) for each, mask in pairs])
        smallest, ratio = float(sizes.min()), float(sizes.max() / sizes.min())
        power = 1.0 if ratio <= MAX_RATIO else math.log(MAX_RATIO, ratio)
        low, high, q = (
            np.where(mask, _nearer(each, smallest, power, reach), each)
            for each, mask in pairs
        )
    low[sides.lower], high[sides.upper] = -np.inf, np.inf
    low[sides.rows], high[sides.rows] = 0.0, 0.0
    q = np.where(sides.rows, 0.0, q)
    changed = Problem(problem.M, q, lower=low, upper=high)
    return Relaxed(changed, problem, sides, counted, is_moved)


def _nearer(sides: Vector, smallest: float, power: float, reach: float) -> Vector:
    """Return far sides that have been moved closer, in the same order."""
    with np.errstate(invalid="ignore"):
        sizes = NEARER * (reach or 1.0) * (np.abs(sides) / smallest) ** power
        return np.where(np.isfinite(sides), np.copysign(sizes, sides), sides)
