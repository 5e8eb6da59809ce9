"""Small problems in exact arithmetic, however large or small their numbers are: where doubles do not decide.

From a point near a solution by `verify.exact_solution`; if that finds none, by the tree over the states of all unknowns
(`rational.tree`), which finds a solution or proves that there is none.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from lcpcli import interrupts
from lcpcli.interrupts import TimeIsUp, alarm
from lcpcli.methods.iterate import Finished, Iterate, NoSolution, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.rational.numbers import rounded, rounded_direction
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.tree import first_solution
from lcpcli.typing import Vector
from lcpcli.verify.certificate import SECONDS, Certificate, farkas_statement, proves_infeasible
from lcpcli.verify.exact_farkas import farkas_vector
from lcpcli.verify.exact_solution import from_point
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.refinement import is_rounded_solution

EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = "there is a solution, but doubles cannot represent it: its numbers are too large or too small"
ROUNDED = "there is a solution, but rounded to doubles it is none"
UNDECIDED = "exact arithmetic did not decide it in time"


def exact(problem: Problem, z: Vector, decide: bool) -> Stage:
    """Yield (z - w) / 2 of an exact solution, rounded, for a problem of at most `measure.FEW` unknowns.

    z : where to look for it first, shape (n,). decide : whether to search all states if there is none.

    Returns
    -------
    Finished : there is one. NoSolution : it is proved that there is none. Stalled : those that were found are out of
        range, or none when they are rounded to doubles; or none was found in time.
    """
    data, deadline = ExactProblem.of_floats(problem), interrupts.deadline(SECONDS)
    reason = UNDECIDED
    try:
        for solution in _solutions(data, np.where(np.isfinite(z), z, 0.0), decide, deadline):
            if solution is None:
                return NoSolution(_certificate(problem, farkas_vector(data, alarm(deadline))))
            x = _in_doubles(problem, solution, data.w(solution))
            if x is not None:
                yield Iterate(x, None, "exact", 1)
                if _is_solution(problem, problem.box.z_of(x)):
                    return Finished()
            reason = OUT_OF_RANGE if x is None else ROUNDED
    except TimeIsUp:
        pass
    return Stalled(reason)


def _solutions(data: ExactProblem, z: Vector, decide: bool, deadline: float) -> Iterator[list[Fraction] | None]:
    """The solution near z and, to decide, that of the tree, None if it proves that there is none."""
    near = from_point(data, z, deadline)
    if near is not None:
        yield near
    if decide:
        yield first_solution(data, alarm(deadline))


def _in_doubles(problem: Problem, solution: list[Fraction], w: list[Fraction]) -> Vector | None:
    """(z - w) / 2 of a solution z and its w; None if they are out of range."""
    rounded_z, rounded_w = rounded(solution), rounded(w)
    within = np.isfinite(rounded_z).all() and np.isfinite(rounded_w).all()
    return problem.box.x_of(rounded_z, rounded_w) if within else None


def _certificate(problem: Problem, y: list[Fraction] | None) -> Certificate:
    vector = None if y is None else rounded_direction(y)
    if vector is None or not proves_infeasible(problem, vector):
        return Certificate("exhaustion", EXCLUDED)
    return Certificate("farkas", farkas_statement(problem), vector)


def _is_solution(problem: Problem, z: Vector) -> bool:
    return Point(Criterion(problem), z).solves() or is_rounded_solution(problem, z)
