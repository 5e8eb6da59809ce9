"""What linear programs decide: infeasibility for any M, and a solution for a
skew-symmetric M.

O. L. Mangasarian, Linear complementarity problems solvable by a single linear program,
Mathematical Programming 10 (1976) 263-270. M skew-symmetric: z'w = q'z, so that any
minimizer of q'z solves it. If moreover M = [0 -A'; A 0] in some order, as for linear
programs, z consists of a minimizer and its multipliers: G. B. Dantzig, Linear
Programming and Extensions (1963), chapter 6.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg.matrices import is_skew
from lcpcli.linalg.programs import minimized
from lcpcli.methods.newton import finish
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    NoSolution,
    Stage,
    Stalled,
    ended,
    in_given_variables,
)
from lcpcli.model import changes
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Vector
from lcpcli.verify.alternative import farkas_multipliers
from lcpcli.verify.certificate import MANY, first_proof


def linear(problem: Problem, max_seconds: float = math.inf) -> Stage:
    """Return a Farkas proof, or for sparse M yield the solution if M is
    skew-symmetric."""
    units = changes.scale(problem)
    if is_skew(problem.M):
        ending = yield from _finished(units, _saddle_point(units.problem, max_seconds))
        if isinstance(ending, Finished):
            return Stalled("the solution of the linear program is not accurate enough")
    # The multipliers may take three linear programs of half of this limit.
    sought = farkas_multipliers(problem, 2 * max_seconds / 3)
    proof = first_proof(problem, sought, rounded_from=MANY)
    if proof is not None:
        return NoSolution(proof)
    if problem.is_mixed or not is_skew(problem.M):
        return Breakdown("no linear program is known to solve it")
    # The smallest q'z over the feasible z.
    M = units.problem.M
    q = units.problem.q
    none = np.zeros(problem.n)
    minimizer = minimized(q, M, (-q, none + np.inf), (none, none + np.inf), max_seconds)
    return (yield from _finished(units, None if minimizer is None else minimizer.x))


def _finished(units: changes.Scaled, z: Vector | None) -> Stage:
    problem = units.problem
    if z is None:
        return Breakdown("no linear program solves this problem")
    iterate = Iterate(problem.box.x_of(z, problem.w(z)), None, "", 1)
    return (
        yield from in_given_variables(
            units, finish(problem, None, ended(Finished(), iterate))
        )
    )


def _saddle_point(problem: Problem, max_seconds: float) -> Vector | None:
    """Return the minimizer and the multipliers of the linear program, if M = [0 -A'; A
    0] with y >= 0, <= 0 or free."""
    conditions = conditions_of(problem)
    on_sides = np.isin(conditions.lower, (0.0, -np.inf)) & np.isin(
        conditions.upper, (0.0, np.inf)
    )
    S = problem.signs
    dual = (
        None
        if S is None
        else next((dual for dual in (S < 0, S > 0) if on_sides[dual].all()), None)
    )
    if dual is None:
        return None
    q = problem.q[dual]
    low = conditions.lower[dual]
    high = conditions.upper[dual]
    row_bounds = np.where(high > 0, -q, -np.inf), np.where(low < 0, -q, np.inf)
    bounds = conditions.lower[~dual], conditions.upper[~dual]
    minimizer = minimized(
        problem.q[~dual], problem.M[dual][:, ~dual], row_bounds, bounds, max_seconds
    )
    if minimizer is None:
        return None
    z = np.zeros(problem.n)
    z[dual], z[~dual] = minimizer.y, minimizer.x
    return problem.box.project(z)
