"""What linear programs decide: infeasibility for any M, and the LCP itself for Z-matrices and skew-symmetric M.

O. L. Mangasarian, Linear complementarity problems solvable by a single linear program, Mathematical Programming 10
(1976) 263-270. M a Z-matrix (no positive entry off the diagonal): if the problem is feasible it has a least feasible z,
which solves it and minimises e'z. M skew-symmetric: z'w = q'z, so that any minimiser of q'z solves it.
"""

from __future__ import annotations

import math

import numpy as np

from lcpcli.linalg.linear_program import linprog
from lcpcli.methods.finish import finish
from lcpcli.methods.iterate import Breakdown, Finished, Iterate, NoSolution, Stage
from lcpcli.methods.transformed import in_given_variables
from lcpcli.model import scaled
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.certificate import Certificate, farkas, farkas_statement


def linear(problem: Problem, seconds: float = math.inf) -> Stage:
    """End with a Farkas proof of infeasibility, or yield the solution for these two classes of M; M sparse."""
    proof = farkas(problem, seconds)
    if proof is not None:
        return NoSolution(Certificate("farkas", farkas_statement(problem), proof))
    if problem.is_mixed:
        return Breakdown("no linear program is known to solve it")
    units = scaled.scale(problem)
    return (yield from in_given_variables(units, finish(units.problem, None, _solution(units.problem, seconds))))


def _solution(problem: Problem, seconds: float) -> Stage:
    M, q = problem.M, problem.q
    objective = _objective(M, q)
    found = None if objective is None else linprog(objective, -M, q, seconds)
    if found is None:
        return Breakdown("no linear program solves this problem")
    w = np.maximum(problem.w(found.x), 0.0)
    yield Iterate(0.5 * np.where(found.x > w, found.x, -w), None, "", 1)
    return Finished()


def _objective(M: Matrix, q: Vector) -> Vector | None:
    entries = M.tocoo()
    if not (entries.data[entries.row != entries.col] > 0).any():
        return np.ones(q.size)
    return q if abs(M + M.T).max() == 0 else None
