"""Generalized Newton on F(x) = 0, which is block principal pivoting, with a safeguard that makes it finite.

Where x has no zero, F is linear, and the Newton step from x leads to the basic solution of the complementary set
P = {i : x_i > 0}: M_PP z_P = -q_P, w_P = 0, z_N = 0, w_N = M_NP z_P + q_N. Indices of negative entries are exchanged.
With bounds, a basic variable goes to the bound that it violates, and one whose w has the wrong sign becomes basic.
M. M. Kostreva, Block pivot methods for solving the complementarity problem, Linear Algebra and its Applications 21
(1978) 207-215. The safeguard: J. J. Júdice and F. M. Pires, A block principal pivoting algorithm for large-scale
strictly monotone linear complementarity problems, Computers and Operations Research 21 (1994) 587-596, after
K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem, Opsearch 11 (1974) 123-130.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress

import numpy as np

from lcpcli.clock import seconds
from lcpcli.linalg import factors
from lcpcli.linalg.doubles import is_finite
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_narrow, is_sparse
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled, Turns, advance
from lcpcli.model.box import Basis
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector
from lcpcli.verify.basic_solution import BasicSolution, BasicSolutions

LEAST_INDEX = "least index"
PATIENCE = 10  # block steps without a new minimum of infeasible indices, before single exchanges
FAST = 0.5  # of the violations: what a fast step from given states leaves at most
SLOW, SLOW_NARROW = 2, 12  # other steps after which they are not nearly right; one costs little if the band is narrow


def newton(problem: Problem, x0: Vector) -> Stage:
    """Exchange all indices whose z or w is negative; after PATIENCE steps without a new minimum, only the least one.

    Ends at the solution after finitely many steps for every P-matrix M and every q, in practice after a handful. For
    other matrices it may meet a singular M_PP or cycle. An iteration costs one factorization of M_PP and one product
    with M.

    Parameters
    ----------
    problem : the LCP, n unknowns.
    x0 : starting point, shape (n,); only its signs matter.

    Yields
    ------
    Iterate : x = (z - w) / 2 of the basic solutions, with step "block" or "least index".

    Returns
    -------
    Finished, or Breakdown : M_PP is singular.
    """
    return block_pivoting(problem, x0, math.inf)


def block_pivoting(problem: Problem, x0: Vector, patience: float) -> Stage:
    """The same, stalled after so many exchanges of least indices: block steps advance, these may take 2^n."""
    fewest, waiting, step = problem.n + 1, PATIENCE, "block"
    pivoting = BasicSolutions(problem).exchanging(problem.box.basis_of(x0))
    try:
        for evaluations, found in enumerate(pivoting, 1):
            yield Iterate(found.x, None, step, evaluations, signs_final=found.is_solution)
            infeasible = found.wrong.nonzero()[0]
            if not infeasible.size:
                break
            if infeasible.size < fewest:
                fewest, waiting, step = infeasible.size, PATIENCE, "block"
            elif waiting > 1:
                waiting -= 1
            elif patience > 0:
                patience, step = patience - 1, LEAST_INDEX
            else:
                return Stalled("the least-index steps were not enough")
            if step == LEAST_INDEX:
                found.wrong[infeasible[1:]] = False
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Finished()


def from_states(problem: Problem, x0: Vector) -> Stage:
    """Block pivoting from states that are nearly right, while most steps leave at most FAST of the violations.

    The states of a solution take one factorization, even where many components are 0 but for rounding.

    Returns
    -------
    Finished : no sign is violated beyond rounding. Stalled, or Breakdown : the states are not nearly right.
    """
    solutions, before = BasicSolutions(problem), problem.n
    slow = SLOW_NARROW if is_sparse(problem.M) and is_narrow(problem.M) else SLOW
    try:
        for evaluations, found in enumerate(solutions.exchanging(problem.box.basis_of(x0)), 1):
            found.wrong[:] = solutions.violated(found)
            violations = int(np.count_nonzero(found.wrong))
            if not violations:
                yield Iterate(problem.box.x_within(found.z, found.w, found.basis), None, "block", evaluations)
                return Finished()
            yield Iterate(found.x, None, "block", evaluations, signs_final=False)
            slow, before = slow - (violations > FAST * before), violations
            if not slow:
                break
    except SingularMatrix as error:
        return Breakdown(str(error))
    return Stalled("the given basis is not nearly right")


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


LEAST_INDEX_STEPS = 60  # of newton: block steps advance, these may take 2^n
BLOCK = 4  # gradient steps between two looks at the active set
SETTLED, OF_MANY = 4, 500  # indices, or one of so many, that change in that many steps when pivoting takes over
GROWTH = 1e6  # of |D^-1 w|^2 over its start: the iteration diverges
MOST_STEPS = 40  # no more products than a few factorizations cost


def dense_route(problem: Problem, x0: Vector) -> Stage:
    """Newton from x0, or from the reference point, the origin of an LCP, with its own w; for large n from the active
    set at which projected gradients arrive.

    A product with M costs a small part of a factorization, and a few dozen of them correct most of the signs that
    block pivoting would take several factorizations for, if M is a well-conditioned P-matrix.
    """
    start = x0 if np.count_nonzero(x0) else _reference(problem)
    if problem.n > factors.SMALL:
        return _after_gradients(problem, x0, start)
    return block_pivoting(problem, start, LEAST_INDEX_STEPS)


def _after_gradients(problem: Problem, x0: Vector, start: Vector) -> Stage:
    turns = Turns(x0)
    ending = yield from turns.take("gradient", projected_gradient(problem, x0))
    if not isinstance(ending, Breakdown):
        start = turns.last.x
    return (yield from turns.take("newton", block_pivoting(problem, start, LEAST_INDEX_STEPS)))


def projected_gradient(problem: Problem, x0: Vector) -> Stage:
    """z' = mid(l, u, z - t D^-1 (M z + q)) with D = diag(M) and Barzilai and Borwein's step sizes t in turn.

    Parameters
    ----------
    problem : the LCP, n unknowns, M dense.
    x0 : starting point, shape (n,).

    Yields
    ------
    Iterate : every BLOCK steps, x = (z - D^-1 w) / 2, which stands for the states that are likely.

    Returns
    -------
    Finished : the active set has settled. Stalled : it has not in MOST_STEPS. Breakdown : a diagonal entry of M is not
        positive, or the iteration diverges.
    """
    box, diagonal = problem.box, problem.M.diagonal()
    if not diagonal.min() > 0:
        return Breakdown("a diagonal entry of M is not positive")
    inverse = 1 / diagonal
    z = box.z_of(x0)
    gradient = (problem.w(z) if np.count_nonzero(problem.from_reference(z)) else problem.q_ref) * inverse
    first = gradient.dot(gradient)
    basis, t = box.basis_of(0.5 * (z - gradient)), 0.5
    for step in range(1, MOST_STEPS + 1):
        previous, former = z, gradient
        z = box.project(z - t * gradient)
        gradient = problem.w(z)
        gradient *= inverse
        change, difference = z - previous, gradient - former
        weighted = diagonal * difference
        along = change.dot(weighted)
        if along > 0:
            t = change.dot(diagonal * change) / along if step % 2 else along / difference.dot(weighted)
        if step % BLOCK:
            continue
        before, basis = basis, box.basis_of(0.5 * (z - gradient))
        yield Iterate(0.5 * np.where(basis.basic, z, box.nonbasic(basis) - gradient), None, "", step + 1, "", False)
        if not gradient.dot(gradient) <= GROWTH * first:
            return Breakdown("the projected gradient iteration diverges")
        if basis.changes(before) <= max(SETTLED, z.size // OF_MANY):
            return Finished()
    return Stalled(f"the active set has not settled in {MOST_STEPS} steps")


def _reference(problem: Problem) -> Vector:
    """The x = (z - w) / 2 of the reference point."""
    return -problem.q / 2 if problem.reference_z is None else (problem.reference_z - problem.q_ref) / 2
