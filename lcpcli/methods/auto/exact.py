"""Small problems in exact arithmetic, however large or small their numbers are: where doubles do not decide.

From a point near a solution by `verify.exact_solution`; if that finds none, by the tree over the states of all unknowns
(`rational.tree`), which finds a solution or proves that there is none.
"""

from __future__ import annotations

import time
from fractions import Fraction

import numpy as np

from lcpcli.interrupts import TimeIsUp, alarm, remaining
from lcpcli.methods.iterate import Finished, Iterate, NoSolution, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.rational.infeasibility import farkas_vector
from lcpcli.rational.numbers import rounded, rounded_direction
from lcpcli.rational.problem import ExactProblem
from lcpcli.rational.tree import first_solution
from lcpcli.typing import Vector
from lcpcli.verify.certificate import SECONDS, Certificate, farkas_statement, proves_infeasible
from lcpcli.verify.exact_solution import from_point
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.refinement import is_rounded_solution

EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = "there is a solution, but doubles cannot represent it: its numbers are too large or too small"
UNDECIDED = "exact arithmetic did not decide it in time"


def exact(problem: Problem, z: Vector, decide: bool) -> Stage:
    """Yield (z - w) / 2 of an exact solution, rounded, for a problem of at most `measure.FEW` unknowns.

    z : where to look for it first, shape (n,). decide : whether to search all states if there is none.

    Returns
    -------
    Finished : there is one. NoSolution : it is proved that there is none. Stalled : doubles cannot represent it, or
        none was found, or not in time.
    """
    data, deadline = ExactProblem.of_floats(problem), time.perf_counter() + min(SECONDS, remaining())
    solution = from_point(data, np.where(np.isfinite(z), z, 0.0), deadline)
    if solution is None and decide:
        try:
            solution = first_solution(data, alarm(deadline))
            if solution is None:
                return NoSolution(_certificate(problem, farkas_vector(data, alarm(deadline))))
        except TimeIsUp:
            return Stalled(UNDECIDED)
    if solution is None:
        return Stalled(UNDECIDED)
    z, w = rounded(solution), rounded(data.w(solution))
    if not (np.isfinite(z).all() and np.isfinite(w).all()):
        return Stalled(OUT_OF_RANGE)
    x = problem.box.x_of(z, w)
    yield Iterate(x, None, "exact", 1)
    return Finished() if _is_solution(problem, problem.box.z_of(x)) else Stalled(OUT_OF_RANGE)


def _certificate(problem: Problem, y: list[Fraction] | None) -> Certificate:
    vector = None if y is None else rounded_direction(y)
    if vector is None or not proves_infeasible(problem, vector):
        return Certificate("exhaustion", EXCLUDED)
    return Certificate("farkas", farkas_statement(problem), vector)


def _is_solution(problem: Problem, z: Vector) -> bool:
    return Point(Criterion(problem), z).solves() or is_rounded_solution(problem, z)
