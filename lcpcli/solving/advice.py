"""What to try next after a run that did not solve its problem; nothing if nothing is known to help."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.units import equilibrate
from lcpcli.methods import shi, smoothing
from lcpcli.methods.registry import ADDITIONS, OMEGA, declared
from lcpcli.model import changes
from lcpcli.model.changes import shifted
from lcpcli.options import AUTO, MAX_ITERATIONS
from lcpcli.solving.answer import EXACT, NO_SUGGESTIONS, Options, Suggestions
from lcpcli.solving.result import Status

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Result

ROUNDING_LEVEL = 1e-8  # a run that stalls with a relative residual below this has reached the limit of rounding
SMALLEST_TOL = 1e-14  # a smaller tolerance is out of reach in double precision
LEAST_SECONDS = 60  # the least that is suggested as a longer time limit
MOST_EXACT = 200  # unknowns up to which rational arithmetic takes seconds
MOST_DENSE = 2000  # unknowns up to which testing definiteness is cheap
MARGIN = 1e-10  # relative to the diagonal, by which M must be definite
FEW_ITERATIONS = 1000  # a limit below this may be too small for any method
MORE = 4  # times the iterations that gave half of the digits
AUTOMATIC: Options = {"method": AUTO}


def suggestions(result: Result) -> Suggestions:
    """What to try after this result."""
    status, automatic = result.status, result.method == "auto"
    if status is Status.TIME_LIMIT:
        longer = {"time_limit": _round(max(LEAST_SECONDS, 10 * result.seconds))}
        return Suggestions((longer,)) if automatic else Suggestions((AUTOMATIC,), longer)
    if status is Status.ITERATION_LIMIT:
        return _after_the_limit(result)
    if status not in (Status.STALLED, Status.DIVERGED, Status.BREAKDOWN, Status.RAY):
        return NO_SUGGESTIONS
    too_small = result.tol < SMALLEST_TOL
    ways = [] if automatic or too_small else [*_larger_p(result), AUTOMATIC, *_with_additions(result)]
    if status is Status.STALLED and result.relative_residual <= ROUNDING_LEVEL:
        ways.append({"tol": _round(2 * result.relative_residual)})
    if (automatic or too_small) and result.exact is None and result.problem.n <= MOST_EXACT:
        ways.append(EXACT)
    return Suggestions(tuple(ways))


def _after_the_limit(result: Result) -> Suggestions:
    """More iterations if they lead to the solution, otherwise what needs fewer."""
    default, k = int(MAX_ITERATIONS.value), result.iterations
    usual = {"max_iterations": default}
    if result.method == "auto":
        return Suggestions((usual if k < default else {"max_iterations": 10 * k},))
    if result.relative_residual <= math.sqrt(result.tol):
        return Suggestions(({"max_iterations": int(_round(MORE * k))}, AUTOMATIC) if k else (usual,))
    return Suggestions((AUTOMATIC, *_with_additions(result)), usual if k < FEW_ITERATIONS else {})


def _with_additions(result: Result) -> list[Options]:
    """Options with which an iterative method may converge after all, if M is definite: one suggestion, or none."""
    if not declared(result.method).iterates or result.status is Status.BREAKDOWN or not _is_definite(result.problem):
        return []
    missing = {name: True for name in ADDITIONS if not result.options.get(name)}
    if result.options.get("omega") == OMEGA.default and matrices.is_symmetric(result.problem.M):
        return [{**dict(list(missing.items())[:1]), "omega": AUTO, "anderson": 5}]
    return [missing] if missing else []


def _larger_p(result: Result) -> list[Options]:
    """A p whose smoothing error is within the tolerance, or below rounding, where a small p has ended the run."""
    if shi.SMOOTHING not in result.message:
        return []
    problem = result.problem if result.problem.reference_z is None else shifted(result.problem).problem
    problem = changes.scale(problem).problem if result.options.get("scale") else problem
    larger = min(smoothing.p_within(problem, result.tol), shi.default_p(problem))
    return [{"p": _round(larger)}]


@np.errstate(over="ignore", invalid="ignore")
def _is_definite(problem: Problem) -> bool:
    """Whether the equilibrated M is clearly positive definite; False if that is not cheap to test."""
    if is_sparse(problem.M) or problem.n > MOST_DENSE:
        return False
    M = matrices.scaled(problem.M, *equilibrate(problem.M, problem.q))
    if not np.isfinite(M).all():
        return False
    try:
        np.linalg.cholesky(M + M.T - MARGIN * np.diag(np.abs(np.diag(M))))
    except np.linalg.LinAlgError:
        return False
    return True


def _round(value: float) -> float:
    """One significant digit, rounded up."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit * (1 - 1e-12)) * unit
