"""The bounds l <= z <= u of a problem, the basis status of variables, at a bound or
basic, and the change of variables to x with z = mid(l, u, 2x) and w = z - 2x.

For every x, z lies within its bounds and w has the signs required by complementarity:
w_i >= 0 where z_i < u_i and w_i <= 0 where z_i > l_i. For l = 0 and u infinite, z = |x|
+ x and w = |x| - x.

A residual that is measured from the reference point is hidden neither by bounds far
from 0 nor by very large ones that represent infinite ones.

Validation of bounds: infinity means no bound; no lower one exceeds the upper one, or a
ProblemError says where.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from numbers import Rational
from typing import Any, NamedTuple

import numpy as np

from lcpcli.errors import EmptyIntervalError, ProblemError, kind
from lcpcli.linalg.doubles import (
    LARGEST_DOUBLE,
    are_moderate,
    is_finite,
    largest,
    number_of,
)
from lcpcli.linalg.matrices import (
    absolute_product,
    accurate_residual,
    is_sparse,
    product,
    row_errors,
)
from lcpcli.model import arrays
from lcpcli.model.arrays import FROM_0, as_floats, plain, readonly_copy
from lcpcli.options import INFINITY
from lcpcli.typing import BasisStatus, Indices, Mask, Matrix, Vector

# A row of M z + q is summed exactly if its terms exceed this multiple of their sum.
CANCELLATION = 1000
# A bound of this size or more means none, by the convention of MPS files and of OSQP.
NO_BOUND = 1e20
# A bound of this size or more may mean none (see `far_sides`).
MIN_FAR = 1e13
LARGEST_X = LARGEST_DOUBLE / 2  # up to this |x|, z and w are finite
# Basis status: z_i = l_i and w_i >= 0, w_i = 0, z_i = u_i and w_i <= 0.
LOWER = -1
BASIC = 0
UPPER = 1
# Comparing a basis with this array takes half the time; BASIC is false, others are
# true.
_UPPER = np.array(UPPER, dtype=np.int8)
WORDS = {LOWER: "lower", BASIC: "basic", UPPER: "upper"}


class Wording(NamedTuple):
    """The wording of the conditions of a problem in messages: what holds in rational
    arithmetic for an exact solution, and for a proof that there is none, what a
    certificate shows, what an accepted proof does, and what a certificate shows that is
    a proof except for the rounding of M."""

    solved: str
    infeasible: str
    farkas: str
    refuted: str
    rounded: str


LCP_WORDING = Wording(
    "z >= 0, w = Mz + q >= 0 and z'w = 0 hold in rational arithmetic",
    "y >= 0, M'y <= 0 and q'y < 0 hold in rational arithmetic, so that no z >= "
    "0 has Mz + q >= 0",
    "no z >= 0 has Mz + q >= 0, as M'y <= 0 and q'y < 0 for the y >= 0 of the "
    "certificate",
    "y >= 0, M'y <= 0 and q'y < 0, so that no z >= 0 has Mz + q >= 0",
    "no z >= 0 has Mz + q >= 0, by this y, unless terms of a row of Mz that are "
    "{} times their sum cancel",
)
MIXED_WORDING = Wording(
    "z is within its bounds and w = Mz + q has the signs required by complementarity, "
    "in rational arithmetic",
    "no z within the bounds has w with the signs required by complementarity, by y in "
    "rational arithmetic",
    "no z within the bounds has w with the signs required by complementarity, by the y "
    "of the certificate",
    "by y, no z within the bounds has w with the signs required by complementarity",
    "no z within the bounds has w with the required signs, by this y, unless terms of "
    "a row of Mz that are {} times their sum "
    "cancel",
)


def in_range(x: Vector) -> bool:
    """Return whether z and w of an x are finite."""
    return largest(x) <= LARGEST_X


def transformed_bound(bound: Vector, original_bound: Vector | float) -> Vector:
    """Return a bound in other variables, which is finite where the original bound is
    finite."""
    return np.where(
        np.isfinite(original_bound),
        np.clip(bound, -LARGEST_DOUBLE, LARGEST_DOUBLE),
        bound,
    )


def of_masks(basic: Mask, upper: Mask | None = None) -> BasisStatus:
    """Return a basis of any shape: BASIC where basic, UPPER where upper, which excludes
    basic, and LOWER elsewhere."""
    if upper is None:
        return -(~basic).view(np.int8)
    basis: BasisStatus = upper.view(np.int8) - (~(basic | upper)).view(np.int8)
    return basis


def in_words(statuses: BasisStatus) -> list[str]:
    return [WORDS[state] for state in statuses.tolist()]


class Box:
    """l <= z <= u: each bound of shape (n,), or (m, n) for m problems, whose infinite
    entries are no bounds.
    is_orthant : whether they are the bounds 0 and infinity of an LCP, which are those
        two numbers, of shape ()."""

    def __init__(self, lower: Vector, upper: Vector) -> None:
        self.lower = lower
        self.upper = upper
        self.is_orthant = not lower.ndim

    @property
    def wording(self) -> Wording:
        return LCP_WORDING if self.is_orthant else MIXED_WORDING

    @cached_property
    def has_zero_lower(self) -> bool:
        """Return whether all lower bounds are 0, so that the reference point is 0."""
        return not number_of(self.lower != 0.0)

    @cached_property
    def _has_upper(self) -> bool:
        """Return whether there is an upper bound; if not, no status is "at the upper
        bound"."""
        return number_of(np.isfinite(self.upper)) > 0

    @cached_property
    def is_far(self) -> bool:
        """Return whether a finite bound is so large that it may mean an infinite one
        (see `far_sides`)."""
        sides = (self.upper,) if self.has_zero_lower else (self.lower, self.upper)
        return any(
            number_of(np.abs(side) >= MIN_FAR) > number_of(np.isinf(side))
            for side in sides
        )

    def mapped(self, change: Callable[[Vector], Vector]) -> Box:
        """Return the box with changed bounds; the bounds of a linear complementarity
        problem stay."""
        return self if self.is_orthant else Box(change(self.lower), change(self.upper))

    def part(self, rows: Indices | Mask | slice | int) -> Box:
        """Return the bounds of some of m problems, or of some variables."""
        return self.mapped(lambda bound: bound[rows])

    def vectors(self, n: int) -> tuple[Vector, Vector]:
        """Return both bounds of n variables as vectors."""
        if self.is_orthant:
            return np.zeros(n), np.full(n, np.inf)
        return self.lower, self.upper

    def z_of(self, x: Vector) -> Vector:
        """Return z = mid(l, u, 2x), for an LCP |x| + x."""
        return self.project(x + x)

    def reflected(self, x: Vector) -> Vector:
        """Return z - x, for an LCP |x|."""
        return self.z_of(x) - x

    def x_of(self, z: Vector, w: Vector) -> Vector:
        """Return the x with z = mid(l, u, 2x) and w = z - 2x, for an LCP x = (z - w) /
        2. If rounding leaves both of a pair nonzero, the smaller one is dropped: z and
        w are then recovered unchanged, not with the other's error."""
        return self._t_of(z, w) / 2

    def _t_of(self, z: Vector, w: Vector) -> Vector:
        with np.errstate(invalid="ignore"):
            t: Vector = np.where((w > 0) & (w >= z - self.lower), self.lower - w, z)
            return (
                np.where((w < 0) & (-w >= self.upper - z), self.upper - w, t)
                if self._has_upper
                else t
            )

    def x_within(self, z: Vector, w: Vector, basis: BasisStatus) -> Vector:
        """Return the x of a basic solution, with basic z_i moved within bounds and
        infeasible w_i set to 0."""
        signed = np.maximum(w, 0.0)
        if self._has_upper:
            signed = np.where(
                self.fixed, w, np.where(basis == UPPER, np.minimum(w, 0.0), signed)
            )
        return 0.5 * np.where(
            basis == BASIC, self.project(z), self.nonbasic(basis) - signed
        )

    def gaps(self, z: Vector, w: Vector, factor: Vector | float = 1.0) -> Vector:
        """Return the natural residual z - mid(l, u, z - w) = max(z - u, min(z - l, w)),
        without cancellation; with z scaled by the factor max(factor (z - u), min(factor
        (z - l), w))."""
        gaps: Vector = np.minimum(factor * (z - self.lower), w)
        return np.maximum(factor * (z - self.upper), gaps) if self._has_upper else gaps

    def basis_of(self, x: Vector) -> BasisStatus:
        """Return the basis that x represents: at the lower bound where 2x <= l, at the
        upper bound where 2x >= u."""
        return self.basis_at(x + x)

    def basis_at(self, z: Vector, w: Vector | None = None) -> BasisStatus:
        """Return the basis of z and w, by default 0: that of their x, whose halves may
        underflow."""
        t = z if w is None else self._t_of(z, w)
        above = t > self.lower
        if not self._has_upper:
            return of_masks(above)
        return of_masks(
            above & (t < self.upper), (t >= self.upper) & (self.lower < self.upper)
        )

    def as_multipliers(self, y: Vector) -> Vector:
        """Return y with 0 where multipliers of rows with these bounds have another
        sign."""
        has_lower, has_upper = map(np.isfinite, self.vectors(y.size))
        lowest = np.where(has_lower, 0.0, -np.inf)
        highest = np.where(has_upper, 0.0, np.inf)
        return np.asarray(np.clip(y, lowest, highest))

    def nonbasic(self, basis: BasisStatus) -> Vector:
        """Return the z of a basis: a bound where nonbasic, 0 for basic variables."""
        bound = (
            np.where(basis == _UPPER, self.upper, self.lower)
            if self._has_upper
            else self.lower
        )
        return np.where(basis, bound, 0.0)

    def violations(self, z: Vector, w: Vector, basis: BasisStatus) -> Vector:
        """Return how far each component is from satisfying the condition of its basis
        status; at most 0 where it does."""
        if not self._has_upper:
            return np.where(basis, -w, self.lower - z)
        beyond: Vector = np.maximum(self.lower - z, z - self.upper)
        signed = np.where(basis == _UPPER, w, -w)
        return np.where(basis, np.where(self.fixed, 0.0, signed), beyond)

    def wrong(self, z: Vector, w: Vector, basis: BasisStatus) -> Mask:
        return self.violations(z, w, basis) > 0.0

    def excess(self, z: Vector, w: Vector) -> Vector:
        """Return by how much w violates its sign condition for a z within the bounds;
        minus infinity where w may have any sign."""
        if not self._has_upper:
            return np.where(z > self.lower, np.abs(w), -w)
        return np.maximum(
            np.where(z > self.lower, w, -np.inf), np.where(z < self.upper, -w, -np.inf)
        )

    def exchanged(self, basis: BasisStatus, violated: Mask, z: Vector) -> BasisStatus:
        """Return the basis after a block pivot on the violated components: a basic one
        goes to its bound, others become basic."""
        basic = np.logical_not(basis)
        if not self._has_upper:
            return of_masks(basic ^ violated)
        return of_masks(
            basic ^ violated,
            np.where(violated, basic & (z > self.upper), basis == _UPPER),
        )

    def project(self, z: Vector) -> Vector:
        """Return the closest z within the bounds."""
        nearest: Vector = np.maximum(z, self.lower)
        return (
            np.minimum(nearest, self.upper, out=nearest) if self._has_upper else nearest
        )

    def on_bounds(self, z: Vector, w: Vector, factor: Vector) -> tuple[Vector, Vector]:
        """Return the closest z within the bounds, on a bound where factor times its
        distance is less than a w of its sign; and the sigma for which w - sigma has the
        signs required by complementarity."""
        at_lower = factor * (z - self.lower) < w
        at_upper = factor * (z - self.upper) > w
        sigma = np.where(
            at_lower, np.minimum(w, 0.0), np.where(at_upper, np.maximum(w, 0.0), w)
        )
        nearest = np.where(
            at_lower, self.lower, np.where(at_upper, self.upper, self.project(z))
        )
        return nearest, np.where(self.fixed, 0.0, sigma)

    @property
    def corner(self) -> Vector:
        """Return the z at the lower bounds, at upper ones where there are no lower
        ones, and 0 where there are none."""
        return np.where(
            np.isfinite(self.lower),
            self.lower,
            np.where(np.isfinite(self.upper), self.upper, 0.0),
        )

    @cached_property
    def fixed(self) -> Mask:
        """Return where l_i = u_i, so that w_i is free."""
        return np.equal(self.lower, self.upper)

    @cached_property
    def free(self) -> Mask:
        """Return where neither bound is finite, so that w_i = 0."""
        return np.isinf(self.lower) & np.isinf(self.upper)

    @cached_property
    def kinds(self) -> dict[str, int]:
        """Return how many variables are free, have one bound or both, or are fixed, if
        any; nothing for an LCP."""
        low = np.isfinite(self.lower)
        high = np.isfinite(self.upper)
        boxed = ~self.fixed
        masks = {
            "free": ~low & ~high,
            "lower bound": low & ~high,
            "upper bound": ~low & high,
        }
        masks |= {"boxed": low & high & boxed, "fixed": self.fixed}
        counts = {
            kind: int(np.count_nonzero(mask))
            for kind, mask in masks.items()
            if mask.any()
        }
        return {} if self.is_orthant else counts

    def in_single_precision(self) -> Box:
        """Return the bounds in single precision, where those beyond its range are
        infinite."""
        with np.errstate(over="ignore"):
            return Box(self.lower.astype(np.float32), self.upper.astype(np.float32))

    def in_units(self, C: Vector) -> Box:
        return self.mapped(lambda bound: bound / C)

    def shifted_by(self, z: Vector) -> Box:
        """Return the bounds of the distances from z, of shape (n,) or (m, n)."""
        return self.mapped(lambda bound: transformed_bound(bound - z, bound))

    def add_within(self, distance: Vector, shifted_box: Box, z: Vector) -> Vector:
        """Return z plus a distance from it; where the distance is at a bound of its
        box, the bound of this box."""
        inside = np.where(distance == shifted_box.upper, self.upper, distance + z)
        return np.where(distance == shifted_box.lower, self.lower, inside)


