"""Whether a solution is unique: by a theorem in floating-point arithmetic, or for few
unknowns by a search in exact arithmetic.

A solve waits for the answer, so that both take only a few milliseconds and do not load
scipy.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS, size

if TYPE_CHECKING:
    from lcpcli.enumeration.search import Solutions
    from lcpcli.model.problem import Problem
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.typing import Vector

QUICK_UNKNOWNS = 10  # a search over this many unknowns takes up to 5 milliseconds
# Limit on the search, in seconds that it usually takes: it stops if numbers have very
# many digits.
QUICK_EFFORT = 0.5
MAX_UNKNOWNS = 50  # up to here the theorem takes less than a millisecond
# The number of digits is not limited, and computing with longer texts may take seconds.
MAX_TEXT_BYTES = 200_000
# The largest number of solutions to which errors refer: each iterate is compared with
# all.
MAX_REFERENCES = 16
# Two points that differ by less than this times the largest component are printed
# alike.
AGREEMENT = 1e-7


class Findings(NamedTuple):
    """Whether there are solutions other than z: None if that is not decided, or if the
    only solution differs from z in print; and whether the problem has an exact
    solution, None if that is not decided.
    """

    others: bool | None = None
    solvable: bool | None = None


def is_asked(problem: Problem) -> bool:
    """Return whether the problem is small enough for an immediate answer, and its
    formulation reports other solutions.
    """
    if problem.n > MAX_UNKNOWNS or problem.origin is None:
        return problem.n <= MAX_UNKNOWNS
    return problem.origin.counts_solutions


def search_others(
    problem: Problem,
    z: Vector,
    exactly: Callable[[], ExactProblem],
    length: Callable[[], int] = int,
) -> Findings:
    """Return whether there are solutions other than z, which solves the problem up to
    rounding, if that can be decided in a few milliseconds.

    exactly : a function that returns the problem with its numbers as written. length :
        a function that returns the number of bytes of its text. An error in the search
        is ignored, as the solution does not depend on it.
    """
    if is_only(problem, z):
        return Findings(others=False, solvable=True)
    if problem.n > QUICK_UNKNOWNS or length() > MAX_TEXT_BYTES:
        return Findings()
    try:
        search = quick_search(exactly())
        pieces = list(islice(search, 2))
    except Exception:  # for example, because an exponent is too large to be expanded
        return Findings()
    if len(pieces) > 1 or not all(piece.is_point for piece in pieces):
        return Findings(others=True, solvable=True)
    if not pieces:
        return Findings(solvable=False if search.complete else None)
    with imports:
        from lcpcli.enumeration.search import hangs_on_rounding
        from lcpcli.rational.numbers import rounded
    if hangs_on_rounding(search.problem):
        return Findings(
            solvable=True
        )  # there may be others before rounding of the data
    exact = rounded(pieces[0].vertices[0])
    agree = size(exact - z) <= AGREEMENT * max(size(exact), size(z))
    return Findings(others=False if search.complete and agree else None, solvable=True)


@np.errstate(all="ignore")
def is_only(problem: Problem, z: Vector) -> bool:
    """Return whether z is proved to agree with the only solution to AGREEMENT, also for
    all data that round to these numbers.

    There is exactly one solution if M is H+ or positive definite, and its distance from
    z is bounded by means of the residual.
    """
    M, rounding = matrices.dense(problem.M), (problem.n + 16) * EPS
    diagonal = M.diagonal()
    if not (problem.n and problem.is_moderate and diagonal.min() > 0):
        return False
    w = M @ z + problem.q
    error = 2 * rounding * (np.abs(M) @ np.abs(z) + np.abs(problem.q))
    low, high = (
        np.abs(problem.box.gaps(z, end, diagonal)) for end in (w - error, w + error)
    )
    with imports:
        from lcpcli.verify.error_theorems import definite_theorems, h_plus_theorem
    theorem, max_error = h_plus_theorem(problem), AGREEMENT * size(z)
    if (
        theorem is not None
        and theorem(z, np.where(low > high, w - error, w + error)) <= max_error
    ):
        return True
    return any(
        theorem(z, w, error) <= max_error
        for theorem in definite_theorems(problem, has_bound=True).values()
    )


def with_all_references(problem: Problem) -> Problem:
    """Return a problem in few unknowns that has a computed exact solution with all of
    its solutions, if these are few and isolated, so that errors refer to the closest
    one; any other problem unchanged.
    """
    if problem.reference != "exact" or problem.n > QUICK_UNKNOWNS:
        return problem
    with imports:
        from lcpcli.rational.exact_problem import ExactProblem
        from lcpcli.rational.numbers import rounded
    search = quick_search(ExactProblem.of_floats(problem))
    pieces = list(islice(search, MAX_REFERENCES + 1))
    if not pieces or not search.complete or not all(piece.is_point for piece in pieces):
        return problem
    return problem.having(
        solutions=tuple(rounded(piece.vertices[0]) for piece in pieces)
    )


def quick_search(data: ExactProblem) -> Solutions:
    """Return a search for all solutions with the limit QUICK_EFFORT."""
    with imports:
        from lcpcli.enumeration.search import Solutions
        from lcpcli.rational.elimination import Effort
    return Solutions(data, math.inf, None, Effort(QUICK_EFFORT))
