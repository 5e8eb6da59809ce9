"""The reason why a linear or quadratic program has no minimum.

It is infeasible or unbounded: M. Frank, P. Wolfe, An algorithm for quadratic programming, Naval Res. Logist. Quart. 3
(1956) 95-110. Which of the two holds is reported only if it is proved without any tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli import clock
from lcpcli.interrupts import TimeIsUp, alarm
from lcpcli.linalg.linear_program import minimized
from lcpcli.linalg.matrices import compressed
from lcpcli.model.problem import Problem
from lcpcli.model.program import Program, ProgramData
from lcpcli.solving.answer import INFEASIBLE, NONE, UNBOUNDED, Minimum
from lcpcli.typing import Vector
from lcpcli.verify.certificate import farkas, proof

FEASIBILITY_SECONDS = 1.0  # for each of two LPs, and for exact arithmetic
SIMPLE_DENOMINATOR = 10**6  # the largest one of a feasible point that is tried before its doubles
MOST_FRACTIONS = 10_000  # entries of A up to which rational arithmetic is quick enough
EXTREMES = {"min": ("minimum", "below"), "max": ("maximum", "above")}


def without_minimum(problem: Problem, vector: Vector | None, program: Program, data: ProgramData) -> Minimum:
    """Return which constraints contradict each other, or in which direction the objective improves without limit, if it
    is proved that the conditions have no solution.

    vector : a Farkas vector y for the conditions, if there is one.
    """
    k, (_, side) = program.variables, EXTREMES[program.sense]
    of_x, of_rows = np.zeros(problem.n), np.zeros(problem.n)
    if vector is not None:
        of_x[:k], of_rows[k:] = vector[:k], vector[k:]
    known = _feasibility(problem, data, of_rows)
    if known.feasible is False:
        y = None if known.vector is None else program.parts(known.vector)[1]
        sentence = "the program is infeasible: no x satisfies its constraints"
        return _nowhere(sentence, INFEASIBLE, certificate=y)
    y = proof(problem, of_x)
    ray = None if y is None else y[:k]
    if known.feasible:
        return _nowhere(f"the program is unbounded {side}", UNBOUNDED, ray=ray)
    return undecided(program, ray)


def undecided(program: Program, ray: Vector | None = None) -> Minimum:
    """Return what is known of every program whose conditions have no solution."""
    best, side = EXTREMES[program.sense]
    return _nowhere(f"the program has no {best}: it is infeasible or unbounded {side}", NONE, ray=ray)


def _nowhere(
    statement: str, proved: str | None = None, ray: Vector | None = None, certificate: Vector | None = None
) -> Minimum:
    return Minimum(None, None, None, None, statement, proved, ray=ray, certificate=certificate)


class _Feasibility(NamedTuple):
    """Whether a program is feasible, None if that is not decided, and the multipliers of a proof that it is not."""

    feasible: bool | None
    vector: Vector | None = None


def _feasibility(problem: Problem, data: ProgramData, guess: Vector) -> _Feasibility:
    """Decide without any tolerance whether some x satisfies rows and bounds. guess : a y that may refute it."""
    y = proof(problem, guess)
    if y is not None:
        return _Feasibility(False, y)
    if _is_within([0] * data.c.size, [0] * data.row_lower.size, data):
        return _Feasibility(True)
    constraints = _constraints(data)
    y = _of_rows(problem, data, farkas(constraints, FEASIBILITY_SECONDS)) if data.row_lower.size else None
    if y is not None:
        return _Feasibility(False, y)
    if compressed(data.A).nnz > MOST_FRACTIONS:
        return _Feasibility(None)
    return _Feasibility(True) if _has_simple_point(data) else _exactly(problem, data, constraints)


def _exactly(problem: Problem, data: ProgramData, constraints: Problem) -> _Feasibility:
    """Return what the simplex method in integers decides, unless it takes too long."""
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.rational.numbers import rounded_direction
    from lcpcli.verify.exact_farkas import farkas_vector

    try:
        y = farkas_vector(ExactProblem.of_floats(constraints), alarm(clock.seconds() + FEASIBILITY_SECONDS))
    except TimeIsUp:
        return _Feasibility(None)
    return _Feasibility(True) if y is None else _Feasibility(False, _of_rows(problem, data, rounded_direction(y)))


def _constraints(data: ProgramData) -> Problem:
    """Return the conditions of the program without its objective, which every feasible x satisfies with y = 0."""
    zero = data.Q * 0.0
    if not isinstance(zero, np.ndarray):
        zero.eliminate_zeros()
    M, q, lower, upper = data._replace(Q=zero, c=np.zeros(data.c.size)).conditions()
    return Problem(M, q, lower=lower, upper=upper)


def _of_rows(problem: Problem, data: ProgramData, y: Vector | None) -> Vector | None:
    """Return the proof for the program itself that consists of the multipliers in y, a proof for its constraints."""
    if y is None:
        return None
    y[: data.c.size] = 0.0
    return proof(problem, y)


def _has_simple_point(data: ProgramData) -> bool:
    """Return whether an LP solver's point, as it is or rounded to simple fractions, is feasible without tolerance."""
    ends, bounds = (data.row_lower, data.row_upper), (data.lower, data.upper)
    point = minimized(np.zeros(data.c.size), data.A, ends, bounds, FEASIBILITY_SECONDS)
    if point is None:
        return False
    from lcpcli.rational.exact_problem import rows_of

    rows, x = rows_of(data.A), [Fraction(value) for value in point.x.tolist()]
    for candidate in ([value.limit_denominator(SIMPLE_DENOMINATOR) for value in x], x):
        Ax = [sum(value * candidate[j] for j, value in row.items()) for row in rows]
        if _is_within(candidate, Ax, data):
            return True
    return False


def _is_within(x: Sequence[Any], Ax: Sequence[Any], data: ProgramData) -> bool:
    """Return whether x and Ax, numbers of any type, satisfy the bounds and the rows."""
    return all(
        low <= value <= high
        for values, lower, upper in ((x, data.lower, data.upper), (Ax, data.row_lower, data.row_upper))
        for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True)
    )
