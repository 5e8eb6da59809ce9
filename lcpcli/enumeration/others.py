"""Whether a solution is the only one, as far as a short search can tell."""

from __future__ import annotations

from lcpcli.enumeration.search import solutions
from lcpcli.model.problem import Problem
from lcpcli.model.reductions.program import Program
from lcpcli.rational.problem import ExactProblem

SMALL, SECONDS_SMALL = 10, 0.5  # a search among so few unknowns takes milliseconds, if the machine is not busy
SECONDS = 0.05
MOST = 50  # unknowns; the search for more has steps that take longer


def has_others(problem: Problem) -> bool | None:
    """Whether a problem that has a solution has others too, proved for its decimals; None if that is not found out, or
    for the conditions of a program, of which only x counts."""
    if problem.n > MOST or isinstance(problem.origin, Program):
        return None
    seconds = SECONDS_SMALL if problem.n <= SMALL else SECONDS
    search = solutions(ExactProblem.of_decimals(problem), time_limit=seconds, max_solutions=2)
    pieces = list(search)
    if len(pieces) > 1 or not all(piece.is_point for piece in pieces):
        return True
    return False if search.complete and pieces else None
