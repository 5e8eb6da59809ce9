"""Active-set finishing: from an iterate near the solution to the solution itself, exact up to rounding.

The states that x stands for, the set P = {i : x_i > 0} for an LCP, have a basic solution (see `basic_solution`).
If that violates no sign beyond rounding it is the solution. If not, and only a few signs are violated, a few steps of
block principal pivoting correct it: M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear
Algebra and its Applications 21 (1978) 207-215.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from lcpcli.clock import seconds
from lcpcli.linalg.doubles import is_finite
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.methods.iterate import Finished, Iterate, Stage, advance
from lcpcli.model.box import Basis
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.basic_solution import BasicSolution, BasicSolutions

STEP = "finish"
STABLE_ITERATES = 2  # consecutive iterates with nearly unchanged P before an attempt
MAX_CHANGE = 0.004  # of n: the change of P per iterate up to which it counts as nearly unchanged


def finish(problem: Problem, x0: Vector | None, stage: Stage, clock: Callable[[], float] = seconds) -> Stage:
    """Pass on the iterates of a stage, and end with the solution as soon as their active set yields it.

    An attempt is made when P is nearly unchanged for STABLE_ITERATES iterates, and when the stage ends; it continues
    pivoting while the number of violations decreases. All attempts together take no longer than the iterations so far,
    as far as earlier pivoting steps predict; only the attempt at the end of the stage has no time limit.

    x0 : the start of the stage, whose active set counts too; None if it has none.

    Yields
    ------
    Iterate : those of the stage; finally, if an attempt succeeds, the basic solution, with step "finish". There x is
        (z - w) / 2, and no sign is violated beyond rounding.

    Returns
    -------
    Finished if an attempt succeeded, else how the stage ended.
    """
    finisher, iterated = _Finisher(problem, clock), 0.0
    last = None if x0 is None else Iterate(x0, None, "", 0)
    if last is not None:
        finisher.is_stable(problem.box.basis_of(last.x))
    while True:
        began = clock()
        step = advance(stage)
        iterated += clock() - began
        if isinstance(step, Iterate):
            yield step
            last, budget, ready = step, iterated, finisher.is_stable(problem.box.basis_of(step.x))
        else:
            budget, ready = np.inf, last is not None
        if ready and last is not None and finisher.is_due(budget, basis := problem.box.basis_of(last.x)):
            finished = finisher.attempt(basis, budget, last.evaluations)
            if finished is not None:
                yield finished
                return Finished()
        if not isinstance(step, Iterate):
            return step


class _Finisher:
    """The attempts and the time that they have taken."""

    def __init__(self, problem: Problem, clock: Callable[[], float]) -> None:
        self._problem, self._clock = problem, clock
        self._solutions = BasicSolutions(problem)
        self._spent = self._longest = 0.0
        self._previous: Basis | None = None
        self._stable = 0
        self._tried: Basis | None = None
        self._unfinished: tuple[int, Iterator[BasicSolution]] | None = None

    def is_stable(self, basis: Basis) -> bool:
        """Whether the states, with this newest version, have been nearly unchanged for STABLE_ITERATES iterates."""
        previous, self._previous = self._previous, basis
        near = previous is not None and basis.changes(previous) <= MAX_CHANGE * self._problem.n
        self._stable = self._stable + 1 if near else 0
        return self._stable >= STABLE_ITERATES

    def is_due(self, iterated: float, basis: Basis) -> bool:
        """Whether there is time for two steps, and the states differ from the last attempt's or that one ran out of
        time."""
        if self._spent + 2 * self._longest > iterated:
            return False
        return self._unfinished is not None or self._is_new(basis)

    def _is_new(self, basis: Basis) -> bool:
        return self._tried is None or basis.changes(self._tried) > 0

    def attempt(self, basis: Basis, budget: float, evaluations: int) -> Iterate | None:
        """Pivot from these states while violations decrease and the budget, in seconds for all attempts, lasts."""
        if self._unfinished is not None and not self._is_new(basis):
            fewest, pivoting = self._unfinished
        else:
            self._tried = basis
            fewest, pivoting = self._problem.n + 1, self._solutions.exchanging(basis)
        self._unfinished = None
        while True:
            began = self._clock()
            found = _next(pivoting)
            seconds = self._clock() - began
            self._spent += seconds
            self._longest = max(seconds, self._longest)
            if found is None:
                return None
            evaluations += 1
            found.wrong[:] = self._solutions.violated(found)
            violations = int(np.count_nonzero(found.wrong))
            if not violations:
                x = self._problem.box.x_within(found.z, found.w, found.basis)
                return Iterate(x, None, STEP, evaluations)
            if violations >= fewest:
                return None
            fewest = violations
            if self._spent + seconds > budget:
                self._unfinished = fewest, pivoting
                return None


def _next(pivoting: Iterator[BasicSolution]) -> BasicSolution | None:
    """The next basic solution; None if there is none, or its w overflows."""
    with np.errstate(over="ignore", invalid="ignore"), suppress(SingularMatrix):
        found = next(pivoting)
        return found if is_finite(found.w) else None
    return None