ORTHANT = Box(np.array(0.0), np.array(np.inf))


class Reference(NamedTuple):
    """The reference point z of one problem, shape (n,), or of each of m problems, shape
    (m, n); M z + q there, stored as `q`, and bounds on its rounding errors. Where all
    reference points are 0, as for LCPs, z is None and the error 0."""

    z: Vector | None
    q: Vector
    error: Vector | float

    def part(self, rows: Indices | int) -> Reference:
        if self.z is None or isinstance(self.error, float) or not self.z[rows].any():
            return Reference(None, self.q[rows], 0.0)
        return Reference(self.z[rows], self.q[rows], self.error[rows])


@np.errstate(over="ignore", invalid="ignore")
def reference(M: Matrix, q: Vector, box: Box) -> Reference:
    """Return the z within the bounds closest to 0, or with every z_i at a finite bound,
    whichever leaves the smaller residual; 0 if w overflows at both. Rows of w that
    cancel there are summed exactly. q : shape (n,), or (m, n)."""
    if box.has_zero_lower:
        return Reference(None, q, 0.0)
    z, corner = box.project(np.zeros(q.shape)), box.corner
    differ = np.count_nonzero(z != corner)
    if not differ and not np.count_nonzero(z):
        return Reference(None, q, 0.0)
    w = product(M, z.T).T + q
    if differ:
        other = product(M, corner.T).T + q
        better = _largest(box.gaps(corner, other)) < _largest(box.gaps(z, w))
        z, w = np.where(better, corner, z), np.where(better, other, w)
    usable = np.isfinite(w).all(axis=-1, keepdims=True)
    z, w = np.where(usable, z, 0.0), np.where(usable, w, q)
    if not z.any():
        return Reference(None, q, 0.0)
    terms = absolute_product(M, np.abs(z).T).T + np.abs(q)
    errors = row_errors(M, z, terms)
    each = zip(*map(np.atleast_2d, (z, w, q, terms, errors)), strict=True)
    for z_i, w_i, q_i, terms_i, errors_i in each:  # views
        rows = np.flatnonzero(terms_i > CANCELLATION * np.abs(w_i))
        if not rows.size:
            continue
        part = M[rows]
        if all(
            map(are_moderate, (part.data if is_sparse(M) else part, q_i[rows], z_i))
        ):
            w_i[rows] = 0.0 - accurate_residual(part, z_i, -q_i[rows])
            errors_i[rows] = 0.0
    return Reference(z, w, errors)


