"""The input of other solvers: the problem as a convex quadratic program, and matrices in their storage.

The program is to minimize z'Mz / 2 + q'z over z >= 0, or over l <= z <= u; a problem made from a program gives that
program, with its rows. If M is symmetric, the optimality conditions are the problem; if M is also positive
semidefinite, they are sufficient: R. W. Cottle, J.-S. Pang and R. E. Stone, The linear complementarity problem (1992),
section 1.2.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.linalg.matrices import is_sparse, is_symmetric
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import Program, ProgramData
from lcpcli.typing import Matrix

MOST_CONVERTED = 2000  # unknowns up to which a matrix is converted; beyond that, the benchmark would misuse the peer


def not_lcp(problem: Problem) -> str:
    """Return why a peer for z >= 0 does not take the problem, as a clause; "" if it does."""
    return "takes no bounds but z >= 0" if problem.is_mixed else ""


def not_convex(problem: Problem) -> str:
    """Return why the problem is not a convex quadratic program, as a clause; "" if it is."""
    if isinstance(problem.origin, Program):
        return "" if is_monotone(problem) else "needs a convex program"
    convex = is_symmetric(problem.M) and is_monotone(problem)
    return "" if convex else "needs a symmetric positive semidefinite M"


def not_monotone(problem: Problem) -> str:
    """Return why the problem is not a monotone variational inequality, as a clause; "" if it is."""
    return "" if is_monotone(problem) else "needs v'Mv >= 0 for all v"


def is_monotone(problem: Problem) -> bool:
    """Return whether v'Mv >= 0 for all v, up to rounding."""
    return is_semidefinite(problem.M if not isinstance(problem.origin, Program) else program_of(problem).Q)


def program_of(problem: Problem, infinite: float = np.inf) -> ProgramData:
    """Return the program, to be minimized, with a solver's own infinity; without rows if the problem has no program."""
    given = conditions_of(problem)
    data = problem.origin.program(given) if isinstance(problem.origin, Program) else None
    if data is None:
        none = np.zeros(0)
        data = ProgramData(problem.M, problem.q, problem.M[:0], none, none, given.lower, given.upper)
    ends = {name: getattr(data, name) for name in ("row_lower", "row_upper", "lower", "upper")}
    return data._replace(**{name: np.clip(end, -infinite, infinite) for name, end in ends.items()})


def _not_stored(kind: str, problem: Problem) -> str:
    """Return why a peer for dense or for sparse matrices does not take M, as a clause; "" if it does."""
    fits = problem.n <= MOST_CONVERTED or is_sparse(problem.M) is (kind == "sparse")
    return "" if fits else f"takes {kind} matrices only; others are converted up to n = {MOST_CONVERTED}"


not_dense, not_sparse = partial(_not_stored, "dense"), partial(_not_stored, "sparse")


def dense(M: Matrix) -> Any:
    """Return a copy of M as a dense row-major array, which the peer may overwrite."""
    return M.toarray() if is_sparse(M) else np.array(M, order="C")


def columns(*blocks: Any) -> Any:
    """Return blocks one below the other, in compressed sparse columns, as a csc_matrix, which all peers accept."""
    with imports:
        from scipy.sparse import csc_matrix, vstack
    return csc_matrix(vstack([csc_matrix(block) for block in blocks]) if len(blocks) > 1 else blocks[0])
