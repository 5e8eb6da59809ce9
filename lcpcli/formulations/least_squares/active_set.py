"""The active-set method for least squares with bounds and equations.

Each coefficient is either fixed at a bound or free. The free ones solve a least-squares
problem without bounds, by orthogonal factors of their columns; a step that would leave
the bounds stops at the first bound that it meets, and one coefficient at a time is
freed, by the sign of its multiplier: C. L. Lawson, R. J. Hanson, Solving Least Squares
Problems (1974), chapter 23; with upper bounds P. B. Stark, R. L. Parker,
Bounded-variable least squares, Computational Statistics 10 (1995) 129-141. |A x - b|
decreases, so that no set of free coefficients comes twice. The first set is determined
by block pivots on many coefficients: L. F. Portugal, J. J. Judice, L. N. Vicente, A
comparison of block pivoting and interior-point algorithms for linear least squares
problems with nonnegative variables, Mathematics of Computation 63 (1994) 625-643.

At the last points, residuals are computed with twice the precision of floating-point
numbers and x is refined, so that signs are wrong only where rounding of the data
decides them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lcpcli.formulations.least_squares.factors import Factors, lapack
from lcpcli.formulations.least_squares.fit import Data
from lcpcli.formulations.least_squares.free_columns import FreeColumns, free_columns
from lcpcli.formulations.least_squares.residuals import residual
from lcpcli.linalg.doubles import EPS
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.typing import BasisStatus, Indices, Matrix, Vector

# A multiplier is a sum of products; one that is at most this many times the sum of
# their absolute values may be rounding error of 0.
ROUNDING_OF_MULTIPLIERS = 16 * EPS
# Residuals that are all at most this many times |A| |x| + |b| are treated as 0.
ROUNDING_OF_RESIDUALS = 4 * EPS
# The relative errors of coefficients and multipliers that have not been refined.
UNREFINED = 64 * EPS
# A residual that is larger than this, relative to the terms of A x - b, has at least 13
# correct digits in double precision, so that it need not be computed with more.
LARGE_RESIDUAL = 1e-3
MAX_REFINEMENTS = 6
# Steps for each coefficient, after which rounding errors must have led into a cycle.
MAX_STEPS = 6
# How many successive block pivots may fail to reduce the number of infeasible
# coefficients.
MAX_FAILED_EXCHANGES = 3
MAX_EXCHANGES = 50
MAX_REFINED_POINTS = 20


@dataclass
class Minimizer:
    """The current iterate of the method, for a scaled problem (see `Scaled`).

    x, r, y : the coefficients, the residuals b - A x, and the multipliers of the
        equations.
    statuses : LOWER, BASIC or UPPER for each coefficient; BASIC means free. A
        coefficient without bounds may also be LOWER, with the value 0, if its column
        depends linearly on those of the free ones.
    steps : how many sets of free coefficients were examined.
    """

    x: Vector
    r: Vector
    y: Vector
    statuses: BasisStatus
    steps: int = 0
    _last: tuple[bytes, Factors] | None = None

    def factors(self, data: Data) -> Factors:
        """Return the factors of the free columns. They are computed again only if the
        set of free coefficients has changed.
        """
        key = self.statuses.tobytes()
        if self._last is None or self._last[0] != key:
            free = self.free
            made = Factors(data.A[:, free], data.E[:, free])
            self._last = key, made
        return self._last[1]

    @property
    def free(self) -> Indices:
        indices: Indices = (self.statuses == BASIC).nonzero()[0]
        return indices


def minimize(data: Data) -> Minimizer | None:
    """Return the minimizer of a problem that has been scaled by `Scaled`; None if no x
    within the bounds satisfies the equations, or if rounding errors make the method
    cycle.
    """
    x, statuses = start_of(data)
    exchanged = None
    if data.d.size:
        none = data.E[:0], data.d[:0]
        of_equations = Data(data.E, data.d, data.lower, data.upper, *none)
        start = _of_states(of_equations, x, statuses)
        feasible = _descended(of_equations, start, _noise(of_equations, start))
        if feasible is None or not _are_satisfied(data, feasible.x):
            return None
        x, statuses = feasible.x, feasible.statuses
    elif len(data.A) >= x.size:
        gram = data.A.T @ data.A
        exchanged = exchanges(gram, data.A.T @ data.b, data.lower, data.upper, statuses)
        if exchanged is not None and not exchanged.n_infeasible:
            point = _of_states(data, exchanged.x, exchanged.statuses)
            norms = np.sqrt(gram.diagonal())
            clear = _clear(data, point, norms)
            if clear is not None:
                return clear
    start = _of_states(data, x, statuses)
    if exchanged is not None:
        start = _projected(data, start, exchanged.x)
    minimizer = _descended(data, start, _noise(data, start))
    return None if minimizer is None else _with_certain_signs(data, minimizer)


def start_of(data: Data) -> tuple[Vector, BasisStatus]:
    """Return the x of the box that is closest to 0 among those with each coefficient at
    a bound, and the statuses of the coefficients; those without bounds are 0. None of
    them is free.
    """
    is_upper = np.abs(data.upper) < np.abs(data.lower)
    x = np.where(is_upper, data.upper, data.lower)
    x[np.isinf(x)] = 0.0
    return x, np.where(is_upper, UPPER, LOWER).astype(np.int8)


def _of_states(data: Data, x: Vector, statuses: BasisStatus) -> Minimizer:
    """Return the point x with these statuses, with its residual and without
    multipliers.
    """
    return Minimizer(x, data.b - data.A @ x, np.zeros(data.d.size), statuses)


def _are_satisfied(data: Data, x: Vector) -> bool:
    terms = np.abs(data.E) @ np.abs(x) + np.abs(data.d)
    return bool((np.abs(data.E @ x - data.d) <= 64 * EPS * x.size * terms).all())


def _clear(data: Data, point: Minimizer, norms: Vector) -> Minimizer | None:
    """Return the minimizer over the free coefficients of a point, by orthogonal
    factors; None unless the signs of all coefficients and multipliers are then certain.

    norms : the 2-norms of the columns of A.
    """
    factors = point.factors(data)
    if not factors.is_regular:
        return None
    free = point.free
    step = factors.step(point.r, np.zeros(free.size), data.d)
    x = point.x.copy()
    x[free] += step.dx
    minimizer = replace(point, x=x, r=step.dr, steps=1)
    rows = factors.row_norms
    return minimizer if are_clear(data, minimizer, norms, rows) else None


def _projected(data: Data, start: Minimizer, x: Vector) -> Minimizer:
    """Return the point to which block pivots led, projected onto the bounds; or `start`
    itself, if that is better.

    The block pivots use A'A, which may lose half of the digits. That is harmless, as
    the point is only a start for the active-set method.
    """
    lower, upper = data.lower, data.upper
    x = np.clip(x, lower, upper)
    if not np.isfinite(x).all():
        return start
    is_inside = (lower < x) & (x < upper)
    statuses = np.where(is_inside, BASIC, np.where(x <= lower, LOWER, UPPER))
    minimizer = _of_states(data, x, statuses.astype(np.int8))
    is_better = minimizer.r @ minimizer.r < start.r @ start.r
    return minimizer if is_better and minimizer.factors(data).is_regular else start


class Exchanged(NamedTuple):
    """The result of block pivots: x, statuses, and how many coefficients violate a
    bound or the sign condition on their multiplier.
    """

    x: Vector
    statuses: BasisStatus
    n_infeasible: int


def exchanges(
    gram: Matrix, side: Vector, lower: Vector, upper: Vector, statuses: BasisStatus
) -> Exchanged | None:
    """Return the point to which block pivots on all infeasible coefficients lead,
    computed from A'A (`gram`) and A'b (`side`); None if the matrix of the free
    coefficients is not positive definite.
    """
    solve = lapack().dposv
    min_wrong = lower.size + 1
    failures = 0
    has_none = np.isinf(lower) & np.isinf(upper)
    statuses = np.where(has_none, np.int8(BASIC), statuses)
    is_movable = lower < upper
    for _ in range(MAX_EXCHANGES):
        free = (statuses == BASIC).nonzero()[0]
        x = np.where(statuses == UPPER, upper, lower)
        x[free] = 0.0
        of_free = side[free]
        if x.any():
            of_free -= gram[free] @ x
        if free.size:
            _, x[free], info = solve(gram[free[:, np.newaxis], free], of_free)
            if info:
                return None
        slopes = gram @ x - side
        below, above = x < lower, x > upper
        is_infeasible = below | above | ((slopes * statuses > 0) & is_movable)
        number = int(np.count_nonzero(is_infeasible))
        if number < min_wrong:
            min_wrong, failures = number, 0
        else:
            failures += 1
        if not number or failures > MAX_FAILED_EXCHANGES:
            break
        # LOWER, BASIC and UPPER are -1, 0 and 1.
        others = above.view(np.int8) - below.view(np.int8)
        statuses = np.where(is_infeasible, others, statuses)
    return Exchanged(x, statuses, number)


def _descended(data: Data, minimizer: Minimizer, noise: Vector) -> Minimizer | None:
    """Return the point to which alternately minimizing over the free coefficients and
    freeing one more leads; None if it does not terminate after `MAX_STEPS` steps for
    each coefficient.

    noise : bounds on the rounding errors of the multipliers.
    """
    columns = free_columns(data, minimizer.free)
    for _ in range(MAX_STEPS * (minimizer.x.size + 10)):
        while not _step(data, minimizer, columns):
            minimizer.steps += 1
        minimizer.steps += 1
        if not _freed(data, minimizer, columns, noise):
            return minimizer
    return None


def _step(data: Data, minimizer: Minimizer, columns: FreeColumns) -> bool:
    """Move the free coefficients to the minimizer over them, or as far as the first
    bounds in that direction, and fix those that reach a bound. Return whether the
    minimizer was reached.
    """
    free = columns.indices
    step = columns.step(minimizer.x, minimizer.r)
    start = minimizer.x[free]
    low = data.lower[free]
    high = data.upper[free]
    target = start + step.dx
    is_below = target < low
    outside = (is_below | (target > high)).nonzero()[0]
    if not outside.size:
        minimizer.x[free] = target
        minimizer.r = step.dr
        minimizer.y = step.dy
        return True
    bounds = np.where(is_below, low, high)[outside]
    ratios = (bounds - start[outside]) / step.dx[outside]
    ratio = float(ratios.min())
    reached = ratios == ratio
    leaving = outside[reached]
    new_x = np.clip(start + ratio * step.dx, low, high)
    new_x[leaving] = bounds[reached]
    minimizer.x[free] = new_x
    minimizer.r = minimizer.r + ratio * (step.dr - minimizer.r)
    minimizer.statuses[free[leaving]] = np.where(is_below[leaving], LOWER, UPPER)
    columns.remove(leaving)
    return False


def _freed(
    data: Data, minimizer: Minimizer, columns: FreeColumns, noise: Vector
) -> bool:
    """Free the coefficient at a bound whose multiplier violates its sign condition and
    is the largest of these, and return True; return False if no multiplier violates it
    by more than rounding error.
    """
    statuses = minimizer.statuses
    slopes = data.A.T @ minimizer.r
    if data.d.size:
        slopes += data.E.T @ minimizer.y
    # LOWER, BASIC and UPPER are -1, 0 and 1.
    gains = -slopes * statuses
    is_loose = np.isinf(data.lower) & np.isinf(data.upper) & (statuses != BASIC)
    gains = np.where(is_loose, np.abs(slopes), gains)
    gains[(gains <= noise) | (data.lower == data.upper)] = 0.0
    while gains.size:
        j = int(gains.argmax())
        if not gains[j] > 0:
            break
        # Otherwise the multiplier is rounding error, or the column depends on others.
        if columns.add(j, minimizer.x, minimizer.r, float(slopes[j])):
            statuses[j] = BASIC
            return True
        gains[j] = 0.0
    return False


def _noise(data: Data, minimizer: Minimizer) -> Vector:
    """Return bounds on the rounding errors of the multipliers at points that have not
    been refined.
    """
    norms = column_norms(data.A)
    terms = norms * (np.sqrt(data.b @ data.b) + norms @ np.abs(minimizer.x))
    of_E = np.abs(data.E).T @ np.abs(minimizer.y)
    return np.asarray(ROUNDING_OF_MULTIPLIERS * (terms + of_E))


def are_clear(data: Data, minimizer: Minimizer, norms: Vector, rows: Vector) -> bool:
    """Return whether the signs of all coefficients and multipliers of a point that has
    not been refined are correct in spite of rounding errors.

    norms : the 2-norms of the columns of A.
    rows : the 2-norms of the rows of the pseudoinverse of the free columns.
    """
    free = minimizer.free
    size = float(np.sqrt(minimizer.r @ minimizer.r))
    terms = float(np.sqrt(data.b @ data.b) + norms @ np.abs(minimizer.x))
    if not size > LARGE_RESIDUAL * terms:
        return False
    largest = float(np.sqrt(rows @ rows))
    of_free = float(np.sqrt(norms[free] @ norms[free]))
    errors = UNREFINED * rows * (terms + largest * of_free * size)
    gaps = np.minimum(minimizer.x - data.lower, data.upper - minimizer.x)[free]
    if not (gaps > errors).all():
        return False
    fixed = (minimizer.statuses != BASIC) & (data.lower < data.upper)
    slopes = -(data.A.T @ minimizer.r)[fixed] * minimizer.statuses[fixed]
    noise = UNREFINED * norms[fixed] * (terms + largest * size)
    return bool((slopes < -noise).all())


def column_norms(A: Matrix) -> Vector:
    """Return the 2-norms of the columns of a matrix."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", A, A)))


