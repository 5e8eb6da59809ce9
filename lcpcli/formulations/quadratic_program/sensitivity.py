"""How the optimal value of a convex program changes with the bounds of its rows and
variables.

A multiplier is the derivative of the optimal value with respect to its bound only if it
is unique. In general, the value v(b) of a program min f(x) with bounds b is a convex
function of b. Its one-sided derivatives are determined by the least and the greatest of
all optimal multipliers:

    v'(b; -e_i) = -min y_i,    v'(b; e_i) = max y_i,

infinite if no such change is feasible (J. Gauvin, Directional derivative for the value
function in mathematical programming, in: Nonsmooth Optimization and Related Topics,
Plenum 1989, 167-183; R. T. Rockafellar, Convex Analysis, Princeton 1970, theorems 23.4
and 29.1). Optimal are the multipliers y of the active rows and u of the active bounds
with the right signs and Qx + c = A'y + u. With F the variables that are not at a bound,
they are those known plus N t, for a basis N of the null space of A_F' of the active
rows; a polyhedron in t, which is a point if N has no columns. In few dimensions its
vertices and rays are those of all systems of so many of its inequalities, and else two
linear programs are solved for each multiplier that varies.

Where a distance from a side, or a multiplier, is larger than rounding of its terms, but
may be an error of x, all of that is begun again at the solution of the decimals of the
data in rational arithmetic; where there is none in short time, nothing is said.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.formulations.quadratic_program.pivoted import Pivoted
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.doubles import (
    ROUNDING,
    ROW_ROUNDING,
    SIGN_ROUNDING,
    SMALL_DISTANCE,
    generic,
)
from lcpcli.linalg.matrices import (
    absolute_product,
    dense,
    product,
    row_maxima,
    scaled,
)
from lcpcli.linalg.programs import minimized
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

# With this many products, A_F is factorized in about the time that a solution takes.
MAX_WORK = 1e8
# This many systems of inequalities are solved together in about a millisecond.
MAX_SYSTEMS = 3000
# Linear programs, of about a millisecond each; and the effort of each, in usual
# seconds.
MAX_PROGRAMS, PROGRAM_EFFORT = 40, 0.01
# Unknowns, and the effort in usual seconds, for a solution in rational arithmetic.
MAX_EXACT_UNKNOWNS, EXACT_EFFORT = 100, 0.1
# Of each of two linear programs that show whether multipliers vary; and how far they
# have to, relative to the largest slack, far above the tolerance of these programs.
RANGE_EFFORT, MIN_RANGE = 0.1, 1e-5
# Relative to the terms: what a multiplier may be off in doubles, and what inequalities
# may be violated by at a vertex.
NEGLIGIBLE = 1e-9
# Relative to its terms, or to the largest multiplier: what may be rounding alone.
NOISE = 4 * ROW_ROUNDING


class _Unclear(Exception):
    """A number is neither 0 up to rounding nor safely another."""


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """The derivatives of the optimal value of a convex program with respect to active
    bounds, as a bound decreases and as it increases: 0 for bounds that are not active,
    infinite where no such change is feasible. Equal lower and upper bounds move
    together.

    are_unique : whether the multipliers are unique, so that both derivatives are the
        same.
    down, up : the derivatives for the rows, shape (m,).
    bounds_down, bounds_up : those for the bounds of the variables, shape (k,). All four
        are None if they would take too long.
    """

    are_unique: bool
    down: Vector | None = None
    up: Vector | None = None
    bounds_down: Vector | None = None
    bounds_up: Vector | None = None


class _Signs(NamedTuple):
    """For each row or variable whether its multiplier may be positive, as its lower
    bound is active, and whether it may be negative, as its upper bound is.
    """

    positive: Mask
    negative: Mask

    @property
    def active(self) -> Mask:
        return self.positive | self.negative

    @property
    def required(self) -> Vector:
        """Return the signs that nonzero multipliers must have; 0 where both signs are
        possible.
        """
        return self.positive * 1.0 - self.negative * 1.0


class _Optimum(NamedTuple):
    """Which rows and bounds are active, and multipliers of both, at a solution.

    error : what these multipliers may be off by, relative to the largest one.
    """

    rows: _Signs
    bounds: _Signs
    y: Vector
    u: Vector
    error: float


@np.errstate(all="ignore")
def sensitivities(
    problem: Problem, program: Program, data: Blocks, z: Vector, tol: float
) -> Sensitivities | None:
    """Return the derivatives of the optimal value of a convex program at a solution z
    of its conditions; None if it takes too long to see whether multipliers are unique,
    or rounding hides it.

    tol : how close to its side a row may be, relative to its terms, where it is active.
    """
    with suppress(_Unclear):
        optimum = _up_to_rounding(problem, program, data, z, tol)
        return _derivatives(problem, program, data, optimum)
    with suppress(_Unclear, TimeIsUp):
        return _derivatives(problem, program, data, _exact(problem, program, data, z))
    return None


def _derivatives(
    problem: Problem, program: Program, data: Blocks, optimum: _Optimum
) -> Sensitivities | None:
    """Return the derivatives at an optimum; None if they take too long. Raises
    _Unclear."""
    rows, bounds, y, u, error = optimum
    R, C = problem.units.diagonals()
    of_x = C[: u.size]
    of_y = C[u.size : u.size + y.size]
    of_u = 1 / R[: u.size]
    P, F, J = (
        np.flatnonzero(each) for each in (rows.active, ~bounds.active, bounds.active)
    )
    if P.size * F.size * min(P.size, F.size) > MAX_WORK:
        return None
    A = dense(data.A[P]) * of_y[P, np.newaxis]
    N = Pivoted((A[:, F] * of_x[F]).T).null
    changes = np.vstack((N, -(A[:, J] / of_u[J]).T @ N))
    values = np.concatenate((y[P] / of_y[P], u[J] / of_u[J]))
    required = np.concatenate((rows.required[P], bounds.required[J]))
    ranges = _ranges(values, changes, required, error)
    if ranges is None:
        return Sensitivities(False)
    sign = program.sign
    of_sides = []
    for extremes in ranges:
        of_rows, of_bounds = np.zeros(y.size), np.zeros(u.size)
        of_rows[P] = sign * of_y[P] * extremes[: P.size]
        of_bounds[J] = sign * of_u[J] * extremes[P.size :]
        of_sides += [of_rows + 0.0, of_bounds + 0.0]
    down, bounds_down, up, bounds_up = of_sides
    are_unique = bool((ranges[0] == ranges[1]).all())
    return Sensitivities(are_unique, down, up, bounds_down, bounds_up)


def _up_to_rounding(
    problem: Problem, program: Program, data: Blocks, z: Vector, tol: float
) -> _Optimum:
    """Return the optimum at z. Raises _Unclear."""
    x, y = program.parts(z)
    of_x = problem.units.diagonals()[1][: x.size]
    sizes = np.abs(x)
    u = product(data.Q, x) + data.c - product(data.A.T, y)
    terms = data.gradient_terms(sizes, np.abs(y))
    # The largest share of a row in the terms of a column.
    shares = row_maxima(scaled(data.A, np.abs(y), np.where(terms > 0, 1 / terms, 0.0)))
    y = np.where(_is_nonzero(shares, NOISE, NEGLIGIBLE), y, 0.0)
    u = np.where(_is_nonzero(np.abs(u), NOISE * terms, NEGLIGIBLE * terms), u, 0)
    largest = of_x * np.abs(x / of_x).max()
    bounds = _active(
        x,
        (data.lower, data.upper),
        (NOISE * sizes + ROUNDING * largest, tol * sizes + SMALL_DISTANCE * largest),
        u,
    )
    terms = absolute_product(data.A, sizes)
    sides = data.row_lower, data.row_upper
    rows = _active(product(data.A, x), sides, (NOISE * terms, tol * terms), y)
    return _Optimum(rows, bounds, y, u, NEGLIGIBLE)


def _is_nonzero(sizes: Vector, rounding: Vector | float, error: Vector | float) -> Mask:
    """Return which sizes are larger than rounding; raise _Unclear if some of these are
    no larger than an error may be."""
    nonzero: Mask = sizes > rounding
    if (nonzero & (sizes <= error)).any():
        raise _Unclear
    return nonzero


def _active(
    values: Vector,
    sides: tuple[Vector, Vector],
    distances: tuple[Vector, Vector],
    multipliers: Vector,
) -> _Signs:
    """Return at which sides values are: those of a known multiplier, and those that are
    close to one. distances : up to which they are, and up to which they may be."""
    low, high = sides
    max_zero, far = distances
    positive, negative = multipliers > 0, multipliers < 0
    # A value with a multiplier is at its side, however far it seems to be.
    below = np.where(positive, 0.0, np.abs(values - low))
    above = np.where(negative, 0.0, np.abs(high - values))
    return _Signs(
        ~_is_nonzero(below, max_zero, far), ~_is_nonzero(above, max_zero, far)
    )


def _exact(problem: Problem, program: Program, data: Blocks, z: Vector) -> _Optimum:
    """Return the optimum of the decimals of the data. Raises _Unclear, and TimeIsUp."""
    with imports:
        from lcpcli.rational.elimination import Effort
        from lcpcli.rational.exact_problem import ExactProblem, decimal_parts_of
        from lcpcli.verify.exact_solution import from_point
    if problem.n > MAX_EXACT_UNKNOWNS:
        raise _Unclear
    exact = ExactProblem(problem, *decimal_parts_of(problem))
    solution = from_point(exact, z, Effort(EXACT_EFFORT))
    if solution is None:
        raise _Unclear
    k, m = program.variables, data.row_lower.size
    signs_of_z, w = _signs(solution), exact.w(solution)
    u = _rounded(w[:k])
    y = _rounded(solution[k : k + m])
    signs = _signs(w)
    low, high = (
        np.array([a == b for a, b in zip(solution, bound, strict=True)], dtype=bool)
        for bound in (exact.lower, exact.upper)
    )
    bounds = _Signs(low[:k] | (signs[:k] > 0), high[:k] | (signs[:k] < 0))
    # Of rows between two sides, s is the value; of others, w is the distance.
    is_equal, of_y = signs[k : k + m] == 0, signs_of_z[k : k + m]
    positive = is_equal & np.isfinite(data.row_lower)
    negative = is_equal & np.isfinite(data.row_upper)
    positive[data.ranges], negative[data.ranges] = low[k + m :], high[k + m :]
    rows = _Signs(positive | (of_y > 0), negative | (of_y < 0))
    return _Optimum(rows, bounds, y, u, SMALL_DISTANCE)


def _signs(values: Sequence[Fraction]) -> Vector:
    return np.array([(value > 0) - (value < 0) for value in values], dtype=np.int8)


def _rounded(values: Sequence[Fraction]) -> Vector:
    return np.array(list(map(float, values)), dtype=float)


def _ranges(
    values: Vector, changes: Vector, required: Vector, error: float
) -> tuple[Vector, Vector] | None:
    """Return the least and the greatest of values + changes t, shape (p,), for all t
    for which these have the required signs; None if it takes too long. Raises _Unclear.

    error : of values, and of their range, relative to the largest one.
    """
    lowest, greatest = values.copy(), values.copy()
    largest = np.abs(changes).max(axis=0, initial=0.0)
    changes = np.where(np.abs(changes) <= SIGN_ROUNDING * largest, 0.0, changes)
    varies = changes.any(axis=1)
    limited = varies & (required != 0)
    G, b = _normalized(required, changes, values, limited)
    # Directions t in the null space of G are not limited by any inequality.
    _, sizes, right = np.linalg.svd(G)
    rank = int(np.count_nonzero(sizes > max(G.shape, default=1) * ROW_ROUNDING))
    lines, changes = changes @ right[rank:].T, changes @ right[:rank].T
    is_free = (np.abs(lines) > SIGN_ROUNDING).any(axis=1)
    lowest[is_free], greatest[is_free] = -np.inf, np.inf
    rest = np.flatnonzero(varies & ~is_free)
    if not rest.size or not rank:
        return lowest, greatest
    G = G @ right[:rank].T
    bounded = _extremes(changes[rest], G, b)
    if bounded is None:
        if not is_free.any() and not _has_range(G, b):
            raise _Unclear
        return None
    below, above = bounded
    scale = np.abs(values).max()
    for extremes, change in ((lowest, below), (greatest, above)):
        moves = _is_nonzero(np.abs(change), NOISE * scale, error * scale)
        extremes[rest] += np.where(moves, change, 0.0)
        stays = ~_is_nonzero(np.abs(extremes), NOISE * scale, error * scale)
        extremes[stays] = 0.0
    return lowest, greatest


def _normalized(
    required: Vector, changes: Vector, values: Vector, limited: Mask
) -> tuple[Vector, Vector]:
    """Return G and b >= 0 of the inequalities G t >= -b that require the signs, with
    rows of G whose largest entries are 1 or -1.
    """
    G = required[limited, np.newaxis] * changes[limited]
    b = np.maximum(required * values, 0.0)[limited]
    sizes = np.abs(G).max(axis=1, initial=0.0)
    return G / sizes[:, np.newaxis], b / sizes


def _extremes(objectives: Vector, G: Vector, b: Vector) -> tuple[Vector, Vector] | None:
    """Return the least and the greatest value of each of the objectives, shape (m, r),
    over all t with G t >= -b. This polyhedron must contain 0 and have vertices.
    """
    if math.comb(len(G), G.shape[1]) > MAX_SYSTEMS:
        return _by_programs(objectives, G, b)
    vertices, is_clear = _vertices(G, b)
    t, rays = objectives @ vertices, objectives @ _rays(G)
    lowest, greatest = t.min(axis=1, initial=0.0), t.max(axis=1, initial=0.0)
    clear = t[:, is_clear]
    certain = clear.min(axis=1, initial=0.0), clear.max(axis=1, initial=0.0)
    for extremes, certain_extremes in zip((lowest, greatest), certain, strict=True):
        difference = np.abs(extremes - certain_extremes)
        if (difference > SMALL_DISTANCE * np.abs(extremes)).any():
            raise _Unclear
    lowest[(rays < -SIGN_ROUNDING).any(axis=1)] = -np.inf
    greatest[(rays > SIGN_ROUNDING).any(axis=1)] = np.inf
    return lowest, greatest


def _vertices(G: Vector, b: Vector) -> tuple[Vector, Mask]:
    """Return the vertices of G t >= -b, in columns, and which of them violate no
    inequality by more than rounding."""
    r = G.shape[1]
    chosen = np.array(list(combinations(range(len(G)), r)), dtype=np.intp)
    systems = G[chosen]
    regular = np.abs(np.linalg.det(systems)) > SIGN_ROUNDING
    sides = -b[chosen[regular]][:, :, np.newaxis]
    t = np.linalg.solve(systems[regular], sides)[:, :, 0].T
    slacks, terms = G @ t + b[:, np.newaxis], np.abs(G) @ np.abs(t) + b[:, np.newaxis]
    is_vertex = (slacks >= -NEGLIGIBLE * terms).all(axis=0)
    is_clear = (slacks >= -SMALL_DISTANCE * terms).all(axis=0)
    return t[:, is_vertex], is_clear[is_vertex]


def _rays(G: Vector) -> Vector:
    """Return the extreme rays of {t : G t >= 0} as columns."""
    r = G.shape[1]
    chosen = np.array(list(combinations(range(len(G)), r - 1)), dtype=np.intp)
    _, sizes, right = np.linalg.svd(G[chosen.reshape(len(chosen), r - 1)])
    regular = (sizes > SIGN_ROUNDING).all(axis=1)
    t = right[regular, -1].T
    t = np.hstack((t, -t))
    return np.asarray(t[:, (G @ t >= -NEGLIGIBLE).all(axis=0)])


def _by_programs(
    objectives: Vector, G: Vector, b: Vector
) -> tuple[Vector, Vector] | None:
    """Return what `_extremes` returns, by linear programs; None if there are too many
    of them, or one takes too long.
    """
    if 4 * len(objectives) > MAX_PROGRAMS:
        return None
    unlimited = np.full(len(b), np.inf)
    ones, infinite = np.ones(G.shape[1]), np.full(G.shape[1], np.inf)
    extremes = np.zeros((2, len(objectives)))
    for i, objective in enumerate(objectives):
        for k, sign in enumerate((1.0, -1.0)):
            cone, box = (np.zeros(len(b)), unlimited), (-ones, ones)
            ray = minimized(sign * objective, G, cone, box, PROGRAM_EFFORT)
            if ray is None:
                return None
            if ray.value < -NEGLIGIBLE:
                extremes[k, i] = -sign * np.inf
                continue
            box = -infinite, infinite
            optimum = minimized(
                sign * objective, G, (-b, unlimited), box, PROGRAM_EFFORT
            )
            if optimum is None:
                return None
            extremes[k, i] = sign * optimum.value
    return extremes[0], extremes[1]


def _has_range(G: Vector, b: Vector) -> bool:
    """Return whether a linear program finds a t that is not 0 with G t >= -b."""
    r, size = G.shape[1], float(b.max(initial=0.0)) or 1.0
    limit, unlimited = np.full(r, size), np.full(len(b), np.inf)
    optima = (
        minimized(sign * generic(r), G, (-b, unlimited), (-limit, limit), RANGE_EFFORT)
        for sign in (1.0, -1.0)
    )
    return any(each is not None and each.value < -MIN_RANGE * size for each in optima)
