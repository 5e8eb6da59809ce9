"""From a point near a solution to the exact solution of its complementary basis.

With P = {i : z_i > 0}, M_PP z_P = -q_P is solved in rational numbers, and signs are checked. Wrong ones, of a set that
is not quite right, are turned as in block principal pivoting, and one by one, least index first, where that does not
help: M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its Applications
21 (1978) 207-215. Where M_PP is singular, a vertex of the solutions of that set is looked for by an LP.
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

STEPS = 30  # of exact pivoting from one set
MOST_POSITIVE = 700  # unknowns z_P that are solved for exactly: a minute at worst


def from_point(
    data: ExactProblem, z: Vector, deadline: float = math.inf, most: int = MOST_POSITIVE
) -> list[Fraction] | None:
    """The exact solution that lies at a z nearly right, or None where none was found until the deadline.

    z : shape (n,). The solution has the complementary basis of z or, where that one has wrong signs, of a set near it.
    deadline : by time.perf_counter().
    most : components of z that are solved for, at most.
    """
    for P in _starts(data.problem, z):
        found = _pivoted(data, P, deadline, most)
        if found is None and np.count_nonzero(P) <= most and time.perf_counter() < deadline:
            found = _at_vertex(data, P)
        if found is not None and data.is_solution(found):
            return found
    return None


def _starts(problem: Problem, z: Vector) -> Iterator[Mask]:
    """The sets P that z may stand for: all z_i > 0, those that are larger than w_i, and those that are not tiny."""
    R, C = equilibrate(problem.M, problem.q)
    with np.errstate(all="ignore"):
        scaled, w = z / C, R * problem.w(z)
        sets: list[Mask] = [z > 0, scaled > np.maximum(w, 0), scaled > ACTIVE * np.max(scaled)]
    for k, P in enumerate(sets):
        if not any(np.array_equal(P, earlier) for earlier in sets[:k]):
            yield P


def _pivoted(data: ExactProblem, P: Mask, deadline: float, most: int) -> list[Fraction] | None:
    fewest = data.n + 1
    for _ in range(STEPS):
        if np.count_nonzero(P) > most or time.perf_counter() >= deadline:
            return None
        active = np.flatnonzero(P)
        z = _solved(data, active, active)
        if z is None:
            return None
        w = data.w(z)
        wrong = [i for i in range(data.n) if (z[i] if P[i] else w[i]) < 0]
        if not wrong:
            return z
        flipped = wrong if len(wrong) < fewest else wrong[:1]
        fewest = min(fewest, len(wrong))
        P = P.copy()
        P[flipped] ^= True
    return None


def _solved(data: ExactProblem, rows: Indices, columns: Indices) -> list[Fraction] | None:
    """z, 0 but in those columns, with w = 0 in those rows; None if there is none."""
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


def _at_vertex(data: ExactProblem, P: Mask) -> list[Fraction] | None:
    """A vertex of all z >= 0 with z_N = 0, w_P = 0, w_N >= 0: its zeros by an LP, itself from these, exactly."""
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
    found = linprog(np.ones(active.size), -columns[inactive], q[inactive], equal=(columns[active], -q[active]))
    if found is None:
        return None
    kept = active[found.x > ACTIVE * max(float(found.x.max()), ACTIVE)]
    w = columns @ found.x + q
    for rows in (np.union1d(active, np.flatnonzero(w <= ACTIVE)), active):
        z = _solved(data, rows, kept)
        if z is not None and data.is_solution(z):
            return z
    return None