def _with_certain_signs(data: Data, minimizer: Minimizer) -> Minimizer | None:
    """Return the minimizer, after refining it and continuing the method until the signs
    of the refined coefficients and multipliers are those of a minimizer; None if the
    method cycles.
    """
    if not data.d.size:
        point = _of_states(data, minimizer.x, minimizer.statuses)
        clear = _clear(data, point, column_norms(data.A))
        if clear is not None:
            return replace(clear, steps=minimizer.steps)
    for _ in range(MAX_REFINED_POINTS):
        minimizer = _refine_to_digits(data, minimizer)
        inside = (data.lower <= minimizer.x) & (minimizer.x <= data.upper)
        terms = np.abs(data.A) @ np.abs(minimizer.x) + np.abs(data.b)
        if (
            inside.all()
            and (np.abs(minimizer.r) <= ROUNDING_OF_RESIDUALS * terms).all()
        ):
            minimizer.r = np.zeros_like(minimizer.r)
            minimizer.y = np.zeros_like(minimizer.y)
            return minimizer
        noise = ROUNDING_OF_MULTIPLIERS * (
            np.abs(data.A).T @ np.abs(minimizer.r)
            + np.abs(data.E).T @ np.abs(minimizer.y)
        )
        if not inside.all():
            _put_on_bounds(data, minimizer)
        else:
            columns = free_columns(data, minimizer.free)
            if not _freed(data, minimizer, columns, noise):
                return minimizer
        again = _descended(data, minimizer, noise)
        if again is None:
            return None
        minimizer = again
    return minimizer


