"""M as a peer stores it, where that is not how the problem does."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix

CONVERTED = 2000  # unknowns up to which a matrix is converted: beyond, the peer would be measured at what it is not for


def not_dense(problem: Problem) -> str:
    """Why a peer for dense matrices does not take M, as a clause; "" if it does."""
    return _too_large(problem, "dense") if is_sparse(problem.M) else ""


def not_sparse(problem: Problem) -> str:
    """Why a peer for sparse matrices does not take M, as a clause; "" if it does."""
    return "" if is_sparse(problem.M) else _too_large(problem, "sparse")


def _too_large(problem: Problem, kind: str) -> str:
    return "" if problem.n <= CONVERTED else f"takes {kind} matrices only, and converted ones up to n = {CONVERTED}"


def dense(M: Matrix) -> Any:
    """M as a dense array by rows of the peer's own, which may write to it."""
    return M.toarray() if is_sparse(M) else np.array(M, order="C")


def columns(M: Matrix) -> Any:
    """M in compressed sparse columns, as the class that all peers take."""
    from scipy.sparse import csc_matrix

    return csc_matrix(M)


def upper_triangle(M: Matrix) -> Any:
    """The diagonal of M and what is above it, in compressed sparse columns."""
    from scipy.sparse import csc_matrix, triu

    return csc_matrix(triu(M, format="csc"))


def lower_triangle(M: Matrix) -> Any:
    """The diagonal of M and what is below it, in compressed sparse columns."""
    from scipy.sparse import csc_matrix, tril

    return csc_matrix(tril(M, format="csc"))
