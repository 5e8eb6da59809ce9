"""What to try next after a run that has not solved its problem: what is known to lead further, or nothing."""

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

ROUNDING_LEVEL = 1e-8  # a run that stalls with a relative residual below this has come as far as rounding lets it
FINEST = 1e-14  # a tolerance below this asks for more than doubles have
SECONDS = 60  # at least, of a longer time limit
EXACT = 200  # unknowns that rational arithmetic settles in seconds
DENSE = 2000  # unknowns for which definiteness is found out in passing
DOUBT = 1e-10  # of the diagonal, that must be left over
FEW = 1000  # iterations, of which more may be needed whatever is tried
ENOUGH = 4  # times the iterations after which half of the digits were there


def advice(result: Result) -> str:
    """One line on what to try, in options of the command line; "" where nothing is known to help, or needed."""
    ways, more = ways_on(result)
    return f"try {', or '.join(ways)}{f', with {more}' * bool(more)}" if ways else ""


def ways_on(result: Result) -> tuple[list[str], str]:
    """The ways on, the surest first, each as what to add to the command (or to put in place of what it has).

    Also what each of them is to be given besides; "" if nothing.
    """
    status, automatic = result.status, result.method == "auto"
    if status is Status.TIME_LIMIT:
        longer = f"--time-limit {_round(max(SECONDS, 10 * (result.seconds)))}"
        return ([longer], "") if automatic else (["--method auto"], longer)
    if status is Status.ITERATION_LIMIT:
        return _after_the_limit(result)
    if status not in (Status.STALLED, Status.DIVERGED, Status.BREAKDOWN, Status.RAY):
        return [], ""
    beyond = result.tol < FINEST
    ways = [] if automatic or beyond else ["--method auto", *_with_additions(result)]
    if status is Status.STALLED and result.relative_residual <= ROUNDING_LEVEL:
        ways.append(f"--tol {_round(2 * result.relative_residual)}")
    if (automatic or beyond) and result.exact is None and result.problem.n <= EXACT:
        ways.append("lcp solve --exact")
    return ways, ""


def _after_the_limit(result: Result) -> tuple[list[str], str]:
    """With more iterations where these lead there; otherwise with what needs fewer."""
    usual, k = int(MAX_ITERATIONS.value), result.iterations
    if result.method == "auto":
        return [f"--max-iterations {usual if k < usual else 10 * k}"], ""
    if result.relative_residual <= math.sqrt(result.tol):
        return ([f"--max-iterations {_round(ENOUGH * k)}", "--method auto"] if k else [f"--max-iterations {usual}"]), ""
    return ["--method auto", *_with_additions(result)], f"--max-iterations {usual}" if k < FEW else ""


def _with_additions(result: Result) -> list[str]:
    """What a method that iterates may be given to get there itself, where M is definite: one way, or none."""
    if not METHODS[result.method].iterates or result.status is Status.BREAKDOWN or not _is_definite(result.problem):
        return []
    missing = [flag(name) for name in ADDITIONS if not result.options.get(name)]
    if result.options.get("omega") == OMEGA.default and matrices.is_symmetric(result.problem.M):
        return [" ".join([*missing[:1], "--omega auto --anderson 5"])]
    return [" ".join(missing)] if missing else []


@np.errstate(over="ignore", invalid="ignore")
def _is_definite(problem: Problem) -> bool:
    """Whether the equilibrated M is positive definite, as far as that can be told at once and without doubt."""
    if is_sparse(problem.M) or problem.n > DENSE:
        return False
    M = matrices.scaled(problem.M, *equilibrate(problem.M, problem.q))
    if not np.isfinite(M).all():
        return False
    try:
        np.linalg.cholesky(M + M.T - DOUBT * np.diag(np.abs(np.diag(M))))
    except np.linalg.LinAlgError:
        return False
    return True


def _round(value: float) -> str:
    """One significant digit, rounded upwards."""
    unit = 10.0 ** math.floor(math.log10(value))
    rounded = math.ceil(value / unit * (1 - 1e-12)) * unit
    return f"{rounded:.0f}" if rounded >= 1 else f"{rounded:.0e}"
