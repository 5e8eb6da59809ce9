"""Active-set finishing: from an iterate that is nearly right to the solution, exact but for rounding.

The set P = {i : x_i > 0} of an iterate has a basic solution: M_PP z_P = -q_P, w_N = M_NP z_P + q_N, z_N = 0, w_P = 0.
If it is nonnegative it solves the LCP. If not, and only few signs are wrong, a few steps of block principal pivoting
mend it: M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its
Applications 21 (1978) 207-215.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from lcpcli.linalg import factors, matrices, products
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.principal import PrincipalSolver
from lcpcli.methods.iterate import Finished, Iterate, Stage, advance
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

STEP = "finish"
STEADY = 2  # iterates in a row between which P has nearly stayed the same, before a try
NEARLY = 0.004  # of n: by how much P may have changed from one to the next


def finish(problem: Problem, x0: Vector | None, stage: Stage, clock: Callable[[], float] = time.perf_counter) -> Stage:
    """Pass the iterates of a stage on, and end with the solution as soon as their active set leads to it.

    A try is made when P has nearly stayed the same for STEADY iterates, and when the stage ends; it goes on pivoting
    while the number of wrong signs falls. All tries together take no longer than the stage has iterated so far, as far
    as the time of the last factorization lets it be foreseen; only the last try, when the stage has ended, is free.

    x0 : the start of the stage, whose active set counts too; None where it has none.

    Yields
    ------
    Iterate : those of the stage; last, where a try succeeds, the basic solution, with step "finish". There x is
        (z - w) / 2, and every sign is right but for rounding, eps (|M| z + |q|)_i in row i.

    Returns
    -------
    Finished where a try has succeeded, else how the stage has ended.
    """
    finisher, iterated = _Finisher(problem, clock), 0.0
    last = None if x0 is None else Iterate(x0, None, "", 0)
    if last is not None:
        finisher.is_steady(last.x > 0)
    while True:
        began = clock()
        step = advance(stage)
        iterated += clock() - began
        if isinstance(step, Iterate):
            yield step
            last, budget, ready = step, iterated, finisher.is_steady(step.x > 0)
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
    """The tries, with the time that they have taken."""

    def __init__(self, problem: Problem, clock: Callable[[], float]) -> None:
        self._problem, self._clock = problem, clock
        self._solver: PrincipalSolver | None = None
        self._row_sizes = np.empty(0)
        self._spent = self._longest = 0.0
        self._seen, self._steady = np.zeros(0, dtype=bool), 0
        self._tried: Mask | None = None
        self._unfinished: tuple[int, Mask] | None = None

    def is_steady(self, active: Mask) -> bool:
        """Whether P, of which this is the newest, has nearly stayed the same for STEADY iterates."""
        before, self._seen = self._seen, active
        near = before.size > 0 and np.count_nonzero(active != before) <= NEARLY * active.size
        self._steady = self._steady + 1 if near else 0
        return self._steady >= STEADY

    def is_due(self, iterated: float, active: Mask) -> bool:
        """Whether there is time for two steps, and P not that of the last try, unless time was all that it lacked."""
        if self._spent + 2 * self._longest > iterated:
            return False
        return self._unfinished is not None or self._is_new(active)

    def _is_new(self, active: Mask) -> bool:
        return self._tried is None or not np.array_equal(active, self._tried)

    def attempt(self, x: Vector, budget: float, evaluations: int) -> Iterate | None:
        """Pivot from the signs of x while fewer become wrong and the budget, in seconds of all tries, lasts."""
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
            x, wrong = solved
            evaluations += 1
            number = int(np.count_nonzero(wrong))
            if number == 0:
                return Iterate(x, None, STEP, evaluations)
            if number >= fewest:
                return None
            fewest, active = number, active ^ wrong
            if self._spent + seconds > budget:
                self._unfinished = fewest, active
                return None

    def _basic_solution(self, active: Mask) -> tuple[Vector, Mask] | None:
        """x of the basic solution of P and where its signs are wrong beyond rounding; None where it has none."""
        M, q = self._problem.M, self._problem.q
        if self._solver is None:
            self._solver = PrincipalSolver(M)
            ones = np.ones(q.size)
            self._row_sizes = matrices.row_and_column_maxima(M, ones, ones)[0]
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
        wrong: Mask = values < -rounding
        x: Vector = 0.5 * np.where(active, z, -w)
        x[(values < 0) & ~wrong] = 0.0
        return x, wrong
