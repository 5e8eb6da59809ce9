"""Why a linear or quadratic program has no minimum.

If its conditions have no solution, it is infeasible or unbounded: M. Frank, P. Wolfe,
An algorithm for quadratic programming, Naval Res. Logist. Quart. 3 (1956) 95-110. Which
of the two holds is reported only if it is proved without any tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.interrupts import TimeIsUp
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import compressed, dense, is_sparse, stack, unit_columns
from lcpcli.linalg.programs import minimized
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem, rows_of
from lcpcli.rational.numbers import rounded_direction
from lcpcli.solving.result import INFEASIBLE, NONE, UNBOUNDED, WITHOUT_OPTIMUM
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.alternative import farkas_multipliers
from lcpcli.verify.certificate import MANY, Proof, first_proof
from lcpcli.verify.enclosure import enclosure, is_enclosable
from lcpcli.verify.farkas import farkas_vector

UNIQUE = "unique_optimum"
OPTIMUM = "optimum"
SEVERAL = "several_optima"
STATIONARY = "stationary"
PROVED = (UNIQUE, OPTIMUM, SEVERAL, STATIONARY, *WITHOUT_OPTIMUM)
"""What may be proved about a program: that x is its only optimum, an optimum, or one of
several; that x is a stationary point and the program is not convex, so that x need not
be an optimum; that the program is infeasible, or unbounded, or one of the two."""
# Work for each of two LPs, and for exact arithmetic, in the seconds that it usually
# takes.
FEASIBILITY_EFFORT = 0.5
# A point is first tested after rounding to fractions with denominators up to this, and
# then as it is.
SIMPLE_DENOMINATOR = 10**6
MAX_FRACTIONS = 10_000  # entries of A up to which rational arithmetic is quick enough
EXTREMES = {"min": ("minimum", "below"), "max": ("maximum", "above")}


class Conclusion(NamedTuple):
    """What is concluded about a program from a result on its conditions; the fields are
    those of a `Minimum`.

    within : if the conclusion holds only up to rounding, the relative difference
        between Q and a semidefinite matrix; otherwise None.
    """

    statement: str
    proved: str | None = None
    ray: Vector | None = None
    certificate: Vector | None = None
    within: float | None = None


def without_minimum(
    problem: Problem,
    certificate: Proof | None,
    program: Program,
    data: Blocks,
) -> Conclusion:
    """Return that the program is infeasible, with contradictory constraints, or
    unbounded, with a direction in which the objective improves without limit, as far as
    this is proved. The conditions must be proved to have no solution.

    certificate : the proof of this, with a Farkas vector y if there is one.
    """
    k, (_, side) = program.variables, EXTREMES[program.sense]
    of_x, of_rows = np.zeros(problem.n), np.zeros(problem.n)
    if certificate is not None and certificate.vector is not None:
        of_x[:k], of_rows[k:] = certificate.vector[:k], certificate.vector[k:]
        if certificate.is_rounded:
            return _up_to_rounding(problem, of_x, of_rows, program)
    is_feasible, vector = _feasibility(problem, data, of_rows)
    if is_feasible is False:
        y = None if vector is None else program.parts(vector)[1]
        sentence = "the program is infeasible: no x satisfies its constraints"
        return Conclusion(sentence, INFEASIBLE, certificate=y)
    y = _exact_proof(problem, of_x)
    ray = None if y is None else y[:k]
    if is_feasible:
        return Conclusion(f"the program is unbounded {side}", UNBOUNDED, ray)
    return undecided(program, ray)


def _up_to_rounding(
    problem: Problem, of_x: Vector, of_rows: Vector, program: Program
) -> Conclusion:
    """Return what a proof that holds only up to rounding of the data says of the
    program.
    """
    best, _ = EXTREMES[program.sense]
    of_data = "up to the rounding of its data"
    if first_proof(problem, [of_rows], rounded_from=MANY):
        sentence = (
            f"the program is infeasible {of_data}: its constraints contradict each "
            "other but for that"
        )
        return Conclusion(sentence, certificate=program.parts(of_rows)[1])
    ray = (
        of_x[: program.variables]
        if first_proof(problem, [of_x], rounded_from=MANY)
        else None
    )
    return Conclusion(f"the program has no {best} {of_data}", ray=ray)


def undecided(program: Program, ray: Vector | None = None) -> Conclusion:
    """Return what holds for every program whose conditions have no solution."""
    best, side = EXTREMES[program.sense]
    return Conclusion(
        f"the program has no {best}: it is infeasible or unbounded {side}", NONE, ray
    )


def _feasibility(
    problem: Problem, data: Blocks, guess: Vector
) -> tuple[bool | None, Vector | None]:
    """Return whether some x satisfies rows and bounds without any tolerance, or None if
    that is not decided; and if none does, the vector that proves it, or None.

    guess : a y that may prove infeasibility.
    """
    y = _exact_proof(problem, guess)
    if y is not None:
        return False, y
    if _is_within([0] * data.c.size, [0] * data.row_lower.size, data):
        return True, None
    sides = Constraints.of(data)
    point = sides.central_point()
    if point is not None and sides.hold_near(point):
        return True, None
    # Without an objective, every feasible x satisfies the conditions with y = 0.
    zero = data.Q * 0.0
    if not isinstance(zero, np.ndarray):
        zero.eliminate_zeros()
    M, q, lower, upper = data._replace(Q=zero, c=np.zeros(data.c.size)).conditions()
    constraints = Problem(M, q, lower=lower, upper=upper)
    proof = None
    if data.row_lower.size:
        candidates = farkas_multipliers(constraints, FEASIBILITY_EFFORT)
        proof = first_proof(constraints, candidates)
    y = None if proof is None else _exact_proof(problem, proof.vector, data.c.size)
    if y is not None:
        return False, y
    if compressed(data.A).nnz > MAX_FRACTIONS:
        return None, None
    if point is not None and _has_simple_point(point, data):
        return True, None
    exact = ExactProblem.of_floats(constraints)
    try:
        exact_y = farkas_vector(exact, Effort(FEASIBILITY_EFFORT).steps(exact))
    except TimeIsUp:
        return None, None
    if exact_y is None:
        return True, None
    return False, _exact_proof(problem, rounded_direction(exact_y), data.c.size)


def _exact_proof(problem: Problem, y: Vector | None, columns: int = 0) -> Vector | None:
    """Return the exact Farkas vector obtained by rounding y, after its first `columns`
    components are set to 0; None if the rounded vector is none.
    """
    if y is None:
        return None
    y[:columns] = 0.0
    proof = first_proof(problem, [y], whole=True)
    return None if proof is None else proof.vector


class Constraints(NamedTuple):
    """The rows of a program and, after them, its bounds, as low <= Ax <= high."""

    A: Matrix
    low: Vector
    high: Vector

    @classmethod
    def of(cls, data: Blocks) -> Constraints:
        identity = unit_columns(data.c.size, np.arange(data.c.size), is_sparse(data.A))
        low, high = (data.row_lower, data.lower), (data.row_upper, data.upper)
        return cls(
            stack([[data.A], [identity]]), np.concatenate(low), np.concatenate(high)
        )

    def central_point(self) -> Vector | None:
        """Return the point that an LP solver finds whose smallest distance from the
        bounds of the inequalities, up to 1, is largest; None if it finds none.
        """
        k, equal = self.A.shape[1], self.low == self.high
        below = np.flatnonzero(np.isfinite(self.low))
        above = np.flatnonzero(np.isfinite(self.high) & ~equal)
        distance = np.concatenate(
            (np.where(equal[below], 0.0, -1.0), np.ones(above.size))
        )[:, np.newaxis]
        A = stack([[stack([[self.A[below]], [self.A[above]]]), distance]])
        low = np.concatenate((self.low[below], np.full(above.size, -np.inf)))
        high = np.concatenate(
            (np.where(equal, self.high, np.inf)[below], self.high[above])
        )
        bounds = np.append(np.full(k, -np.inf), 0.0), np.append(np.full(k, np.inf), 1.0)
        optimum = minimized(
            np.append(np.zeros(k), -1.0), A, (low, high), bounds, FEASIBILITY_EFFORT
        )
        return None if optimum is None else optimum.x[:-1]

    @np.errstate(all="ignore")
    def hold_near(self, x: Vector) -> bool:
        """Return whether floating-point computations prove that the constraints hold
        exactly at some point close to x.

        An enclosure of the solutions (x', s') of the homogeneous equations Ax' = s' b
        close to (x, 1) exists if the equations are independent, and no inequality may
        be violated at x' / s', whatever the solution in the enclosure is.
        """
        equal = np.flatnonzero(self.low == self.high)
        if not is_enclosable(equal.size, x.size + 1):
            return False
        changes = enclosure(
            np.column_stack((dense(self.A[equal]), -self.low[equal])), np.append(x, 1.0)
        )
        if changes is None or not changes[-1] < 0.5:
            return False
        Ax = self.A @ x
        size = abs(self.A) @ np.abs(x)
        factor = 4 * (x.size + 2)
        error = 2 * (abs(self.A) @ changes[:-1]) + factor * (
            EPS * size + SMALLEST_NORMAL
        )
        for distance, side in ((Ax - self.low, self.low), (self.high - Ax, self.high)):
            rest = np.where(
                np.isfinite(side),
                error + (2 * changes[-1] + 4 * EPS) * np.abs(side),
                0.0,
            )
            distance[equal] = np.inf
            if not (distance > rest).all():
                return False
        return True


def _has_simple_point(point: Vector, data: Blocks) -> bool:
    """Return whether the point, or the point rounded to fractions with small
    denominators, is feasible without tolerance.
    """
    rows, x = rows_of(data.A), [Fraction(value) for value in point.tolist()]
    for candidate in ([value.limit_denominator(SIMPLE_DENOMINATOR) for value in x], x):
        Ax = [sum(value * candidate[j] for j, value in row.items()) for row in rows]
        if _is_within(candidate, Ax, data):
            return True
    return False


def _is_within(x: Sequence[Any], Ax: Sequence[Any], data: Blocks) -> bool:
    """Return whether x and Ax, numbers of any type, satisfy the bounds and the rows."""
    return all(
        low <= value <= high
        for values, lower, upper in (
            (x, data.lower, data.upper),
            (Ax, data.row_lower, data.row_upper),
        )
        for value, low, high in zip(values, lower.tolist(), upper.tolist(), strict=True)
    )
