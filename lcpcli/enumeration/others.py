"""Whether a solution is the only one, as far as a short search can tell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from lcpcli.interrupts import alarm, deadline
from lcpcli.model.program import Program

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.model.problem import Problem
    from lcpcli.rational.exact_problem import ExactProblem
    from lcpcli.typing import Vector

QUICK_UNKNOWNS, QUICK_SECONDS = 10, 0.5  # a search among so few takes milliseconds, if the machine is not busy
OTHERS_SECONDS = 0.05  # for more unknowns: the answer waits for it
MOST_SEARCHED_UNKNOWNS = 50  # the search for more has steps that take longer than the time limit
MOST_TEXT_BYTES = 200_000  # as there is no limit on digits: longer texts may take seconds to compute with
MOST_REFERENCES = 16  # solutions that errors refer to: each iterate is compared with each
AGREEMENT = 1e-7  # of the largest component: two points that are this close are the same as they are printed


class Findings(NamedTuple):
    """The findings of a search for solutions beside z.

    others : whether there are any; None if that is not decided, or if the only solution differs from z as printed.
    solvable : whether the problem has an exact solution; None if that is not decided.
    """

    others: bool | None = None
    solvable: bool | None = None


def is_searched(problem: Problem, length: Callable[[], int]) -> bool:
    """Return whether a problem, in a text of `length` bytes, is small enough for the search, and does not come from a
    program, of which only x counts."""
    is_small = problem.n <= MOST_SEARCHED_UNKNOWNS
    return is_small and not isinstance(problem.origin, Program) and length() <= MOST_TEXT_BYTES


def search_others(z: Vector, exactly: Callable[[], ExactProblem]) -> Findings:
    """Search for solutions beside z, which solves a problem up to rounding. `exactly` makes that problem, with its
    numbers as written. An error in the search is ignored: the solution stands without it."""
    try:
        return _searched(z, exactly())
    except Exception:  # also of a number with an exponent that is not expanded
        return Findings()


def with_all_references(problem: Problem) -> Problem:
    """Return a problem in few unknowns that has a computed exact solution with all of its solutions, if these are few
    and isolated, so that errors refer to the nearest one; any other problem as it is."""
    if problem.reference != "exact" or problem.n > QUICK_UNKNOWNS or problem.origin is not None:
        return problem
    from lcpcli.enumeration.search import solutions
    from lcpcli.rational.numbers import rounded

    search = solutions(problem, time_limit=QUICK_SECONDS)
    pieces = list(islice(search, MOST_REFERENCES + 1))
    if not pieces or not search.complete or not all(piece.is_point for piece in pieces):
        return problem
    return replace(problem, solutions=tuple(rounded(piece.vertices[0]) for piece in pieces))


def _searched(z: Vector, data: ExactProblem) -> Findings:
    if data.n <= QUICK_UNKNOWNS and (only := _by_theorem(z, data)) is not None:
        return Findings(others=False if _agree(only, z) else None, solvable=True)
    from lcpcli.enumeration.search import solutions

    search = solutions(data, time_limit=QUICK_SECONDS if data.n <= QUICK_UNKNOWNS else OTHERS_SECONDS)
    pieces = list(islice(search, 2))
    if len(pieces) > 1 or not all(piece.is_point for piece in pieces):
        return Findings(others=True, solvable=True)
    if not pieces:
        return Findings(solvable=False if search.complete else None)
    is_only = search.complete and _agree(pieces[0].vertices[0], z)
    return Findings(others=False if is_only else None, solvable=True)


def _by_theorem(z: Vector, data: ExactProblem) -> list[Fraction] | None:
    """Return the exact solution near z, if a theorem says that there is no other solution."""
    from lcpcli.enumeration.theorems import POINT, shape
    from lcpcli.verify.exact_solution import from_point

    end = deadline(QUICK_SECONDS)
    return from_point(data, z, end) if shape(data, alarm(end)) == POINT else None


def _agree(exact: Sequence[Fraction], z: Vector) -> bool:
    """Return whether two points are the same when they are printed."""
    from lcpcli.linalg.doubles import size
    from lcpcli.rational.numbers import rounded

    values = rounded(exact)
    return size(values - z) <= AGREEMENT * max(size(values), size(z))
