"""The problem as a convex quadratic program: minimize z'Mz / 2 + q'z over z >= 0, or over l <= z <= u; or the program
that it comes from, whose rows the solvers get as rows.

If M is symmetric, the optimality conditions are the problem; if M is positive semidefinite too, they are sufficient:
R. W. Cottle, J.-S. Pang and R. E. Stone, The linear complementarity problem (1992), section 1.2.

Differs from qpsolvers in: DAQP's z and status and HiGHS's status are kept on failure; conversion and setup are timed.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.reductions.program import Program, ProgramData
from lcpcli.typing import Vector

_semidefinite: WeakKeyDictionary[Problem, bool] = WeakKeyDictionary()


def not_convex(problem: Problem) -> str:
    """Why the problem is not a convex quadratic program, as a clause; "" if it is."""
    if isinstance(problem.origin, Program):
        return "" if is_monotone(problem) else "needs a convex program"
    convex = matrices.is_symmetric(problem.M) and is_monotone(problem)
    return "" if convex else "needs a symmetric positive semidefinite M"


def program_of(problem: Problem, infinite: float = np.inf) -> ProgramData:
    """The program, to be minimized, with a solver's own infinity; without rows if the problem comes from none."""
    given = conditions_of(problem)
    data = problem.origin.program(given) if isinstance(problem.origin, Program) else None
    if data is None:
        none = np.zeros(0)
        data = ProgramData(problem.M, problem.q, problem.M[:0], none, none, given.lower, given.upper)
    ends = {name: getattr(data, name) for name in ("row_lower", "row_upper", "lower", "upper")}
    return data._replace(**{name: np.clip(end, -infinite, infinite) for name, end in ends.items()})


def z_of(problem: Problem, x: Any, y: Any) -> Vector:
    """z of a minimizer and the multipliers of the rows: the derivatives of the minimum with respect to their bounds."""
    if not isinstance(problem.origin, Program):
        return np.array(x)
    return problem.origin.z_of(np.array(x), np.array(y), program_of(problem))


def is_monotone(problem: Problem) -> bool:
    """Whether v'Mv >= 0 for all v, up to rounding. Cached for each problem, as it may take a factorization."""
    if problem not in _semidefinite:
        M = problem.M if not isinstance(problem.origin, Program) else program_of(problem).Q
        _semidefinite[problem] = is_semidefinite(M if matrices.is_symmetric(M) else (M + M.T) / 2)
    return _semidefinite[problem]
