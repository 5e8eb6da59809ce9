"""Active-set finishing: from an iterate that is nearly right to the solution, exact but for rounding.

The set P = {i : x_i > 0} of an iterate has a basic solution: M_PP z_P = -q_P, w_N = M_NP z_P + q_N, z_N = 0, w_P = 0.
If it is nonnegative it solves the LCP. If not, and only few signs are wrong, a few steps of block principal pivoting
mend it: M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its
Applications 21 (1978) 207-215.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from lcpcli.linalg import factors, matrices, products
from lcpcli.linalg.principal import PrincipalSolver
from lcpcli.methods.iterate import Breakdown, Iterate, Stalled
from lcpcli.model.problem import Problem
from lcpcli.typing import Mask, Vector

STEP = "finish"
STEADY = 2  # iterates in a row between which P has nearly stayed the same, before a try
NEARLY = 0.004  # of n: by how much P may have changed from one to the next
ROUNDING = 8 * float(np.finfo(np.float64).eps)


def finish(
    problem: Problem, iterates: Iterator[Iterate], clock: Callable[[], float] = time.perf_counter
) -> Iterator[Iterate]:
    """Pass the iterates of a method on, and end with the solution as soon as their active set leads to it.

    A try is made when P has nearly stayed the same for STEADY iterates, and when the method ends; it goes on pivoting
    while the number of wrong signs falls. All tries together take no longer than the method has iterated so far, as far
    as the time of the last factorization lets it be foreseen; only the last try, when the method has ended, is free.

    Yields
    ------
    Iterate : those of `iterates`; last, where a try succeeds, the basic solution, with step "finish". There x is
        (z - w) / 2, and every sign is right but for rounding, eps (|M| z + |q|)_i in row i.

    Raises
    ------
    Breakdown, Stalled : as the method does, after a last try that has failed.
    """
    finisher, iterated = _Finisher(problem, clock), 0.0
    last: Iterate | None = None
    while True:
        began = clock()
        iterate, ending = _next(iterates)
        iterated += clock() - began
        if iterate is not None:
            yield iterate
            last, budget, ready = iterate, iterated, finisher.is_steady(iterate.x > 0)
        else:
            budget, ready = np.inf, last is not None
        if ready and last is not None and finisher.is_due(budget, last.x > 0):
            finished = finisher.attempt(last.x, budget, last.evaluations)
            if finished is not None:
                yield finished
                return
        if ending is not None:
            raise ending
        if iterate is None:
            return


def _next(iterates: Iterator[Iterate]) -> tuple[Iterate | None, Breakdown | Stalled | None]:
    """The next iterate, or None and what the method has raised, if anything."""
    try:
        return next(iterates, None), None
    except (Breakdown, Stalled) as ending:
        return None, ending


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

    def is_steady(self, inside: Mask) -> bool:
        """Whether P, of which this is the newest, has nearly stayed the same for STEADY iterates."""
        before, self._seen = self._seen, inside
        near = before.size > 0 and np.count_nonzero(inside != before) <= NEARLY * inside.size
        self._steady = self._steady + 1 if near else 0
        return self._steady >= STEADY

    def is_due(self, iterated: float, inside: Mask) -> bool:
        """Whether there is time for two steps, and P not that of the last try, unless time was all that it lacked."""
        if self._spent + 2 * self._longest > iterated:
            return False
        return self._unfinished is not None or self._is_new(inside)

    def _is_new(self, inside: Mask) -> bool:
        return self._tried is None or not np.array_equal(inside, self._tried)

    def attempt(self, x: Vector, budget: float, evaluations: int) -> Iterate | None:
        """Pivot from the signs of x while fewer become wrong and the budget, in seconds of all tries, lasts."""
        inside, fewest = x > 0, self._problem.n + 1
        if self._unfinished is not None and not self._is_new(inside):
            fewest, inside = self._unfinished
        else:
            self._tried = inside
        self._unfinished = None
        while True:
            began = self._clock()
            solved = self._basic_solution(inside)
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
            fewest, inside = number, inside ^ wrong
            if self._spent + seconds > budget:
                self._unfinished = fewest, inside
                return None

    def _basic_solution(self, inside: Mask) -> tuple[Vector, Mask] | None:
        """x of the basic solution of P and where its signs are wrong beyond rounding; None where it has none."""
        M, q = self._problem.M, self._problem.q
        if self._solver is None:
            self._solver = PrincipalSolver(M)
            ones = np.ones(q.size)
            self._row_sizes = matrices.row_and_column_maxima(M, ones, ones)[0]
        indices = np.flatnonzero(inside)
        z = np.zeros(q.size)
        try:
            z[indices] = self._solver.solve(indices, -q[indices])
        except factors.SingularMatrix:
            return None
        with np.errstate(over="ignore", invalid="ignore"):
            w = self._problem.w(z)
            rounding = ROUNDING * (products.absolute_product(M, np.abs(z)) + np.abs(q))
            values = np.where(inside, z * self._row_sizes, w)
        if not np.isfinite(rounding).all():
            return None
        wrong: Mask = values < -rounding
        x: Vector = 0.5 * np.where(inside, z, -w)
        x[(values < 0) & ~wrong] = 0.0
        return x, wrong
