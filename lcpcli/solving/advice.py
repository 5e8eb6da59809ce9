"""What to try next after a run that did not solve its problem; nothing if nothing is known to help."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.equilibration import equilibrate
from lcpcli.linalg.matrices import is_sparse
from lcpcli.methods.registry import ADDITIONS, METHODS, OMEGA
from lcpcli.options import MAX_ITERATIONS, flag
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


def advice(result: Result) -> str:
    """One line on what to try, as command-line options; "" if nothing is known to help, or nothing is needed."""
    ways, more = suggestions(result)
    return f"try {', or '.join(ways)}{f', with {more}' * bool(more)}" if ways else ""


def suggestions(result: Result) -> tuple[list[str], str]:
    """What to try, the surest first, each as options to add to the command (or to replace those it has).

    Also the options that each of them needs in addition; "" if none.
    """
    status, automatic = result.status, result.method == "auto"
    if status is Status.TIME_LIMIT:
        longer = f"--time-limit {_round(max(LEAST_SECONDS, 10 * (result.seconds)))}"
        return ([longer], "") if automatic else (["--method auto"], longer)
    if status is Status.ITERATION_LIMIT:
        return _after_the_limit(result)
    if status not in (Status.STALLED, Status.DIVERGED, Status.BREAKDOWN, Status.RAY):
        return [], ""
    too_small = result.tol < SMALLEST_TOL
    ways = [] if automatic or too_small else ["--method auto", *_with_additions(result)]
    if status is Status.STALLED and result.relative_residual <= ROUNDING_LEVEL:
        ways.append(f"--tol {_round(2 * result.relative_residual)}")
    if (automatic or too_small) and result.exact is None and result.problem.n <= MOST_EXACT:
        ways.append("lcp solve --exact")
    return ways, ""


def _after_the_limit(result: Result) -> tuple[list[str], str]:
    """More iterations if they lead to the solution, otherwise what needs fewer."""
    default, k = int(MAX_ITERATIONS.value), result.iterations
    if result.method == "auto":
        return [f"--max-iterations {default if k < default else 10 * k}"], ""
    if result.relative_residual <= math.sqrt(result.tol):
        return ([f"--max-iterations {_round(MORE * k)}", "--method auto"] if k else [f"--max-iterations {default}"]), ""
    return ["--method auto", *_with_additions(result)], f"--max-iterations {default}" if k < FEW_ITERATIONS else ""


def _with_additions(result: Result) -> list[str]:
    """Options with which an iterative method may converge after all, if M is definite: one suggestion, or none."""
    if not METHODS[result.method].iterates or result.status is Status.BREAKDOWN or not _is_definite(result.problem):
        return []
    missing = [flag(name) for name in ADDITIONS if not result.options.get(name)]
    if result.options.get("omega") == OMEGA.default and matrices.is_symmetric(result.problem.M):
        return [" ".join([*missing[:1], "--omega auto --anderson 5"])]
    return [" ".join(missing)] if missing else []


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


def _round(value: float) -> str:
    """One significant digit, rounded up."""
    unit = 10.0 ** math.floor(math.log10(value))
    rounded = math.ceil(value / unit * (1 - 1e-12)) * unit
    return f"{rounded:.0f}" if rounded >= 1 else f"{rounded:.0e}"
