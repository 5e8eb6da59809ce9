"""The problem that the interior point method works on: without fixed variables, in units of about 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.signs import signs
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import Indices, Matrix, Vector

ROUNDS, FARTHEST, CLOSE = 12, 1e8, 0.1  # of Ruiz's scaling


@dataclass(frozen=True, eq=False)
class Scaled:
    """M, q and bounds of the variables `kept`, for z = units z'; the others are fixed.

    S : signs with S M symmetric; None if there are none, or M is dense.
    low, high : the indices with finite lower and finite upper bounds.
    """

    problem: Problem
    kept: Indices
    M: Matrix
    q: Vector
    lower: Vector
    upper: Vector
    units: Vector
    S: Vector | None
    low: Indices
    high: Indices

    @property
    def pairs(self) -> int:
        """The number of finite bounds."""
        return self.low.size + self.high.size

    def given(self, z: Vector) -> Vector:
        """The admissible z of the problem for one of the scaled problem."""
        whole = np.full(self.problem.n, self.problem.lower, dtype=float)
        whole[self.kept] = z * self.units
        return self.problem.box.project(whole)


def scaled(problem: Problem) -> Scaled:
    """Symmetric scaling D M D to rows and columns with largest entries of about 1 (D. Ruiz, A scaling algorithm to
    equilibrate both rows and columns norms in matrices, RAL-TR-2001-034); q and the bounds divided by the largest.
    """
    given = conditions_of(problem)
    kept = np.flatnonzero(given.lower < given.upper)
    M, q, lower, upper = given.M, given.q, given.lower, given.upper
    if kept.size < problem.n:
        fixed = np.where(lower == upper, lower, 0.0)
        q, M = (problem.q + M @ fixed)[kept], M[kept][:, kept]
        lower, upper = lower[kept], upper[kept]
    d = _ruiz(M)
    M = matrices.scaled(M, d, d)
    q, lower, upper = q * d, lower / d, upper / d
    finite = [v[np.isfinite(v)] for v in (lower, upper)]
    largest = max(float(np.abs(v).max(initial=0.0)) for v in (q, *finite)) or 1.0
    largest = float(np.exp2(np.rint(np.log2(largest))))
    S = signs(M) if is_sparse(M) else None
    ends = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
    own = (M, q / largest, lower / largest, upper / largest)
    return Scaled(problem, kept, *own, d * largest, S, *ends)


def _ruiz(M: Matrix) -> Vector:
    d = np.ones(M.shape[0])
    for _ in range(ROUNDS):
        rows, columns = matrices.row_and_column_maxima(M, d, d)
        sizes = np.maximum(rows, columns)
        sizes[sizes == 0] = 1.0
        d = np.clip(d / np.sqrt(sizes), 1 / FARTHEST, FARTHEST)
        if (np.abs(sizes - 1) < CLOSE).all():
            break
    return np.exp2(np.rint(np.log2(d)))  # so that nothing is rounded, and symmetry is kept
