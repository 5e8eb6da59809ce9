"""From a point near a solution to the exact solution of its complementary basis.

With P = {i : z_i > 0}, M_PP z_P = -q_P is solved in rational arithmetic, and the signs are checked. If P is not quite
right, indices that violate them are flipped as in block principal pivoting or, where that does not help, one at a time,
least index first: M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its
Applications 21 (1978) 207-215. Where M_PP is singular, an LP finds a vertex of the solutions with that set.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.equilibration import equilibrate
from lcpcli.linalg.linear_program import linprog
from lcpcli.model.problem import Problem
from lcpcli.rational import linear
from lcpcli.rational.problem import ExactProblem
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.farkas import ACTIVE

MOST_STEPS = 30  # of exact pivoting, for each initial set
MOST_POSITIVE = 700  # components that are solved for exactly: a minute at worst


def from_point(
    data: ExactProblem, z: Vector, deadline: float = math.inf, most: int = MOST_POSITIVE
) -> list[Fraction] | None:
    """The exact solution near an approximate z; None if none was found before the deadline.

    z : shape (n,). The solution has the complementary basis of z or, if its signs are wrong, one near it.
    deadline : by time.perf_counter().
    most : the largest number of components that are solved for.
    """
    for P in _active_sets(data.problem, z):
        found = _by_pivoting(data, P, deadline, most)
        if found is None and np.count_nonzero(P) <= most and time.perf_counter() < deadline:
            found = _at_vertex(data, P, deadline)
        if found is not None and data.is_solution(found):
            return found
    return None


def _active_sets(problem: Problem, z: Vector) -> Iterator[Mask]:
    """Active sets P suggested by z: all z_i > 0, those larger than w_i, and those that are not tiny."""
    R, C = equilibrate(problem.M, problem.q)
    with np.errstate(all="ignore"):
        scaled, w = z / C, R * problem.w(z)
        sets: list[Mask] = [z > 0, scaled > np.maximum(w, 0), scaled > ACTIVE * np.max(scaled)]
    for k, P in enumerate(sets):
        if not any(np.array_equal(P, earlier) for earlier in sets[:k]):
            yield P


def _by_pivoting(data: ExactProblem, P: Mask, deadline: float, most: int) -> list[Fraction] | None:
    fewest = data.n + 1
    for _ in range(MOST_STEPS):
        if np.count_nonzero(P) > most or time.perf_counter() >= deadline:
            return None
        active = np.flatnonzero(P)
        z = _solved(data, active, active)
        if z is None:
            return None
        w = data.w(z)
        violated = [i for i in range(data.n) if (z[i] if P[i] else w[i]) < 0]
        if not violated:
            return z
        flipped = violated if len(violated) < fewest else violated[:1]
        fewest = min(fewest, len(violated))
        P = P.copy()
        P[flipped] ^= True
    return None


def _solved(data: ExactProblem, rows: Indices, columns: Indices) -> list[Fraction] | None:
    """z, 0 except in those columns, with w = 0 in those rows; None if there is none."""
    z = [Fraction(0)] * data.n
    if not rows.size or not columns.size:
        return z
    A = [[data.rows[i].get(j, 0) for j in columns.tolist()] for i in rows.tolist()]
    found = linear.solve(A, [-data.constants[i] for i in rows.tolist()]).x
    if found is None:
        return None
    for j, value in zip(columns.tolist(), found, strict=True):
        z[j] = value
    return z


def _at_vertex(data: ExactProblem, P: Mask, deadline: float) -> list[Fraction] | None:
    """A vertex of the set of z >= 0 with z_N = 0, w_P = 0, w_N >= 0: its zeros by an LP, then itself exactly."""
    active, inactive = np.flatnonzero(P), np.flatnonzero(~P)
    if not active.size:
        return None
    problem = data.problem
    R, C = equilibrate(problem.M, problem.q)
    with np.errstate(all="ignore"):
        columns, q = matrices.scaled(problem.M, R, C)[:, active], R * problem.q
        power = math.frexp(np.abs(q).max())[1]
        q = np.ldexp(q, -power)
    if not (np.isfinite(q).all() and np.isfinite(columns.sum())):
        return None
    beside, equal = (-columns[inactive], q[inactive]), (columns[active], -q[active])
    found = linprog(np.ones(active.size), *beside, deadline - time.perf_counter(), equal=equal)
    if found is None:
        return None
    kept = active[found.x > ACTIVE * max(float(found.x.max()), ACTIVE)]
    w = columns @ found.x + q
    for rows in (np.union1d(active, np.flatnonzero(w <= ACTIVE)), active):
        z = _solved(data, rows, kept)
        if z is not None and data.is_solution(z):
            return z
    return None
