"""A sequence of problems, each solved from the states of the previous one."""

from __future__ import annotations

from typing import Any

from lcpcli.linalg.matrices import are_equal
from lcpcli.model.problem import Problem, as_problem
from lcpcli.solving.result import Result
from lcpcli.solving.solver import Solver


class SequenceSteps:
    """Solve the problems of a sequence, one after another, by a `Solver`: the same one as long as M is the same, and
    with another M of the same shape from the same states.

    options : tol, max_iterations, time_limit, threads and interrupts, as in `solve`, for every problem.
    """

    def __init__(self, options: dict[str, Any]) -> None:
        self._options = options
        self._solver: Solver | None = None
        self._last: Problem | None = None

    def solve(self, problem: Problem, compiled: bool = True) -> Result:
        """Return the result for the next problem, as `run` does.

        compiled : whether there are so many that the kernels of the extra `fast` are worth loading.
        """
        last, self._last = self._last, as_problem(problem)
        if self._solver is None or last is None or problem.n != last.n:
            self._solver = Solver.of(problem, self._options)
        elif not are_equal(problem.M, last.M):
            self._solver.update(problem.M)
        self._solver.compiled = compiled
        return self._solver.next(problem)
