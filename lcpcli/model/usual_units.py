"""A problem in units that its own numbers suggest, in which the thresholds of the
methods that `auto` combines mean the same whatever the units of measurement.

The scaling of Curtis and Reid (see `linalg.units`) leaves one factor free in each
connected component of rows and columns. A linear program has two components: its
variables with the sides of its rows, and its multipliers with the costs. A quadratic
objective joins them. The factor makes the median of the nonzero right-hand sides of a
component 1 or, where all of them are 0, that of its finite bounds; of a problem that is
no program the largest instead of the median, which no tiny sides can turn. All factors
are powers of two, so that nothing is rounded.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.errors import count
from lcpcli.linalg import matrices
from lcpcli.linalg.units import LARGEST_POWER, Units
from lcpcli.model.box import MIN_FAR, NO_BOUND
from lcpcli.model.changes import (
    USUAL,
    USUAL_ENTRY,
    USUAL_IN_PROGRAM,
    Change,
    Scaled,
    is_of_usual_size,
    median,
)
from lcpcli.model.problem import Facts, Problem
from lcpcli.model.right_hand_sides import like_with
from lcpcli.typing import Indices, Matrix, Vector

# Rounding of a logarithm changes no power of two unless the logarithm is close to this
# above an integer: at .5, as often for entries 1 and 2, it might.
UPWARDS = 0.54
# The largest |log2 R_i - log2 C_i| if |M| is symmetric, up to errors of the fit.
SYMMETRIC = 1e-2


@np.errstate(all="ignore")  # an entry may over- or underflow
def in_usual_units(problem: Problem) -> Change:
    """Return the problem in its own units, with its inverse transformation; itself if
    these hardly differ from those in which it is given, or if its formulation has
    methods for it as it is given.

    The problem of a program remains that of a program: R_i C_j is the same for each
    pair of entries M_ij and M_ji.
    """
    same = Change(problem, problem)
    block_form = problem.block_form
    is_plain = problem.origin is None or problem.origin.is_names_alone
    if (
        not problem.n
        or (block_form is None and not is_plain)
        or is_of_usual_size(problem)
    ):
        return same
    units = problem.units
    limit = math.log2(USUAL if block_form is None else USUAL_IN_PROGRAM)
    of_matrix = _factors_of_matrix(problem, units)
    powers = _powers_of_components(problem, units, of_matrix)
    if not (of_matrix.any() or np.abs(powers).max(initial=0.0) > limit):
        return same
    rows = of_matrix + powers[units.row_part]
    columns = of_matrix - powers[units.column_part]
    if max(np.abs(rows).max(), np.abs(columns).max()) > LARGEST_POWER:
        return same
    return _scaled(problem, rows, columns, of_matrix)


def _factors_of_matrix(problem: Problem, units: Units) -> Vector:
    """Return log2 of the factors R = C that the matrix suggests if |M| is symmetric;
    zeros if it is not, or its entries are of usual size."""
    none = np.zeros(problem.n)
    powers = (units.rows + units.columns) / 2
    if np.abs(powers).max() <= math.log2(USUAL_ENTRY) / 2:
        return none
    if np.abs(units.rows - units.columns).max() > SYMMETRIC:
        return none
    powers = np.floor(powers + 1 - UPWARDS)
    block_form = problem.block_form
    if block_form is not None and block_form.ranges:
        # The slack of a row between two bounds has the units of the row.
        first = problem.n - block_form.ranges
        rows, slacks = problem.M[block_form.variables : first, first:].nonzero()
        powers[first + slacks] = -powers[block_form.variables + rows]
    return powers


def _powers_of_components(problem: Problem, units: Units, of_matrix: Vector) -> Vector:
    """Return log2 of the factor of R, and of 1 / C, in each connected component."""
    typical = _largest if problem.block_form is None else _medians
    powers = -typical(problem.q, of_matrix, units.row_part, units.parts)
    if np.isnan(powers).any():
        bounds = _counted_bounds(*problem.box.vectors(problem.n))
        of_bounds = typical(
            np.concatenate(bounds),
            np.concatenate((-of_matrix, -of_matrix)),
            np.concatenate((units.column_part, units.column_part)),
            units.parts,
        )
        powers = np.where(np.isnan(powers), -of_bounds, powers)
    return np.floor(np.nan_to_num(powers) + 1 - UPWARDS)


def _counted_bounds(lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """Return the bounds, 0 for those that are infinite or are likely to mean so."""
    return np.where(lower > -MIN_FAR, lower, 0), np.where(upper < MIN_FAR, upper, 0)


def _medians(values: Vector, powers: Vector, part: Indices, parts: int) -> Vector:
    """Return the median of log2 |value| + power over the nonzero values of each
    component; NaN where there are none."""
    used = values != 0
    logarithms = np.log2(np.abs(values[used])) + powers[used]
    if parts == 1:
        return np.array([median(logarithms) if logarithms.size else np.nan])
    order = np.lexsort((logarithms, part[used]))
    logarithms = logarithms[order]
    counts = np.bincount(part[used], minlength=parts)
    last = np.cumsum(counts)
    low = np.where(counts, last - counts + (counts - 1) // 2, 0)
    high = np.where(counts, last - counts + counts // 2, 0)
    if not logarithms.size:
        return np.full(parts, np.nan)
    middle = (logarithms[low] + logarithms[high]) / 2
    return np.where(counts, middle, np.nan)


def _largest(values: Vector, powers: Vector, part: Indices, parts: int) -> Vector:
    """Return the largest log2 |value| + power over the nonzero values of each
    component; NaN where there are none."""
    used = values != 0
    largest = np.full(parts, -np.inf)
    np.maximum.at(largest, part[used], np.log2(np.abs(values[used])) + powers[used])
    return np.where(np.isfinite(largest), largest, np.nan)


def _scaled(
    problem: Problem, rows: Vector, columns: Vector, of_matrix: Vector
) -> Change:
    """Return the problem scaled by these powers of two, the problem itself if an
    entry of q overflows. M stays as it is if all powers `of_matrix` are 0."""
    R, C = np.exp2(rows), np.exp2(columns)
    q = R * problem.q
    box = problem.box if problem.box.is_orthant else problem.box.in_units(C)
    if not np.isfinite(q).all():
        return Change(problem, problem)
    q.setflags(write=False)
    M: Matrix | None = None
    facts: Facts | None = None
    if of_matrix.any():
        M, units = matrices.scaled(problem.M, R, C), problem.units
        (M.data if matrices.is_sparse(M) else M).setflags(write=False)
        facts = Facts(M, problem.block_form)
        facts.units = units._replace(
            rows=units.rows - of_matrix, columns=units.columns - of_matrix
        )
    scaled = like_with(problem, q, box, M, facts).having(x0=None, x1=None)
    change = Scaled(scaled, problem, R, C)
    if problem.x0 is None:
        return change
    return Scaled(scaled.having(x0=change.start(problem.x0)), problem, R, C)


def remark(problem: Problem) -> str:
    """Return how many far sides there are and what to do if they mean infinite ones; ""
    if there are none, or if they are of usual size in the units of the problem."""
    if not (problem.has_far_sides and in_usual_units(problem).problem.has_far_sides):
        return ""
    assert problem.far_sides is not None
    sides, smallest, _ = problem.far_sides
    power = min(math.floor(math.log10(smallest)), math.floor(math.log10(NO_BOUND)))
    return (
        f"{count(sides.number, 'bound')} of 1e{power} or more; --infinity 1e{power} "
        "makes them infinite"
    )
