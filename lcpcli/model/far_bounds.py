"""Bounds so far from 0 that they most likely stand for infinite ones, as 1e20 and 1e30 do.

If the user says so, `with_infinity` makes them infinite. Otherwise they count, but their size leaves no digits for
anything beside them: a method does better if it first solves the problem `relaxed`, whose solutions within the bounds
are also solutions of the given problem.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lcpcli.errors import count
from lcpcli.model.box import NO_BOUND, as_intervals
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import Conditions, Program
from lcpcli.typing import Mask, Vector

Sides = tuple[Mask, Mask, Mask]


def with_infinity(problem: Problem, infinity: float) -> Problem:
    """Return the problem without bounds of at least that size and, for a program, without such sides of rows.

    Raises ProblemError for a lower bound of at least `infinity`, or an upper bound of at most minus that.
    """
    origin, before, kept = problem.origin, conditions_of(problem), np.arange(problem.n)
    if isinstance(origin, Program):
        program = origin.program(before)
        assert program is not None
        changed = program.with_infinity(infinity)
        after, first = changed.conditions(), problem.n - origin.ranges
        kept = np.append(kept[:first], first + np.flatnonzero(changed.ranges[program.ranges]))
        origin = replace(origin, ranges=kept.size - first)
    else:
        bounds = as_intervals(("lower", "upper"), before.lower, before.upper, problem.n, infinity=infinity)
        after = Conditions(problem.M, problem.q, *bounds)
    if all(map(np.array_equal, after[1:], before[1:])):
        return problem
    starts = {name: start[kept] for name in ("x0", "x1") if (start := getattr(problem, name)) is not None}
    solutions = tuple(z[kept] for z in problem.solutions)
    return replace(problem, **after._asdict(), origin=origin, verdict="", solutions=solutions, **starts)


def remark(problem: Problem) -> str:
    """Return how many bounds of 1e20 or more there are and what to do if they stand for infinite ones; "" if none."""
    if (sides := _far_sides(problem)) is None:
        return ""
    number = sum(int(np.count_nonzero(side)) for side in sides)
    return f"{count(number, 'bound')} of 1e20 or more; --infinity 1e20 makes them infinite"


def _far_sides(problem: Problem) -> Sides | None:
    """Return where z has a far lower bound, where it has a far upper bound, and where it is the multiplier of a row
    whose only bound is far; None if there are no far bounds."""
    if not problem.may_have_far_bounds:
        return None
    origin = problem.origin if isinstance(problem.origin, Program) else None
    (_, q, low, high), rows = conditions_of(problem), np.zeros(problem.n, dtype=bool)
    if origin is not None:
        y = slice(origin.variables, problem.n - origin.ranges)
        from_below, from_above = (low == 0) & (high == np.inf), (low == -np.inf) & (high == 0)
        rows[y] = ((from_below & (q >= NO_BOUND)) | (from_above & (q <= -NO_BOUND)))[y]
    sides = (low <= -NO_BOUND) & (low > -np.inf), (high >= NO_BOUND) & (high < np.inf), rows
    return sides if any(side.any() for side in sides) else None


@dataclass(eq=False, repr=False)
class Relaxed(Change):
    """A problem without far bounds, in the variables of the original one, where the multipliers of `rows` without
    any other bound are fixed at 0. The two problems share only the solutions within the bounds."""

    rows: Mask

    def start(self, x: Vector) -> Vector:
        return np.where(self.rows, 0.0, x)

    def back(self, x: Vector) -> Vector:
        return np.where(self.rows, x - self.original.q / 2, x)


def relaxed(problem: Problem) -> Change:
    """Return the problem without far bounds. Where it has none, nothing changes."""
    if (sides := _far_sides(problem)) is None:
        return Change(problem, problem)
    _, q, low, high = conditions_of(problem)
    lower, upper, rows = sides
    low[lower], high[upper] = -np.inf, np.inf
    low[rows], high[rows] = 0.0, 0.0
    return Relaxed(Problem(problem.M, np.where(rows, 0.0, q), lower=low, upper=high), problem, rows)