def _largest(gaps: Vector) -> Vector:
    """Return the largest size in each row, infinite where a number is not finite; shape
    (m, 1), or (1,)."""
    sizes: Vector = np.abs(gaps).max(axis=-1, keepdims=True)
    return np.where(np.isfinite(sizes), sizes, np.inf)


def box_of(lower: Any, upper: Any, n: int, infinity: float) -> Box:
    """Return the box with these bounds of n unknowns, or raise ProblemError."""
    low, high = as_intervals(("lower", "upper"), lower, upper, n, infinity=infinity)
    box = Box(low, high)
    if box.has_zero_lower and number_of(high == math.inf) == n:
        return ORTHANT
    # Nothing else has vectors that were made here of numbers.
    box.lower = readonly_copy(low, [] if type(lower) is float else lower)
    box.upper = readonly_copy(high, [] if type(upper) is float else upper)
    return box


def has_columns(field: str, bound: Any) -> bool:
    """Return whether a bound has rows and is not an array of a single column, which is
    treated as a vector."""
    raw_value = plain(field, bound, arrays.NUMBERS)
    if isinstance(raw_value, (list, tuple)):
        return arrays.has_rows(raw_value)
    return np.ndim(raw_value) > 1 and np.shape(raw_value)[1] != 1


def as_intervals(
    fields: tuple[str, str],
    lower: Any,
    upper: Any,
    n: int,
    of: str = "unknown",
    infinity: float = math.inf,
) -> tuple[Vector, Vector]:
    """Return lower and upper bounds for each of n things of a kind, infinite if absent
    or if they have at least the size `infinity`, or raise ProblemError:
    EmptyIntervalError where no number lies between them."""
    if infinity == math.inf:
        low, high = _plain_vector(lower, n), _plain_vector(upper, n)
        if low is not None and high is not None and _are_valid(low, high):
            return low, high
    below, above = fields
    bounds = (
        as_bound(below, lower, n, of, -math.inf),
        as_bound(above, upper, n, of, math.inf),
    )
    low, high = (with_infinity(bound, infinity) for bound in bounds)
    if _are_valid(low, high):
        return low, high
    if not (is_finite(low) and is_finite(high)):
        _refuse_infinite_sides(fields, bounds, (low, high), infinity)
    for i in np.flatnonzero(low > high)[:1].tolist():
        reason = f"is {low.item(i):g}, above {above}[{i}] = {high.item(i):g}"
        raise EmptyIntervalError(
            f"{below}[{i}]",
            reason,
            f"make every lower bound at most the upper one {FROM_0}",
        )
    return low, high


