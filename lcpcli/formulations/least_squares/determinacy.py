"""Which coefficients the data of a fit determine: whether there are other minimizers,
and whether rounding errors of the data decide which coefficients are at a bound.

How far rounding errors of A, b, E and d may move coefficients and multipliers, to first
order, follows from the inverse of the system of the free coefficients: A. Bjorck,
Numerical Methods for Least Squares Problems (1996), section 1.4.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.formulations.least_squares.active_set import Minimizer, minimize
from lcpcli.formulations.least_squares.factors import Factors, Step
from lcpcli.formulations.least_squares.fit import Data
from lcpcli.formulations.least_squares.scaling import Scaled
from lcpcli.linalg.doubles import EPS
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.typing import BasisStatus, Indices, Mask, Matrix, Vector

UNIQUE = "unique"
SEVERAL = "several"
ROUNDED = "up to rounding"
# The relative errors that the data and the computed minimizer are assumed to have.
ROUNDING_OF_DATA = 4 * EPS
# Entries of a null vector of A that are below this, relative to the largest, are
# treated as rounding errors of 0.
ZERO = 1e-13
# Rows whose smallest singular value is above this, relative to the largest, are
# linearly independent: singular values have rounding errors of size EPS.
FULL_RANK = 1e-8
# Of |b - A x|: a change of A x that makes it clearly smaller, by 5e-5 of it; and what
# rounding of the factors of A may hide of it, eps cond(A), so that no fit is called
# unique whose columns have a condition above 4e13.
IMPROVEMENT = 0.01
# Of the terms of A x - b: what rounding leaves of the residual of an exact fit.
EXACT_FIT = 16 * EPS
MAX_EXACT_TERMS = 200_000  # this many products of fractions take about a second


class Determinacy(NamedTuple):
    """What the data say about a minimizer.

    proved : UNIQUE, SEVERAL or ROUNDED.
    other : another minimizer, shape (n,), if there are several.
    uncertain : the indices, from 0, of the coefficients for which rounding errors of
        the data decide whether they are at a bound.
    changing : the indices of the coefficients that can change without changing A x,
        exactly or up to rounding of the data.
    """

    proved: str
    other: Vector | None
    uncertain: list[int]
    changing: list[int]


@np.errstate(all="ignore")
def determinacy(data: Data, minimizer: Minimizer) -> Determinacy:
    """Return what the data say about a minimizer. Neither has to be scaled."""
    scaled = Scaled.of(data)
    scaled_minimizer = scaled.minimizer(minimizer)
    uncertain = _uncertain(scaled.data, scaled_minimizer)
    listed = uncertain.nonzero()[0].tolist()
    is_fixed = data.lower == data.upper
    inside = (scaled_minimizer.statuses == BASIC) | (uncertain & ~is_fixed)
    direction = _direction(scaled.data, scaled_minimizer, inside)
    if direction is None:
        changing = _improvable(scaled.data, scaled_minimizer)
        is_rounded = bool(listed or changing)
        return Determinacy(ROUNDED if is_rounded else UNIQUE, None, listed, changing)
    along = scaled.x(direction)
    changing = direction.nonzero()[0].tolist()
    if _is_exact(scaled.data, direction):
        other = _moved(data, minimizer.x, along)
        if not np.array_equal(other, minimizer.x):
            return Determinacy(SEVERAL, other, listed, changing)
    return Determinacy(ROUNDED, None, listed, changing)


def _uncertain(data: Data, minimizer: Minimizer) -> Mask:
    """Return for which coefficients rounding errors of the data decide whether they are
    at a bound or free.
    """
    A = data.A
    E = data.E
    statuses = minimizer.statuses
    free, fixed = minimizer.free, (statuses != BASIC).nonzero()[0]
    factors = minimizer.factors(data)
    uncertain = np.zeros(statuses.size, dtype=bool)
    if not factors.is_regular:
        uncertain[:] = True
        return uncertain & (data.lower < data.upper)
    terms = _terms(data, minimizer, free)
    # The matrix of the system of (dr, dx, dy) is symmetric, and so is its inverse.
    (m, p), k = factors.A.shape, len(E)
    unit = factors.step(np.zeros((m, p)), np.eye(p), np.zeros((k, p)))
    changes = _bounded(unit, terms)
    gaps = np.minimum(minimizer.x - data.lower, data.upper - minimizer.x)[free]
    uncertain[free] = gaps <= changes
    A, E = A[:, fixed], E[:, fixed]
    own_errors = np.abs(A).T @ np.abs(minimizer.r) + np.abs(E).T @ np.abs(minimizer.y)
    of_others = _bounded(factors.step(A, np.zeros((p, fixed.size)), E), terms)
    sizes = np.abs(A.T @ minimizer.r + E.T @ minimizer.y)
    is_free_value = data.lower[fixed] < data.upper[fixed]
    is_rounding = sizes <= ROUNDING_OF_DATA * own_errors + of_others
    uncertain[fixed] = is_rounding & is_free_value
    return uncertain


def _bounded(rows: Step, terms: tuple[Vector, Vector, Vector]) -> Vector:
    """Return how much rounding of the data, relative to the terms, changes a quantity
    for each of several rows of the inverse of the system; they are columns here.
    """
    of_A, slopes, of_E = terms
    sizes = np.abs(rows.dr).T @ of_A + np.abs(rows.dx).T @ slopes
    return np.asarray(ROUNDING_OF_DATA * (sizes + np.abs(rows.dy).T @ of_E))


def _improvable(data: Data, minimizer: Minimizer) -> list[int]:
    """Return the free coefficients of a step to a clearly smaller |b - A x|, none if
    there is no such step.

    There is one if the column of a coefficient without bounds depends on others but for
    a few rounding errors: `minimize` leaves that coefficient at 0, as it cannot tell
    its slope from rounding, where the columns, as stored, are independent.
    """
    free = minimizer.free
    factors = minimizer.factors(data)
    if not (free.size and factors.is_regular):
        return []
    # Rounding of the factors, which have the direction in which the columns differ only
    # to eps times their condition, would hide such a step.
    if EPS * factors.condition >= IMPROVEMENT:
        columns = np.vstack((data.A[:, free], data.E[:, free]))
        return _moved_by(free, np.linalg.svd(columns)[2][-1])
    remaining = data.d - data.E @ minimizer.x
    dx = factors.step(minimizer.r, np.zeros(free.size), remaining).dx
    change = np.linalg.norm(data.A[:, free] @ dx)
    terms = np.abs(data.A) @ np.abs(minimizer.x) + np.abs(data.b)
    rounding = EXACT_FIT * np.linalg.norm(terms)
    if not change > IMPROVEMENT * np.linalg.norm(minimizer.r) + rounding:
        return []
    return _moved_by(free, dx)


def _moved_by(free: Indices, dx: Vector) -> list[int]:
    """Return the coefficients among the free ones that a step changes."""
    moved: list[int] = free[np.abs(dx) > ZERO * np.abs(dx).max()].tolist()
    return moved


def _terms(
    data: Data, minimizer: Minimizer, free: Indices
) -> tuple[Vector, Vector, Vector]:
    """Return the sums of the absolute values of the terms in the rows of the system of
    the free coefficients.
    """
    sizes = np.abs(minimizer.x)
    of_A = np.abs(data.A) @ sizes + np.abs(data.b)
    of_E = np.abs(data.E) @ sizes + np.abs(data.d)
    slopes = np.abs(data.A[:, free]).T @ np.abs(minimizer.r)
    return of_A, slopes + np.abs(data.E[:, free]).T @ np.abs(minimizer.y), of_E


def _direction(data: Data, minimizer: Minimizer, inside: Mask) -> Vector | None:
    """Return a vector v with A v = 0 and E v = 0 up to rounding, such that x + t v is
    within the bounds for a small t > 0; None if there is none.

    inside : which coefficients may move, away from their bound if they are at one.
    """
    free = minimizer.free
    both = np.vstack((data.A, data.E))
    direction = np.zeros(minimizer.x.size)
    dependent = Factors(both[:, free], both[:0, free]).dependent
    if dependent is not None:
        before, j = free[:dependent], free[dependent]
        combination = np.linalg.lstsq(both[:, before], both[:, j], rcond=None)[0]
        direction[before] = -combination
        direction[j] = 1.0
        return _without_rounding(direction)
    at_bounds = (inside & (minimizer.statuses != BASIC)).nonzero()[0]
    if not at_bounds.size:
        return None
    return _along_bounds(data, minimizer, both, at_bounds)


def _along_bounds(
    data: Data, minimizer: Minimizer, both: Matrix, at_bounds: Indices
) -> Vector | None:
    """Return such a vector that moves coefficients away from their bounds, by the v for
    which (A v, E v) is smallest among those whose movements away from the bounds have
    the sum 1; None if it is not 0.
    """
    moving = np.concatenate((minimizer.free, at_bounds))
    signs = np.ones(moving.size)
    signs[minimizer.free.size :] = np.where(
        minimizer.statuses[at_bounds] == UPPER, -1.0, 1.0
    )
    lower = np.zeros(moving.size)
    lower[: minimizer.free.size] = -np.inf
    is_unbounded = np.isinf(data.lower[moving]) & np.isinf(data.upper[moving])
    lower[is_unbounded] = -np.inf
    weights = np.zeros((1, moving.size))
    weights[0, minimizer.free.size :] = 1.0
    columns = both[:, moving] * signs
    # A last row instead of the equation has the same minimizer but for a factor.
    rows = np.vstack((columns, weights))
    sides, high = np.zeros(len(rows)), np.full(moving.size, np.inf)
    sides[-1] = 1.0
    cone = minimize(Data(rows, sides, lower, high, rows[:0], sides[:0]))
    if cone is None or not cone.x.any():
        return None
    sizes = np.abs(columns) @ np.abs(cone.x)
    if not (np.abs(cone.r[:-1]) <= ZERO * sizes.max(initial=0.0)).all():
        return None
    direction = np.zeros(minimizer.x.size)
    direction[moving] = signs * cone.x
    return _without_rounding(direction)


def _without_rounding(direction: Vector) -> Vector:
    """Return the direction with entries that are rounding errors of 0 set to 0. If all
    others are integer multiples of the smallest one, up to rounding, they are replaced
    by these integers.
    """
    largest = np.abs(direction).max()
    direction = np.where(np.abs(direction) <= ZERO * largest, 0.0, direction)
    smallest = np.abs(direction[direction != 0]).min()
    integers = np.round(direction / smallest)
    are_integers = np.abs(direction / smallest - integers) <= 1e-9
    return np.asarray(integers if are_integers.all() else direction)


def _is_exact(data: Data, direction: Vector) -> bool:
    """Return whether A v = 0 and E v = 0 hold exactly for the direction v, or for
    another one close to it with the same signs.
    """
    moving = direction.nonzero()[0]
    both = np.vstack((data.A, data.E))[:, moving]
    sizes = np.linalg.svd(both, compute_uv=False)
    # If the rows are independent, a small change of v makes A v and E v exactly 0.
    smallest, largest = sizes.min(initial=np.inf), sizes.max(initial=0.0)
    if moving.size > len(both) and smallest > FULL_RANK * largest:
        return True
    if both.size > MAX_EXACT_TERMS:
        return False
    v = [Fraction(value) for value in direction[moving].tolist()]
    return all(
        sum((Fraction(a) * c for a, c in zip(row, v, strict=True)), Fraction(0)) == 0
        for row in both.tolist()
    )


def _moved(data: Data, x: Vector, along: Vector) -> Vector:
    """Return the point x + t v for the direction v (`along`), where t v is as large as
    x, or shorter if a bound is met before. If x cannot move in the direction v, the
    direction -v is used.
    """
    largest = np.abs(x[along != 0]).max(initial=0.0)
    length = (largest or 1.0) / np.abs(along).max()
    rooms = np.where(along > 0, data.upper - x, x - data.lower)[along != 0]
    length = min(length, float((rooms / np.abs(along[along != 0])).min()))
    if not length > 0 and (along < 0).any() and (along > 0).any():
        return _moved(data, x, -along) if (x - along >= data.lower).all() else x
    other: Vector = np.clip(x + length * along, data.lower, data.upper)
    return other


def states_of(data: Data, x: Vector) -> BasisStatus:
    """Return the status of each coefficient at a point within the bounds."""
    statuses = np.where(x >= data.upper, UPPER, BASIC)
    states_at_bounds: BasisStatus = np.where(x <= data.lower, LOWER, statuses).astype(
        np.int8
    )
    return states_at_bounds
