"""Components of solutions by the names of the unknowns."""

from __future__ import annotations

from typing import Any

from lcpcli.errors import likely
from lcpcli.model.problem import Problem
from lcpcli.model.program import Program


def component(problem: Problem, name: str, z: Any) -> Any:
    """Return the component of z with this name, of a program to be maximized its multiplier in that sense; raise
    KeyError if there is none, with a likely name, or several."""
    if name not in problem.names or not name:
        raise KeyError(
            f"{name!r} is not the name of an unknown; {likely(str(name), list(filter(None, problem.names)))}"
        )
    if (times := list(problem.names).count(name)) > 1:
        raise KeyError(f"{name!r} is the name of {times} unknowns; take z, with their indices")
    own = problem.origin.in_own_sense(z) if isinstance(problem.origin, Program) else z
    return own[list(problem.names).index(name)]
