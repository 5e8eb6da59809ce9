"""Components of solutions by the names of the unknowns."""

from __future__ import annotations

from lcpcli.errors import likely
from lcpcli.model.problem import Problem
from lcpcli.model.program import Program
from lcpcli.typing import Vector


def component(problem: Problem, name: str, z: Vector) -> Vector:
    """Return the component of z with this name, or of each z in an array of shape (m, n); of a program to be maximized
    its multiplier in that sense. Raise KeyError if there is none, with a likely name, or several."""
    names = list(problem.names)
    if not name or name not in names:
        raise KeyError(f"{name!r} is not the name of an unknown; {likely(str(name), list(filter(None, names)))}")
    if (times := names.count(name)) > 1:
        raise KeyError(f"{name!r} is the name of {times} unknowns; take z, with their indices")
    i, origin = names.index(name), problem.origin
    found: Vector = z[..., i]
    return 0.0 - found if isinstance(origin, Program) and i in origin.reversed(problem.n) else found
