"""Active-set finishing: from an iterate near the solution to the solution itself, exact up to rounding.

The set P = {i : x_i > 0} of an iterate has a basic solution: M_PP z_P = -q_P, w_N = M_NP z_P + q_N, z_N = 0, w_P = 0.
If it is nonnegative it solves the LCP. If not, and only a few signs are violated, a few steps of block principal
pivoting correct it: M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its
Applications 21 (1978) 207-215.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from lcpcli.linalg import factors, products
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.principal import PrincipalSolver
from lcpcli.methods.iterate import Finished, Iterate, Stage, advance
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

STEP = "finish"
STABLE_ITERATES = 2  # consecutive iterates with nearly unchanged P before an attempt
MAX_CHANGE = 0.004  # of n: the change of P per iterate up to which it counts as nearly unchanged


def finish(problem: Problem, x0: Vector | None, stage: Stage, clock: Callable[[], float] = time.perf_counter) -> Stage:
    """Pass on the iterates of a stage, and end with the solution as soon as their active set yields it.

    An attempt is made when P is nearly unchanged for STABLE_ITERATES iterates, and when the stage ends; it continues
    pivoting while the number of violations decreases. All attempts together take no longer than the iterations so far,
    as far as earlier pivoting steps predict; only the attempt at the end of the stage has no time limit.

    x0 : the start of the stage, whose active set counts too; None if it has none.

    Yields
    ------
    Iterate : those of the stage; finally, if an attempt succeeds, the basic solution, with step "finish". There x is
        (z - w) / 2, and no sign is violated beyond rounding, eps (|M| z + |q|)_i in row i.

    Returns
    -------
    Finished if an attempt succeeded, else how the stage ended.
    """
    finisher, iterated = _Finisher(problem, clock), 0.0
    last = None if x0 is None else Iterate(x0, None, "", 0)
    if last is not None:
        finisher.is_stable(last.x > 0)
    while True:
        began = clock()
        step = advance(stage)
        iterated += clock() - began
        if isinstance(step, Iterate):
            yield step
            last, budget, ready = step, iterated, finisher.is_stable(step.x > 0)
        else:
            budget, ready = np.inf, last is not None
        if ready and last is not None and finisher.is_due(budget, last.x > 0):
            finished = finisher.attempt(last.x, budget, last.evaluations)
            if finished is not None:
                yield finished
                return Finished()
        if not isinstance(step, Iterate):
            return step


class _Finisher:
    """The attempts and the time that they have taken."""

    def __init__(self, problem: Problem, clock: Callable[[], float]) -> None:
        self._problem, self._clock = problem, clock
        self._solver: PrincipalSolver | None = None
        self._row_sizes = np.empty(0)
        self._spent = self._longest = 0.0
        self._previous, self._stable = np.zeros(0, dtype=bool), 0
        self._tried: Mask | None = None
        self._unfinished: tuple[int, Mask] | None = None

    def is_stable(self, active: Mask) -> bool:
        """Whether P, with this newest version, has been nearly unchanged for STABLE_ITERATES iterates."""
        previous, self._previous = self._previous, active
        near = previous.size > 0 and np.count_nonzero(active != previous) <= MAX_CHANGE * active.size
        self._stable = self._stable + 1 if near else 0
        return self._stable >= STABLE_ITERATES

    def is_due(self, iterated: float, active: Mask) -> bool:
        """Whether there is time for two steps, and P differs from the last attempt's or that one ran out of time."""
        if self._spent + 2 * self._longest > iterated:
            return False
        return self._unfinished is not None or self._is_new(active)

    def _is_new(self, active: Mask) -> bool:
        return self._tried is None or not np.array_equal(active, self._tried)

    def attempt(self, x: Vector, budget: float, evaluations: int) -> Iterate | None:
        """Pivot from the signs of x while violations decrease and the budget, in seconds for all attempts, lasts."""
        active, fewest = x > 0, self._problem.n + 1
        if self._unfinished is not None and not self._is_new(active):
            fewest, active = self._unfinished
        else:
            self._tried = active
        self._unfinished = None
        while True:
            began = self._clock()
            solved = self._basic_solution(active)
            seconds = self._clock() - began
            self._spent += seconds
            self._longest = max(seconds, self._longest)
            if solved is None:
                return None
            x, violated = solved
            evaluations += 1
            violations = int(np.count_nonzero(violated))
            if violations == 0:
                return Iterate(x, None, STEP, evaluations)
            if violations >= fewest:
                return None
            fewest, active = violations, active ^ violated
            if self._spent + seconds > budget:
                self._unfinished = fewest, active
                return None

    def _basic_solution(self, active: Mask) -> tuple[Vector, Mask] | None:
        """x of the basic solution of P and where its signs are violated beyond rounding; None if there is none."""
        M, q = self._problem.M, self._problem.q
        if self._solver is None:
            self._solver = PrincipalSolver(M)
            self._row_sizes = self._problem.row_maxima
        indices = np.flatnonzero(active)
        z = np.zeros(q.size)
        try:
            z[indices] = self._solver.solve(indices, -q[indices])
        except factors.SingularMatrix:
            return None
        with np.errstate(over="ignore", invalid="ignore"):
            w = self._problem.w(z)
            rounding = ROW_ROUNDING * (products.absolute_product(M, np.abs(z)) + np.abs(q))
            values = np.where(active, z * self._row_sizes, w)
        if not np.isfinite(rounding).all():
            return None
        violated: Mask = values < -rounding
        x: Vector = 0.5 * np.where(active, z, -w)
        x[(values < 0) & ~violated] = 0.0
        return x, violated
