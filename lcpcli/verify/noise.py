"""Points without what rounding left of zeros: components at bounds, distances from the reference point, entries of q.

A method leaves a z_j of 1e-17 where 0 is meant, and a row whose terms are all of that kind is violated by its own
terms, however small these are beside the numbers of the problem. So points are tried in which such z_j are at their
bounds or at the reference point; each of them is then measured as any other.

The q of large problems from other sources has entries like 2e-16 beside 1 that are rounding of 0, as they were computed
as sums that cancel. An entry counts as 0 if its row is violated, and

- |q_i| is the only term of the row, so that no z_j of that size was computed wrong, and no whole number,
- it is at most ROW_ROUNDING of the cap of the row, as rounding of the other numbers of its part of the problem may be,
- as it is and in the units of M, it is by a factor in ROUNDING_OF_Q smaller than each of the LARGER_SHARE largest
  |q_j| != 0 of this part, which are at least FEWEST_LARGER: a few large numbers do not make rounding of the others,
- and LITERAL_STEPS of block pivoting from the states of the point find no solution for q as it is.

For up to FEW_UNKNOWNS exact arithmetic decides what matters. Entries of M and bounds never count as 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import islice, product

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.linalg.doubles import SMALL_DISTANCE, distinct, size
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.units import LARGEST_POWER
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, States, Vector
from lcpcli.verify.measure import FEW_UNKNOWNS, Measure

ROUNDING_OF_Q = 1e-24, 1e-12  # of the least of the larger entries of q: an entry that may be rounding of 0
LARGER_SHARE, FEWEST_LARGER = 1 / 3, 8  # of the entries of q that are not 0, in a part of M
LITERAL_STEPS = 8  # of block pivoting, each at the cost of a factorization


def on_bounds(measure: Measure, z: Vector, w: Vector) -> Vector:
    """Return the nearest admissible z, on the bounds that it is closer to than w_i is to 0, in the units of M."""
    units, box = measure.data.units, measure.data.box
    powers = np.clip(units.rows + units.columns, -LARGEST_POWER, LARGEST_POWER)
    return box.on_bounds(z, w, np.exp2(-powers))[0]


@np.errstate(divide="ignore")
def without_small_distances(measure: Measure, z: Vector) -> Vector:
    """Return z with the reference point in place of components at distances from it that are small beside k and beside
    the largest in their component of M, and 0 in place of those that are as small themselves and may be 0; and with the
    reference point in all components whose rows it satisfies, as they are with the other z_i in place."""
    units, reference = measure.data.units, measure.reference
    distances, sizes = np.log2(np.abs(z - reference)) - units.columns, measure.unsolved_sizes(z)
    small = np.minimum(units.largest(distances, units.column_part), sizes)[units.column_part]
    small += np.log2(SMALL_DISTANCE)
    is_solved = ~(sizes > -np.inf)
    near = np.where(distances <= small, reference, z)
    if measure.data.reference_z is not None:
        tiny = np.log2(np.abs(near)) - units.columns <= small
        near = np.where(tiny & (measure.data.box.project(np.zeros_like(z)) == 0), 0.0, near)
    while True:
        cleaned = np.where(is_solved[units.column_part], reference, near)
        violated = is_solved[units.row_part] & (measure.violations(cleaned, measure.reference_w) > 0)
        if not violated.any():
            return cleaned
        is_solved[units.row_part[violated]] = False


def without_columns(measure: Measure, z: Vector, rows: Indices) -> Vector | None:
    """Return z with the reference point in place of the components that these rows of M use; None if that is z."""
    used, cleaned = _columns(measure.data.M, rows), z.copy()
    cleaned[used] = measure.reference[used]
    return None if np.array_equal(cleaned, z) else cleaned


@np.errstate(divide="ignore")
def negligible_q(measure: Measure, q: Vector, z: Vector, rows: Indices) -> Indices:
    """Return those of some violated rows, whose terms may be rounding of 0, whose q_i count as 0; all, or none."""
    data, parts = measure.data, measure.data.units.row_part
    if q.size <= FEW_UNKNOWNS or (q[rows] == np.rint(q[rows])).any() or z[_columns(data.M, rows)].any():
        return rows[:0]
    in_units = np.log2(np.abs(data.q)) + data.units.rows
    for sizes, number in product((np.log2(np.abs(q)), in_units), distinct(parts[rows]).tolist()):
        own = np.sort(sizes[(parts == number) & (data.q != 0)])
        larger = own[own.size - int(np.ceil(LARGER_SHARE * own.size)) :]
        if larger.size < FEWEST_LARGER:
            return rows[:0]
        factors = sizes[rows[parts[rows] == number]] - larger[0]
        if factors.min() < np.log2(ROUNDING_OF_Q[0]) or factors.max() > np.log2(ROUNDING_OF_Q[1]):
            return rows[:0]
    return rows


def with_small_components(problem: Problem, z: Vector) -> Iterator[Vector]:
    """Yield the basic solution of the states of z if it differs from z by rounding, and components of z are smaller
    than those of the reference point: as differences from it they lose digits."""
    largest = max(size(z), size(problem.reference_point))
    is_smaller = (np.abs(z) < np.abs(problem.reference_point)).any()
    for found in islice(pivoted(problem, problem.box.basis_at(z)), 1 if is_smaller else 0):
        if size(found - z) <= SMALL_DISTANCE * largest:
            yield found


def pivoted(problem: Problem, basis: States) -> Iterator[Vector]:
    """Yield the z of the first steps of block pivoting from a basis, as long as there are any."""
    solutions = BasicSolutions(problem)
    with suppress(SingularMatrix):
        for found in islice(solutions.exchanging(basis), LITERAL_STEPS):
            yield problem.box.project(found.z)
            if not solutions.count_violations(found):
                return


def _columns(M: Matrix, rows: Indices) -> Indices:
    if not is_sparse(M):
        return np.flatnonzero(M[rows].any(axis=0))
    owned = np.zeros(M.shape[0], dtype=bool)
    owned[rows] = True
    return distinct(M.indices[np.repeat(owned, np.diff(M.indptr))])
