"""Where the interior point method is expected to win: M + M' positive semidefinite, and the conditions of programs."""

from __future__ import annotations

from lcpcli.linalg import matrices
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix


def is_monotone(M: Matrix) -> bool:
    """Whether v'Mv >= 0 for all v, up to rounding."""
    return bool(M.diagonal().min() >= 0) and is_semidefinite(M if matrices.is_symmetric(M) else (M + M.T) / 2)


def is_program(problem: Problem) -> bool:
    """Whether M, sparse, is monotone and has the signs of the conditions of a program, both of them."""
    S = problem.signs
    return S is not None and bool((S[0] != S).any()) and is_monotone(problem.M)
