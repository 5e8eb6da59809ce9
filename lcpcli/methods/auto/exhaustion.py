"""Small problems decided in exact arithmetic, one complementary set after another, however large their numbers are.

All sets are examined, so that if none has a solution, there is none: the complementary cones of K. G. Murty, On the
number of solutions to the complementarity problem and spanning properties of complementary cones, Linear Algebra and
its Applications 5 (1972) 65-108. With bounds, so are all choices of states: each variable at a bound, or basic.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.methods.iterate import Finished, Iterate, NoSolution, Stage, Stalled
from lcpcli.model.box import Basis, Box
from lcpcli.model.problem import Problem
from lcpcli.rational.basis import ExactBasis, exact_basis
from lcpcli.rational.numbers import rounded
from lcpcli.typing import Vector
from lcpcli.verify.certificate import Certificate
from lcpcli.verify.mixed_farkas import candidates, refutes
from lcpcli.verify.refinement import is_rounded_solution

MAX_SETS = 256  # a fraction of a second
MAX_CHOICES = 3**7  # of states: a few seconds
LOWER, BASIC, UPPER = range(3)
EXCLUDED = "each complementary set is excluded in exact arithmetic"
OUT_OF_RANGE = "there is a solution, but doubles cannot hold it: its numbers are too large or too small"
SINGULAR = "no solution was found or ruled out: the submatrix of one complementary set is singular"


def exhaustion(problem: Problem) -> Stage:
    """Yield (z - w) / 2 for the rounded solutions of complementary sets, if `is_small`.

    Returns
    -------
    Finished : the last one is a solution up to rounding. NoSolution : all sets are excluded. Stalled : rounding spoils
        every solution, or a singular set is not excluded.
    """
    singular = solvable = False
    for k, choice in enumerate(product(*_states(problem)), 1):
        states = np.array(choice)
        basis = Basis(states == BASIC, states == UPPER)
        nonbasic = problem.box.nonbasic(basis) if problem.is_mixed else None
        found = exact_basis(problem.M, problem.q, basis.basic, nonbasic, problem.box)
        if found is not None and found.solves:
            solvable, x = True, _x(problem, found, basis)
            yield Iterate(x, None, "exact", k)
            if is_rounded_solution(problem, problem.box.z_of(x)):
                return Finished()
        elif found is not None and not found.unique and not _is_excluded(problem, basis):
            singular = True
    if solvable or singular:
        return Stalled(OUT_OF_RANGE if solvable else SINGULAR)
    return NoSolution(Certificate("exhaustion", EXCLUDED))


def is_small(problem: Problem) -> bool:
    """Whether there are few enough sets, or choices of states."""
    return problem.n <= MAX_SETS and math.prod(map(len, _states(problem))) <= (
        MAX_CHOICES if problem.is_mixed else MAX_SETS
    )


def _states(problem: Problem) -> list[tuple[int, ...]]:
    """The states that each variable may have."""
    if not isinstance(problem.box, Box):
        return [(LOWER, BASIC)] * problem.n
    low, high, fixed = np.isfinite(problem.box.lower), np.isfinite(problem.box.upper), problem.box.fixed
    return [
        (LOWER,) if same else (*[LOWER] * down, BASIC, *[UPPER] * up)
        for same, down, up in zip(fixed.tolist(), low.tolist(), high.tolist(), strict=True)
    ]


def _is_excluded(problem: Problem, basis: Basis) -> bool:
    """Whether Farkas' alternative, without rounding, excludes these states: z_N, the signs of w_N, and w_B = 0."""
    if not isinstance(problem.box, Box) or basis.upper is None:
        return False
    z, basic, free = problem.box.nonbasic(basis), basis.basic, problem.box.fixed
    face = Box(np.where(basic, problem.box.lower, z), np.where(basic, problem.box.upper, z))
    asked = Box(np.where((basic | basis.upper) & ~free, -np.inf, 0.0), np.where(basis.upper | free, 0.0, np.inf))
    M = matrices.dense(problem.M)
    return any(refutes(M, problem.q, face, y, asked) for y in candidates(M, problem.q, face, asked=asked))


@np.errstate(over="ignore", invalid="ignore")
def _x(problem: Problem, found: ExactBasis, basis: Basis) -> Vector:
    z = rounded(found.z)
    return problem.box.x_within(z, np.nan_to_num(problem.w(z)), basis)
