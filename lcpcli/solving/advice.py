"""Advice after a run that failed to solve its problem: what to try next, if anything is
known to help, as options for another run, written as in Python or on the command
line."""

from __future__ import annotations

import math
from typing import Any

from lcpcli.clock import imports
from lcpcli.methods.registry import METHODS, NONLINEAR, RESTARTS
from lcpcli.model.evaluations import BY_DIFFERENCES
from lcpcli.options import AUTO, MAX_ITERATIONS
from lcpcli.solving.result import Options, Result, Status, Suggestions

# Numbers from this size on are written with an exponent, as their digits are hard to
# count.
EXPONENT_FROM = 1e6
EXACT: Options = {"exact": True}  # a proof in rational arithmetic
WHY: Options = {"why": True}  # what conflicts, and what would help
# A run that stalls with a relative residual below this has reached the limit of
# rounding.
ROUNDING_LEVEL = 1e-8
SMALLEST_TOL = 1e-14  # a smaller tolerance is out of reach in double precision
# A relative residual below which the method that reached it may reach a solution too.
NEAR = 1e-2
MIN_TIME_LIMIT = 60  # seconds: the shortest longer time limit that is suggested
MAX_PROVED_UNKNOWNS = 200  # up to which rational arithmetic takes seconds
FEW_ITERATIONS = 1000  # a limit below this may be too small for any method
MORE_RESTARTS = 20  # the smallest number of further starts that is suggested
# Multiple of the iterations that gave half of the digits; linear convergence needs
# twice as many for all digits.
MORE_ITERATIONS = 4
# Parts of the messages of methods for nonlinear problems: steps have left the domain of
# F, or F is noisy.
OUTSIDE = "F is undefined"
NOISY = "F is noisy"
LARGEST_TOL = 1e-2  # the largest tolerance that is suggested for a noisy F
AUTOMATIC: Options = {"method": AUTO}


def suggestions(result: Result) -> Suggestions:
    """Return what to try next after this result."""
    if result.interrupted:
        return Suggestions()
    status, automatic = result.status, result.method == "auto"
    if status.has_no_solution and result.method not in NONLINEAR:
        return Suggestions((WHY,))
    if result.method in NONLINEAR and status not in (
        Status.TIME_LIMIT,
        Status.ITERATION_LIMIT,
    ):
        return _where_stuck(result)
    if status is Status.TIME_LIMIT:
        longer = {"time_limit": _round(max(MIN_TIME_LIMIT, 10 * result.seconds))}
        if not automatic and result.method not in NONLINEAR:
            return Suggestions((AUTOMATIC,), longer)
        is_near = (
            automatic and result.nearest in METHODS and result.relative_residual <= NEAR
        )
        return Suggestions(
            (longer, {"method": result.nearest} | longer) if is_near else (longer,)
        )
    if status is Status.ITERATION_LIMIT:
        return _after_the_limit(result)
    if status not in (Status.STALLED, Status.DIVERGED, Status.BREAKDOWN, Status.RAY):
        return Suggestions()
    too_small = result.tol < SMALLEST_TOL
    ways = [] if automatic or too_small else [AUTOMATIC]
    if status is Status.STALLED and result.relative_residual <= ROUNDING_LEVEL:
        ways.append({"tol": _round(2 * result.relative_residual)})
    if (
        (automatic or too_small)
        and result.exact is None
        and result.problem.n <= MAX_PROVED_UNKNOWNS
    ):
        ways.append(EXACT)
    return Suggestions(tuple(ways))


def _where_stuck(result: Result) -> Suggestions:
    """Suggest other starts for a nonlinear problem, and what may be wrong with its
    functions."""
    with imports:
        from lcpcli.inspection.theory import BAD_SPREAD, spread
    ways: list[Options] = [
        {RESTARTS.name: max(MORE_RESTARTS, 5 * int(result.options[RESTARTS.name]))}
    ]
    if NOISY in result.message and result.relative_residual < LARGEST_TOL / 2:
        ways.insert(0, {"tol": _round(2 * result.relative_residual)})
    others, decades = ["another start"], max(spread(result.problem.M))
    if BY_DIFFERENCES in result.message:
        others.insert(0, "another J")
    if OUTSIDE in result.message:
        others.append("bounds within the domain of F")
    if decades > BAD_SPREAD:
        others.append(
            f"another scaling, as rows or columns of J differ by {decades:.0f} decades"
        )
    return Suggestions(tuple(ways), others=tuple(others))


def _after_the_limit(result: Result) -> Suggestions:
    """Suggest more iterations if they lead to the solution, otherwise a method that
    needs fewer."""
    default, k = int(MAX_ITERATIONS.value), result.iterations
    usual = {"max_iterations": default}
    if result.method == "auto" or result.method in NONLINEAR:
        return Suggestions((usual if k < default else {"max_iterations": 10 * k},))
    if result.relative_residual <= math.sqrt(result.tol):
        return Suggestions(
            ({"max_iterations": int(_round(MORE_ITERATIONS * k))}, AUTOMATIC)
            if k
            else (usual,)
        )
    return Suggestions((AUTOMATIC,), usual if k < FEW_ITERATIONS else {})


def _round(value: float) -> float:
    """Return a value rounded up to one significant digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit * (1 - 1e-12)) * unit


def in_python(options: Options) -> str:
    """Return options as keywords, or the function that proves or explains a result."""
    for other, function in ((EXACT, "exact"), (WHY, "why")):
        if options == other:
            return f"lcpcli.{function}(problem)"
    return ", ".join(
        f"{name}={value_text(value, quotes=True)}" for name, value in options.items()
    )


def value_text(value: Any, quotes: bool) -> str:
    """Return a value as it is written in Python, or on the command line, where words
    have no quotes."""
    if isinstance(value, str | int):
        return f'"{value}"' if quotes and isinstance(value, str) else str(value)
    return f"{value:.0f}" if 1 <= value < EXPONENT_FROM else f"{value:.0e}"
