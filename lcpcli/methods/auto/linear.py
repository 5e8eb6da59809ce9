"""What linear programs settle: infeasibility for any M, and the LCP itself for Z-matrices and skew-symmetric M.

O. L. Mangasarian, Linear complementarity problems solvable by a single linear program, Mathematical Programming 10
(1976) 263-270. M a Z-matrix (no positive entry off the diagonal): if the problem is feasible it has a least feasible z,
which solves it and minimises e'z. M skew-symmetric: z'w = q'z, so that what minimises q'z solves it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from lcpcli.linalg.linear_program import linprog
from lcpcli.methods.finish import finish
from lcpcli.methods.iterate import Breakdown, Iterate, NoSolution
from lcpcli.methods.scaled import in_original_units
from lcpcli.model import scaled
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.certificate import Certificate, farkas


def linear(problem: Problem, x0: Vector, seconds: float = math.inf) -> Iterator[Iterate]:
    """Raise NoSolution with a Farkas proof, or yield x0 and, for the two kinds of M, the solution; M sparse."""
    yield Iterate(x0, None, "", 0)
    proof = farkas(problem, seconds)
    if proof is not None:
        raise NoSolution(Certificate("farkas", "M'y <= 0 and q'y < 0 for the y >= 0 of the certificate", proof))
    units = scaled.scale(problem)
    yield from in_original_units(units, finish(units.problem, _solution(units.problem, seconds)))


def _solution(problem: Problem, seconds: float) -> Iterator[Iterate]:
    M, q = problem.M, problem.q
    objective = _objective(M, q)
    found = None if objective is None else linprog(objective, -M, q, seconds)
    if found is None:
        raise Breakdown("no linear program solves this problem")
    w = np.maximum(problem.w(found.x), 0.0)
    yield Iterate(0.5 * np.where(found.x > w, found.x, -w), None, "", 1)


def _objective(M: Matrix, q: Vector) -> Vector | None:
    entries = M.tocoo()
    if not (entries.data[entries.row != entries.col] > 0).any():
        return np.ones(q.size)
    return q if abs(M + M.T).max() == 0 else None
