"""An infeasible interior point method for mixed problems with M + M' positive semidefinite.

It keeps z inside its bounds by slacks s and multipliers w > 0 and drives s w and the residuals to 0: M. Kojima,
N. Megiddo, T. Noma, A. Yoshise, A Unified Approach to Interior Point Algorithms for Linear Complementarity Problems,
Springer (1991); with Mehrotra's and Gondzio's steps (`steps`), regularized factors (`systems`), and the basic solution
of its active set at the end (`finishing`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.shifted_systems import SuperLU, systems
from lcpcli.methods.interior.finishing import basic_solutions
from lcpcli.methods.interior.rays import proof_of
from lcpcli.methods.interior.scaling import Scaled, scaled
from lcpcli.methods.interior.steps import Point, Steps
from lcpcli.methods.interior.systems import AccurateSystems, Regularization
from lcpcli.methods.iterate import Breakdown, Ending, Iterate, NoSolution, Stage, Stalled
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

FINISH = "finish"
MOST = 150  # steps of an attempt
WARMED_UP, RECENT, SLOW = 8, 7, 0.4  # after so many steps, a mean length of the recent ones below that is too short
PATIENCE, NEAR, IMPATIENT = 25, 1e-8, 12  # steps without progress; below that merit, fewer
CLOSE, DROP = 1e-5, 1e-2  # the merit from which the active set is tried, and the drop after which it is again
CONVERGED, VANISHED = 1e-13, 1e-30
EVERY = 5  # steps between searches for a proof that there is no solution


@dataclass(frozen=True)
class Attempt:
    """One run: the least slack of its start, and the range of the regularization.

    gives_up : whether it ends when its steps stay short. pivots : whether factors are by partial pivoting.
    """

    slack: float
    rho: tuple[float, float, float] = (1e-8, 1e-13, 1e-7)
    gives_up: bool = False
    pivots: bool = False


ATTEMPTS = (
    Attempt(1.0, gives_up=True),
    Attempt(1e4, rho=(1e-11, 1e-14, 1e-7)),
    Attempt(1e2),
    Attempt(1.0, rho=(1e-8, 1e-8, 1e-8)),
    Attempt(1.0, rho=(1e-12, 1e-12, 1e-12), pivots=True),
)


def interior(
    problem: Problem,
    x0: Vector,  # noqa: ARG001 (every method has it)
    *,
    start_slack: float | None = None,
    regularization: float | None = None,
) -> Stage:
    """Follow the central path from one start after another until the solution, or a proof that there is none, is found.

    It solves every problem whose M + M' is positive semidefinite, up to rounding, in some tens of steps, each with one
    factorization of M + D, D a positive diagonal. For other M it may stall.

    Parameters
    ----------
    problem : the LCP or mixed problem, n unknowns, M dense or sparse.
    x0 : not used.
    start_slack : the least slack and multiplier at the start, in scaled units; by default 1, then 1e4, 1e2 and 1.
    regularization : rho, added to the diagonal of the factors; by default adapted between 1e-14 and 1e-7.

    Yields
    ------
    Iterate : the complementary points nearest to z and w, with mu, the step length and rho as step; and the basic
        solutions of active sets, with step "finish".

    Returns
    -------
    NoSolution with Farkas' y, from a diverging z; Breakdown or Stalled if no attempt comes to the solution.
    """
    within = scaled(problem)
    if not within.kept.size:
        z = within.given(np.zeros(0))
        yield _iterate(problem, z, FINISH, 0)
        return Stalled("all variables are fixed")
    run = _Run(problem, within)
    ending: Ending = Breakdown("no factorization succeeded")
    for attempt in ATTEMPTS:
        slack = attempt.slack if start_slack is None else start_slack
        rho = attempt.rho if regularization is None else 3 * (regularization,)
        ending = yield from run.attempt(Attempt(slack, rho, attempt.gives_up and start_slack is None, attempt.pivots))
        if isinstance(ending, NoSolution):
            break
    return ending


class _Run:
    """The attempts on one problem."""

    def __init__(self, problem: Problem, within: Scaled) -> None:
        self._given, self._within, self._count = problem, within, 0

    def attempt(self, attempt: Attempt) -> Stage:
        within = self._within
        try:
            factors = SuperLU(within.M, pivoting=True) if attempt.pivots else systems(within.M, within.S)
            accurate = AccurateSystems(within.M, factors, Regularization(*attempt.rho))
            steps = Steps(within, accurate)
            return (yield from self._steps(attempt, steps, accurate))
        except SingularMatrix:
            return Breakdown("a factorization failed")

    def _steps(self, attempt: Attempt, steps: Steps, accurate: AccurateSystems) -> Stage:
        at = steps.start(attempt.slack)
        best, least, waited, tried = at, np.inf, 0, np.inf
        lengths: list[float] = []
        for k in range(MOST):
            mu = steps.mu(at)
            merit = max(self._within.pairs * mu / steps.gap_size(at), steps.infeasibility(at))
            waited = 0 if merit < 0.9 * least else waited + 1
            if merit < least:
                best, least = at, merit
            if merit < CLOSE and merit < DROP * tried:
                tried = merit
                yield from self._finish(at)
            too_short = attempt.gives_up and k >= WARMED_UP and np.mean(lengths[-RECENT:]) < SLOW
            if merit <= CONVERGED or mu < VANISHED or too_short or waited > (PATIENCE if least > NEAR else IMPATIENT):
                break
            at, length, along = steps.next(at)
            lengths.append(length)
            self._count += 1
            told = f"mu {steps.mu(at):.0e}, {length:.2f}, rho {accurate.regularization.rho:.0e}"
            yield self._shown(at.z, told)
            if k % EVERY == EVERY - 1 and (proof := proof_of(self._given, self._within, (at.z, along.z))):
                return NoSolution(proof)
        if proof := proof_of(self._given, self._within, (at.z,)):
            return NoSolution(proof)
        yield from self._finish(best)
        return Stalled("its steps no longer reduce the residual")

    def _finish(self, at: Point) -> Iterator[Iterate]:
        for z, _, _ in basic_solutions(self._within, at):
            self._count += 1
            yield self._shown(z, FINISH)

    def _shown(self, z: Vector, step: str) -> Iterate:
        return _iterate(self._given, self._within.given(z), step, self._count)


def _iterate(problem: Problem, z: Vector, step: str, evaluations: int) -> Iterate:
    return Iterate(problem.box.x_of(z, problem.w(z)), None, step, evaluations)
