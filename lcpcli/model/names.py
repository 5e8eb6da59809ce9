"""Components of solutions by the names of the unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

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
    i = names.index(name)
    found: Vector = z[..., i]
    return 0.0 - found if i in reversed_names(problem) else found


def reversed_names(problem: Problem) -> set[int]:
    """Return the components whose names stand for them with the other sign: multipliers of a program to be
    maximized."""
    origin, names = problem.origin, problem.names
    return {i for i in origin.reversed(problem.n) if names[i]} if isinstance(origin, Program) else set()


def in_own_sense(problem: Problem, values: Sequence[Any]) -> list[Any]:
    """Return z, or w, with the signs for which the names of its components stand."""
    turned = reversed_names(problem)
    return [0 - value if i in turned else value for i, value in enumerate(values)]
