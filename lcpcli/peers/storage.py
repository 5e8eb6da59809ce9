"""M in the storage format that a peer needs."""

from __future__ import annotations

from typing import Any

import numpy as np

from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix

CONVERTED = 2000  # largest n at which a matrix is converted; beyond it, the benchmark would misuse the peer


def bounded(problem: Problem) -> str:
    """Why a peer for z >= 0 cannot be given the problem, as a clause; "" if it can."""
    return "takes no bounds but z >= 0" if problem.is_mixed else ""


def not_dense(problem: Problem) -> str:
    """Why a peer for dense matrices cannot be given M, as a clause; "" if it can."""
    return _too_large(problem, "dense") if is_sparse(problem.M) else ""


def not_sparse(problem: Problem) -> str:
    """Why a peer for sparse matrices cannot be given M, as a clause; "" if it can."""
    return "" if is_sparse(problem.M) else _too_large(problem, "sparse")


def _too_large(problem: Problem, kind: str) -> str:
    return "" if problem.n <= CONVERTED else f"takes {kind} matrices only; others are converted up to n = {CONVERTED}"


def rows(*blocks: Any) -> Any:
    """Blocks one below the other, in compressed sparse columns."""
    from scipy.sparse import csc_matrix, vstack

    return csc_matrix(vstack([csc_matrix(block) for block in blocks]))


def dense(M: Matrix) -> Any:
    """A copy of M as a dense row-major array, which the peer may overwrite."""
    return M.toarray() if is_sparse(M) else np.array(M, order="C")


def columns(M: Matrix) -> Any:
    """M in compressed sparse columns, as a csc_matrix, which all peers accept."""
    from scipy.sparse import csc_matrix

    return csc_matrix(M)


def upper_triangle(M: Matrix) -> Any:
    """The upper triangle of M with its diagonal, in compressed sparse columns."""
    from scipy.sparse import csc_matrix, triu

    return csc_matrix(triu(M, format="csc"))


def lower_triangle(M: Matrix) -> Any:
    """The lower triangle of M with its diagonal, in compressed sparse columns."""
    from scipy.sparse import csc_matrix, tril

    return csc_matrix(tril(M, format="csc"))