def _put_on_bounds(data: Data, minimizer: Minimizer) -> None:
    """Fix the coefficients that refinement has moved beyond a bound at that bound."""
    below, above = minimizer.x < data.lower, minimizer.x > data.upper
    minimizer.statuses[below], minimizer.statuses[above] = LOWER, UPPER
    minimizer.x = np.clip(minimizer.x, data.lower, data.upper)
    minimizer.r = data.b - data.A @ minimizer.x


def _refine_to_digits(data: Data, minimizer: Minimizer) -> Minimizer:
    """Return the point with x, r and y improved by iterative refinement, with residuals
    in twice the precision, to almost full double precision.
    """
    free, last = minimizer.free, np.inf
    factors = minimizer.factors(data)
    both = np.vstack((factors.A, factors.E)).T
    for _ in range(MAX_REFINEMENTS):
        x = np.append(minimizer.x, 1.0)
        f = residual(np.column_stack((data.A, minimizer.r)), x, data.b)
        g = residual(both, np.append(minimizer.r, minimizer.y), np.zeros(free.size))
        step = factors.step(f, g, residual(data.E, minimizer.x, data.d))
        sizes = np.abs(minimizer.x[free]) + EPS
        size = float((np.abs(step.dx) / sizes).max(initial=0.0))
        if not size <= last / 2:
            break
        last = size
        minimizer.x[free] += step.dx
        minimizer.r = minimizer.r + step.dr
        minimizer.y = minimizer.y + step.dy
    return minimizer
