"""A problem of two unknowns, and what is compared of a problem that was read."""

from __future__ import annotations

from lcpcli import Problem
from lcpcli.linalg.matrices import is_sparse

M = [[2.0, -1.0], [-0.5, 2.0]]
Q = [-1.0, 0.25]
JSON = '{"M": [[2, -1], [-0.5, 2]], "q": [-1, 0.25]}'


def numbers(problem: Problem) -> tuple[list[list[float]], list[float]]:
    """M and q as lists."""
    return (problem.M.toarray() if is_sparse(problem.M) else problem.M).tolist(), problem.q.tolist()