def _refuse_infinite_sides(
    fields: tuple[str, str],
    bounds: tuple[Vector, Vector],
    intervals: tuple[Vector, Vector],
    infinity: float,
) -> None:
    """Raise EmptyIntervalError for the first lower bound that is infinity, or else the
    first upper bound that is minus infinity. bounds : before those of at least the size
    `infinity` have become infinite, in `intervals`."""
    (below, above), (low, high) = fields, intervals
    sides = (
        (below, bounds[0], low == math.inf, "", "-"),
        (above, bounds[1], high == -math.inf, "minus ", ""),
    )
    for field, bound, is_invalid, minus, none in sides:
        for i in np.flatnonzero(is_invalid)[:1].tolist():
            size = (
                ""
                if math.isinf(bound[i])
                else f", as it is {bound[i]:g} and infinity begins at {infinity:g}"
            )
            reason = f"is {minus}infinity{size}" if minus else f"is infinite{size}"
            raise EmptyIntervalError(
                f"{field}[{i}]",
                reason,
                f"give a number, or {none}inf for no bound {FROM_0}",
            )


def _are_valid(lower: Vector, upper: Vector) -> bool:
    """Return whether a number is within each pair of bounds."""
    low = np.maximum(lower, -LARGEST_DOUBLE)
    high = np.minimum(upper, LARGEST_DOUBLE)
    return number_of(low <= high) == low.size


