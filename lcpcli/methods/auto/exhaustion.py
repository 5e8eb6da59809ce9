"""Small problems decided in exact arithmetic, one complementary set after another, however large their numbers are.

All sets are examined, so that if none has a solution, there is none: the complementary cones of K. G. Murty, On the
number of solutions to the complementarity problem and spanning properties of complementary cones, Linear Algebra and
its Applications 5 (1972) 65-108.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from lcpcli.methods.iterate import Finished, Iterate, NoSolution, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.rational.basis import Basis, exact_basis
from lcpcli.rational.numbers import rounded
from lcpcli.typing import Mask, Vector
from lcpcli.verify.certificate import Certificate
from lcpcli.verify.refinement import is_rounded_solution

MAX_UNKNOWNS = 8  # 256 sets, a fraction of a second
EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = "there is a solution, but doubles cannot hold it: its numbers are too large or too small"
SINGULAR = "no solution was found or ruled out: the submatrix of one complementary set is singular"


def exhaustion(problem: Problem) -> Stage:
    """Yield (z - w) / 2 for the rounded solutions of complementary sets, for n <= MAX_UNKNOWNS.

    Returns
    -------
    Finished : the last one is a solution up to rounding. NoSolution : all sets are excluded. Stalled : rounding spoils
        every solution, or a singular set is not excluded.
    """
    singular = solvable = False
    for k, choice in enumerate(product((False, True), repeat=problem.n), 1):
        P = np.array(choice)
        found = exact_basis(problem.M, problem.q, P)
        if found is not None and found.solves:
            solvable, x = True, _x(problem, found, P)
            yield Iterate(x, None, "exact", k)
            if is_rounded_solution(problem, problem.box.z_of(x)):
                return Finished()
        elif found is not None and not found.unique:
            singular = True
    if solvable or singular:
        return Stalled(OUT_OF_RANGE if solvable else SINGULAR)
    return NoSolution(Certificate("exhaustion", EXCLUDED))


@np.errstate(over="ignore", invalid="ignore")
def _x(problem: Problem, found: Basis, P: Mask) -> Vector:
    z = rounded(found.z)
    return np.where(P, z, -np.nan_to_num(np.maximum(problem.w(z), 0.0))) / 2
