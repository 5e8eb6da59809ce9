"""A reference solution for measuring errors, if the problem has no known solution.

For small n it is exact. Otherwise `auto` finds it, and `exact_solution.refined` refines it, if possible to
its last digits.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from lcpcli.clock import imports
from lcpcli.interrupts import TimeIsUp, within
from lcpcli.model.problem import WITHOUT_SOLUTION, Problem
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving import driver as driver
from lcpcli.typing import Vector
from lcpcli.verify.exact_solution import finitely_rounded, from_point, refined

REFERENCE_SECONDS = 10.0  # for the search for a solution
MOST_EXACT_UNKNOWNS = 200  # up to which an exact solution is computed, in a second
MOST_EXACT_POSITIVE = 64  # components of z up to which they are solved for exactly, in a second


def with_reference(problem: Problem) -> Problem:
    """Return the problem with a computed solution; unchanged if it comes with one or none is found in time.

    The solution is verified like any other result, on the original data; it may be one of several.

    Raises
    ------
    KeyboardInterrupt : the search was interrupted.
    """
    if problem.solutions or problem.verdict in WITHOUT_SOLUTION:
        return problem
    result = exact = None
    with suppress(TimeIsUp), within(REFERENCE_SECONDS):
        result = driver.run(problem, "auto")
        if result.interrupted:
            raise KeyboardInterrupt
        if result.status.has_no_solution:
            return problem
        exact = _exact(problem, result.z)
    if exact is not None:
        return replace(problem, solutions=(exact,), reference="exact")
    if result is None or not result.solved:
        return problem
    return replace(problem, solutions=(refined(problem, result.z),), reference="computed")


def _exact(problem: Problem, z: Vector) -> Vector | None:
    """Return an exact solution, rounded, of a small problem with few positive components; None if none is found."""
    if problem.n > MOST_EXACT_UNKNOWNS:
        return None
    with imports:
        from lcpcli.rational import pivoting
    data, effort = ExactProblem.of_floats(problem), Effort()
    solution = from_point(data, z, effort, MOST_EXACT_POSITIVE) or pivoting.solve(data, effort)
    return None if solution is None else finitely_rounded(solution)