def _plain_vector(bound: Any, n: int) -> Vector | None:
    """Return a bound that is a number or a vector of float64, which need not be
    converted, as a vector of shape (n,); None for any other."""
    if type(bound) is float:
        vector = np.empty(n)
        vector.fill(bound)
        return vector
    is_vector = type(bound) is np.ndarray and bound.shape == (n,)
    return bound if is_vector and bound.dtype == np.float64 else None


def with_infinity(bound: Vector, infinity: float) -> Vector:
    """Return a bound whose entries of at least the size `infinity` are made
    infinite."""
    if infinity == math.inf:
        return bound
    INFINITY.check(infinity)
    return np.where(np.abs(bound) >= infinity, np.copysign(np.inf, bound), bound)


def as_bound(field: str, values: Any, n: int, of: str, absent: float) -> Vector:
    """Return a bound of shape (n,) from one number or n, possibly infinite; None means
    `absent`: no bound or, for numbers that are no bounds, nan, which is refused."""
    if values is None:
        return np.full(n, absent)
    expected = "a number, or a list of numbers"
    if type(values) is float and values == values:
        return np.full(n, values)
    if isinstance(values, (bool, np.bool_, str)):
        raise ProblemError(field, f"is {kind(values)}", f"give {expected}")
    values = plain(field, values, expected)
    if isinstance(values, (int, float, Rational)) or arrays.is_number_in_array(values):
        with np.errstate(over="ignore"):
            values = np.full(n, as_floats(field, [values])[0])
    if isinstance(values, (list, tuple)):
        values = [absent if value is None else value for value in values]
    v = arrays.as_flat(field, values, n, of, expected, "a number, or ")
    if not is_finite(v) and (is_nan := np.isnan(v)).any():
        raise ProblemError(
            f"{field}[{is_nan.argmax()}]",
            "is not a number",
            f"give {'a number' if math.isnan(absent) else 'inf for no bound'} {FROM_0}",
        )
    return v


