"""The results of pivoting on many problems at once, each created when it is read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.clock import Stopwatch
from lcpcli.methods import registry as methods
from lcpcli.methods.direct import CANDIDATE, CERTAIN, NOTHING, DirectAnswer
from lcpcli.options import Limits
from lcpcli.solving.direct_run import SOLVED, result_of, route
from lcpcli.solving.result import Result
from lcpcli.typing import Indices, Mask, Vector
from lcpcli.verify.point import Criterion, Point

if TYPE_CHECKING:
    from lcpcli.model.right_hand_sides import Block
    from lcpcli.model.stacks import Stack


class _RowResult(Result):
    """The result of a row of a block that surely is a solution, z. Its problem and its point are made when they are
    read, as of many results little more than z is."""

    _row: tuple[Block | Stack, int, Vector]

    @property
    def z(self) -> Vector:
        return self._row[2][self._row[1]] if "_row" in vars(self) else self.point.z

    def __getattr__(self, name: str) -> Any:
        if name not in ("problem", "point"):
            raise AttributeError(name)
        block, i, Z = self._row
        problem = block.problem(i)
        vars(self).update(problem=problem, point=Point.of_solution(Criterion(problem, self.limits.tol), Z[i]))
        return vars(self)[name]

    def __reduce__(self) -> tuple[Any, ...]:
        return Result, tuple(getattr(self, field.name) for field in fields(Result))


class BlockAnswers:
    """The answers of pivoting to the problems of a block.

    Z : the z of each, shape (m, n). found : what each is, and its steps, as `direct_rows.direct_many` returns them,
    shape (m, 2). parts : the share of each in the time.
    """

    def __init__(
        self, block: Block | Stack, Z: Vector, found: Indices, limits: Limits, parts: dict[str, float]
    ) -> None:
        self.block, self.Z, self.parts, self._limits = block, Z, parts, limits
        most_steps = limits.max_iterations if sum(parts.values()) < limits.time_limit else -1
        kinds = np.where(block.are_moderate & (found[:, 1] <= most_steps), found[:, 0], NOTHING)
        self.certain: Mask = kinds == CERTAIN
        self._kinds, self._steps = kinds.tolist(), found[:, 1].tolist()
        self._options = methods.options_in_force("auto", block.like, {})
        self._common = {**SOLVED, "parts": parts, "limits": limits}

    def result(self, i: int) -> Result | None:
        """Return the result of a row; None if its answer is no solution."""
        kind, steps = self._kinds[i], self._steps[i]
        if kind == NOTHING:
            return None
        if kind == CANDIDATE:
            answer = DirectAnswer(self.Z[i], False, steps)
            return result_of(answer, self.block.problem(i), self._limits, self._options.copy(), self.parts)
        own = {"iterations": steps, "evaluations": steps, "route": route(steps), "options": self._options.copy()}
        return _RowResult.of_fields({**self._common, **own, "_row": (self.block, i, self.Z)})


def answers(
    block: Block | Stack, limits: Limits, stopwatch: Stopwatch, pivoting: Callable[[], tuple[Vector, Indices]]
) -> BlockAnswers:
    """Return the answers to the problems of a block, one or more, by a function that returns z and what they are."""
    stopwatch.count("setup")
    Z, found = pivoting()
    stopwatch.count("solve")
    return BlockAnswers(block, Z, found, limits, {part: spent / len(Z) for part, spent in stopwatch.parts.items()})
