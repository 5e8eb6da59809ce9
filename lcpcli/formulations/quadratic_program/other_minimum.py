"""Whether a convex program has minimizers other than x.

x and x + d are both minimizers of a convex program if x + d satisfies rows and bounds,
Qd = 0 and c'd = 0: O. L. Mangasarian, A simple characterization of solution sets of
convex programs, Operations Research Letters 7 (1988) 21-26. Rows and bounds with a
multiplier that is not 0 hold with equality at all minimizers, and with c'd = 0 this is
equivalent to d'g = 0 for the gradient g = Qx + c.

So x is the only minimizer if Qd = 0, with these rows and bounds as equations, implies d
= 0. Otherwise there is another minimizer if some d leaves all other active rows and
bounds active; if there is no such d, an LP searches for one that may leave them.
Another minimizer is verified as a solution of the conditions, as x was.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lcpcli.formulations.quadratic_program.pivoted import Pivoted
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.linalg.doubles import ROW_ROUNDING, generator
from lcpcli.linalg.matrices import absolute_product, dense, product, stack
from lcpcli.linalg.programs import minimized
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination
from lcpcli.rational.numbers import as_written, over_one_denominator, shortest_decimal
from lcpcli.rational.rank import has_rank
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.acceptance import BY_CRITERION, accepted
from lcpcli.verify.point import Criterion, Point

# For more unknowns, an LP may take longer than the solution itself.
MAX_UNKNOWNS = 500
# Work for each of two LPs, in the seconds that it usually takes.
LP_EFFORT = 0.25
# The distance that another minimizer has to have from x, relative to |x_i|, and far
# above rounding errors.
MIN_DISTANCE = 1e-3
# A linear system for this many variables that are not at a bound is solved exactly in
# about a second.
MAX_FREE = 100
# A multiplier that is smaller, relative to the terms of its column, may be 0.
MIN_MULTIPLIER = 1e-9
# Columns are independent if no pivot is below this, relative to the largest one;
# smaller pivots may be those of dependent columns.
SURE_PIVOT = 1e-8


def has_other_minimum(
    problem: Problem,
    program: Program,
    data: Blocks,
    z: Vector,
    tol: float,
    exactly: bool,
) -> bool:
    """Return whether there is a minimizer other than the x of z, which is computed, and
    linear algebra confirms that there is more than one.

    tol : the tolerance with which another minimizer is verified.
    exactly : whether rational arithmetic has to confirm it for the decimals of the
        data; otherwise it is confirmed up to rounding.
    """
    x, y = program.parts(z)
    if problem.n > MAX_UNKNOWNS or not x.size:
        return False
    C = problem.units.diagonals()[1][: x.size]
    # The scaling of M does not determine the size of x, to which distances are
    # relative; where one x_j is far larger than its C_j, others may not be.
    C = C * min(np.abs(x / C).max() or 1.0, 1.0)
    rows, free = _may_leave(x, y, data)
    if _is_regular(_scaled(stacked(data, rows, free), C[free])):
        return False
    min_distance = MIN_DISTANCE * np.maximum(np.abs(x), C)
    # The direction is random, as a simple one may be orthogonal to the set of
    # minimizers.
    along = generator(x.size).standard_normal(x.size) / C
    for search in (_adjacent, _farthest):
        for direction in (along, -along):
            other = search(direction, x, data, C)
            if other is None or not (np.abs(other - x) > min_distance).any():
                continue
            other_z = program.z_of(other, y, data)
            point = Point(Criterion(problem, tol), other_z)
            if accepted(problem, [point], tol, BY_CRITERION) is not None:
                return _may_move(x, other, data, C, exactly)
    return False


def stacked(data: Blocks, rows: Indices, columns: Indices) -> Vector:
    """Return these columns of Q and of some rows of A, one below the other."""
    return np.vstack((dense(data.Q)[:, columns], dense(data.A[rows])[:, columns]))


def _may_leave(x: Vector, y: Vector, data: Blocks) -> tuple[Indices, Indices]:
    """Return the rows that hold with equality at all minimizers, and the variables that
    may leave their bounds because their multipliers may be 0.
    """
    slopes, sizes = product(data.Q, x) + data.c, np.abs(y)
    terms = data.gradient_terms(np.abs(x), sizes)
    of_bounds = np.abs(slopes - product(data.A.T, y))
    fixed = data.lower == data.upper
    shares = np.abs(dense(data.A)) / np.where(terms > 0, terms, np.inf)
    is_strict = sizes * shares.max(axis=1, initial=0.0) > MIN_MULTIPLIER
    rows = is_strict | (data.row_lower == data.row_upper)
    free = ~fixed & ~(of_bounds > MIN_MULTIPLIER * terms)
    return np.flatnonzero(rows), np.flatnonzero(free)


def _scaled(A: Vector, C: Vector) -> Vector:
    """Return A with its columns multiplied by C, and then its rows divided by their
    largest entries, without rows of zeros.
    """
    A = A * C
    sizes = np.abs(A).max(axis=1, initial=0.0)
    return np.asarray(A[sizes > 0] / sizes[sizes > 0, np.newaxis])


def _is_regular(A: Vector) -> bool:
    """Return whether the columns of A are certainly independent."""
    if A.shape[0] < A.shape[1]:
        return False
    return not A.size or bool(Pivoted(A).pivots.min() > SURE_PIVOT)


def _adjacent(direction: Vector, x: Vector, data: Blocks, C: Vector) -> Vector | None:
    """Return another minimizer at which the same rows and bounds are active, in about
    this direction; None if there is none."""
    rows, free = _held(x, data, C)
    A = _scaled(stacked(data, rows, free), C[free])
    if not A.size:
        return None
    null = Pivoted(A).null
    d = np.zeros(x.size)
    d[free] = C[free] * (null @ (null.T @ (direction[free] * C[free])))
    if not d.any():
        return None
    Ax, Ad = product(data.A, x), product(data.A, d)
    slacks = [
        np.where(move > 0, high - value, value - low) / np.abs(move)
        for value, move, low, high in (
            (x, d, data.lower, data.upper),
            (Ax, Ad, data.row_lower, data.row_upper),
        )
    ]
    moving = (
        np.abs(d) > 0,
        np.abs(Ad) > ROW_ROUNDING * (absolute_product(data.A, np.abs(d))),
    )
    reach = (1.0 + np.abs(x / C).max()) / np.abs(d / C).max()
    steps = (
        slack[move].min(initial=reach)
        for slack, move in zip(slacks, moving, strict=True)
    )
    return np.asarray(x + min(steps) / 2 * d)


def _held(x: Vector, data: Blocks, C: Vector) -> tuple[Indices, Indices]:
    """Return the active rows, and the variables that are not at a bound."""
    rows = _active(
        product(data.A, x),
        absolute_product(data.A, np.abs(x)),
        data.row_lower,
        data.row_upper,
    )
    bounds = _active(x, np.maximum(np.abs(x), C), data.lower, data.upper)
    return np.flatnonzero(rows), np.flatnonzero(~bounds)


def _active(values: Vector, sizes: Vector, low: Vector, high: Vector) -> Mask:
    """Return which values are at a lower or upper bound. The tolerance is far smaller
    than the distance that distinguishes two minimizers.
    """
    is_active_within = MIN_DISTANCE**2 * sizes
    active: Mask = (values - low <= is_active_within) | (
        high - values <= is_active_within
    )
    return active


def _farthest(objective: Vector, x: Vector, data: Blocks, C: Vector) -> Vector | None:
    """Return the minimizer with the least objective'x among those at a distance of at
    most about |x| from x.
    """
    reach = 1.0 + np.abs(x / C).max()
    low = np.maximum((data.lower - x) / C, -reach)
    high = np.minimum((data.upper - x) / C, reach)
    Ax, nothing = product(data.A, x), np.zeros(x.size + 1)
    A = dense(stack([[data.Q], [data.c[np.newaxis]], [data.A]])) * C
    # The tolerances of the LP solver are for numbers of size 1.
    sizes_of_rows = np.abs(A).max(axis=1)
    sizes_of_rows[sizes_of_rows == 0] = 1.0
    row_low, row_high = (
        np.concatenate((nothing, side - Ax)) / sizes_of_rows
        for side in (data.row_lower, data.row_upper)
    )
    objective = objective * C
    optimum = minimized(
        objective / np.abs(objective).max(),
        A / sizes_of_rows[:, np.newaxis],
        (np.minimum(row_low, 0.0), np.maximum(row_high, 0.0)),
        (np.minimum(low, 0.0), np.maximum(high, 0.0)),
        LP_EFFORT,
    )
    if optimum is None:
        return None
    y = x + C * optimum.x
    nearer = np.where(y - data.lower <= data.upper - y, data.lower, data.upper)
    # Variables at a bound may differ from it by the LP solver's rounding, about 1e-12.
    sizes = np.maximum(np.abs(y), C)
    return np.where(_active(y, sizes, data.lower, data.upper), nearer, y)


def _may_move(x: Vector, other: Vector, data: Blocks, C: Vector, exactly: bool) -> bool:
    """Return whether there is a minimizer besides x in about the direction of another
    point, which may seem to be one by rounding alone: whether, at the point between
    them, Qd = 0, c'd = 0 and the active rows and bounds admit a d that is not 0, for
    the decimals of the data in rational arithmetic, or up to rounding, and one such d
    leads from x about half the way."""
    rows, free = _held((x + other) / 2, data, C)
    if not 0 < free.size <= MAX_FREE:
        return False
    parts = (
        dense(data.Q)[:, free],
        data.c[np.newaxis, free],
        dense(data.A[rows])[:, free],
    )
    null = _null_space(parts, C[free], exactly)
    if not null.shape[1]:
        return False
    d = null @ (null.T @ ((other - x)[free] / C[free]))
    between = x.copy()
    between[free] += 0.5 * C[free] * d
    has_moved = np.abs(between - x) > 0.5 * MIN_DISTANCE * np.maximum(np.abs(x), C)
    reached_rows, inside = _held(between, data, C)
    return (
        bool(has_moved.any())
        and set(reached_rows) <= set(rows)
        and set(free) <= set(inside)
    )


def _null_space(parts: Sequence[Vector], C: Vector, exactly: bool) -> Vector:
    """Return an orthonormal basis of the d / C with A d = 0, for the rows of all parts
    of A, shape (k, r); of the exact null space of their decimals, or up to rounding."""
    A = _scaled(np.vstack(parts), C)
    if not A.size:
        return np.eye(C.size)
    factors = Pivoted(A)
    null, columns = factors.null, factors.independent
    if exactly:
        integers = np.vstack([_whole_rows(part) for part in parts])
        rows = Pivoted(A[:, columns].T).order[: columns.size]
        if not has_rank(integers, np.sort(rows), np.sort(columns)):
            null = _exact_null_vectors(integers) / C[:, np.newaxis]
    return np.asarray(np.linalg.qr(null)[0])


def _whole_rows(A: Vector) -> Any:
    """Return multiples of the rows of decimals in integers, without rows of zeros; in
    double precision if that represents them exactly.
    """
    A = A[A.any(axis=1)]
    integers, _ = as_written(A)
    if np.array_equal(integers, np.rint(integers)):
        return integers
    rows = [
        over_one_denominator(list(map(shortest_decimal, row)))[0] for row in A.tolist()
    ]
    return np.array(rows, dtype=object)


def _exact_null_vectors(A: Any) -> Vector:
    """Return a basis of the null space, of integers rounded once, in columns."""
    rows = [[int(value) for value in row] for row in A.tolist()]
    basis = elimination.solve(rows, [0] * len(rows))[1]
    sizes = [max(map(abs, vector)) for vector in basis]
    vectors = [
        [float(value / size) for value in vector]
        for vector, size in zip(basis, sizes, strict=True)
    ]
    return np.asarray(np.reshape(vectors, (len(vectors), A.shape[1])).T, dtype=float)
