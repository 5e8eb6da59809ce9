"""The exact solution of the complementary basis of a point near a solution.

With P = {i : z_i > 0}, M_PP z_P = -q_P is solved in rational arithmetic, and the signs are checked. If P is not quite
right, indices that violate them are flipped as in the block principal pivoting of `basic_solution`. Where M_PP is
singular, an LP finds a vertex of the solutions with that set.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import distinct
from lcpcli.linalg.linear_program import linprog
from lcpcli.model.box import BASIC, LOWER, ORTHANT, UPPER, Box
from lcpcli.model.changes import equilibrated_point, scale
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination
from lcpcli.rational.effort import Effort
from lcpcli.rational.exact_problem import ExactProblem, bounds_of, fractions_of, gap
from lcpcli.rational.numbers import dot, over_one_denominator, rounded, row_integers
from lcpcli.typing import Indices, Mask, Matrix, States, Vector
from lcpcli.verify.farkas import ACTIVE_COLUMN

MOST_EXACT_STEPS = 30  # of exact pivoting, for each initial set: a nearly right one needs a few
VERTEX_EFFORT = 2.0  # of a linear program, by the seconds that so many iterations usually take
MOST_SOLVED_EXACTLY = 700  # positive components: a minute at worst


def from_point(
    data: ExactProblem, z: Vector, effort: Effort | None = None, most: int = MOST_SOLVED_EXACTLY
) -> list[Fraction] | None:
    """Return the exact solution with the complementary basis of an approximate z, shape (n,), or, if its signs are
    wrong, of a basis near it; None if none was found with this effort. most : the largest number of components that are
    solved for."""
    effort = effort or Effort()
    for basis in _bases(data.problem, z):
        found = _by_pivoting(data, basis, effort, most)
        tries_vertex = 0 < np.count_nonzero(basis == BASIC) <= most
        if found is None and tries_vertex and effort.allows():
            found = _at_vertex(data, basis, effort)
        if found is not None:
            return found
    return None


def _bases(problem: Problem, z: Vector) -> Iterator[States]:
    """Yield bases suggested by z, with three choices of the basic variables: all z_i not at a bound, those farther from
    it than w_i suggests, and those not close to it."""
    with np.errstate(all="ignore"):
        box, scaled, w = equilibrated_point(problem, z, problem.w(z))
        near = ACTIVE_COLUMN * np.abs(scaled).max(initial=0.0)
        snapped = np.where(scaled - box.lower <= near, box.lower, scaled)
        bases = [problem.box.basis_at(z), box.basis_at(scaled, w)]
        bases += [box.basis_at(np.where(box.upper - snapped <= near, box.upper, snapped))]
    for k, basis in enumerate(bases):
        if not any(np.array_equal(basis, earlier) for earlier in bases[:k]):
            yield basis


def _by_pivoting(data: ExactProblem, basis: States, effort: Effort, most: int) -> list[Fraction] | None:
    fewest, box = data.n + 1, data.problem.box
    for _ in range(MOST_EXACT_STEPS):
        active = np.flatnonzero(basis == BASIC)
        if active.size > most or not effort.allows():
            return None
        z = _solved(data, active, active, _at_bounds(data, basis), effort)
        if z is None:
            return None
        violated = np.array([gap != 0 for gap in data.gaps(z, data.w(z))])
        count = int(np.count_nonzero(violated))
        if not count:
            return z
        if count >= fewest:
            violated[np.flatnonzero(violated)[1:]] = False
        fewest = min(fewest, count)
        basis = box.exchanged(basis, violated, rounded(z))
    return None


def _at_bounds(data: ExactProblem, basis: States) -> list[Fraction]:
    """Return z at its bounds where it is not basic, and 0 elsewhere."""
    z = [Fraction(0)] * data.n
    for i in np.flatnonzero(basis != BASIC).tolist():
        z[i] = (data.upper if basis[i] == UPPER else data.lower)[i] or z[i]
    return z


def _solved(
    data: ExactProblem, rows: Indices, columns: Indices, known: list[Fraction], effort: Effort
) -> list[Fraction] | None:
    """Return z, as known except in those columns, where `known` is 0, with w = 0 in those rows; None if there is no
    such z, or if solving would take too much effort."""
    z = list(known)
    if not rows.size or not columns.size:
        return z
    right, d = [-data.constants[i] for i in rows.tolist()], 1
    if any(known):
        w = data.w(known)
        right, d = over_one_denominator([-w[i] * data.scales[i] for i in rows.tolist()])
    A = [[data.rows[i].get(j, 0) for j in columns.tolist()] for i in rows.tolist()]
    duration = elimination.duration(A)
    if not effort.allows(duration):
        return None
    effort.spend(duration)
    found = elimination.solve(A, right).x
    if found is None:
        return None
    for j, value in zip(columns.tolist(), found, strict=True):
        z[j] = value / d
    return z


def _at_vertex(data: ExactProblem, basis: States, effort: Effort) -> list[Fraction] | None:
    """Return a vertex of the set of z within their bounds with z_N at these, w_P = 0, and w_N of the signs that the
    bounds ask for: the z at their bounds by an LP, then the others exactly."""
    active, inactive = np.flatnonzero(basis == BASIC), np.flatnonzero(basis != BASIC)
    with np.errstate(all="ignore"):
        scaled = scale(data.problem, moderate=0).problem
        lower, upper = scaled.box.vectors(data.n)
        at_bounds = np.where(basis == BASIC, 0.0, np.where(basis == UPPER, upper, lower))
        columns, q = scaled.M[:, active], scaled.w(at_bounds) if at_bounds.any() else scaled.q
    if not (np.isfinite(columns.sum()) and np.isfinite(q).all()):
        return None
    low, high, sides = lower[active], upper[active], basis[inactive] * (lower < upper)[inactive]
    beside = matrices.scaled(columns[inactive], sides.astype(float), np.ones(active.size)), -sides * q[inactive]
    towards = np.where(np.isfinite(low), 1.0, np.where(np.isfinite(high), -1.0, 0.0))
    found = linprog(towards, *beside, VERTEX_EFFORT, upper=high, equal=(columns[active], -q[active]), lower=low)
    if found is None:
        return None
    near = ACTIVE_COLUMN * max(float(np.abs(found.x).max()), ACTIVE_COLUMN)
    ends = np.where(found.x - low <= near, LOWER, np.where(high - found.x <= near, UPPER, BASIC))
    kept, at_vertex = active[ends == BASIC], basis.copy()
    at_vertex[active] = ends
    zeros = np.abs(columns @ found.x + q) <= ACTIVE_COLUMN
    for rows in (distinct(np.concatenate((active, np.flatnonzero(zeros)))), active):
        z = _solved(data, rows, kept, _at_bounds(data, at_vertex), effort)
        if z is not None and data.is_solution(z):
            return z
    return None


class ExactBasis(NamedTuple):
    """A solution of M_BB z_B = -(q + M z_N)_B, with z_N at its bounds; whether it is the only one, and whether it
    solves the problem."""

    z: list[Fraction]
    unique: bool
    solves: bool


def exact_basis(M: Matrix, q: Vector, basic: Mask, z_N: Vector | float = 0.0, box: Box = ORTHANT) -> ExactBasis | None:
    """Return the basic solution for finite M, q of shape (n, n) and (n,), as they are in doubles, with z_N 0 where
    basic; None if there is none."""
    used = np.flatnonzero(basic | (z_N != 0))
    at_bounds, d = over_one_denominator(fractions_of(np.broadcast_to(z_N, q.size)[used]))
    rows = row_integers(np.column_stack((matrices.dense(M[:, used]), q)))
    free = np.flatnonzero(basic[used]).tolist()
    system = [rows[i] for i in used[free].tolist()]
    found = elimination.solve(
        [[row[k] for k in free] for row in system], [-dot(row, [*at_bounds, d]) for row in system]
    )
    if found.x is None:
        return None
    solved = dict(zip(free, found.x, strict=True))
    values = [solved.get(k, value) / Fraction(d) for k, value in enumerate(at_bounds)]
    Z, common = over_one_denominator(values)
    own = dict(zip(used.tolist(), values, strict=True))
    z = [own.get(i, Fraction(0)) for i in range(q.size)]
    multiples = (Fraction(dot(row, [*Z, common])) for row in rows)  # of w, which have its signs
    solves = not any(map(gap, z, multiples, *map(bounds_of, box.vectors(q.size))))
    return ExactBasis(z, not found.null_space, solves)