def bounds_of_each(
    rows_of: Callable[[str, Any], Vector | None],
    lower: Any,
    upper: Any,
    shape: tuple[int, int],
    infinity: float,
    of: str,
) -> tuple[Vector, Vector] | None:
    """Return both bounds of m problems, of this shape (m, n); None if they are 0 and
    infinity, as of an LCP. rows_of : returns the bounds of each problem, or None for a
        bound that is the same for all. of : the noun for a problem in messages."""
    bounds = []
    for field, bound, absent in (
        ("lower", lower, -math.inf),
        ("upper", upper, math.inf),
    ):
        rows = rows_of(field, bound)
        if rows is None:
            rows = as_bound(field, bound, shape[1], "unknown", absent)
        bounds.append(np.broadcast_to(with_infinity(rows, infinity), shape))
    low, high = bounds
    refuse_crossed(low, high, of)
    return (low, high) if low.any() or (high < math.inf).any() else None


def refuse_crossed(low: Vector, high: Vector, name: str, first: int = 0) -> None:
    """Raise ProblemError if bounds of shape (m, n), for columns or others, numbered
    from `first`, have no number between them."""
    for j in np.flatnonzero(
        ~((low <= high) & (low < np.inf) & (high > -np.inf)).all(axis=1)
    )[:1]:
        try:
            as_intervals(("lower", "upper"), low[j], high[j], low.shape[1])
        except ProblemError as error:
            raise error.inside(f"{name} {first + j}") from None
