"""An infeasible interior point method for mixed problems with M + M' positive
semidefinite.

It keeps z inside its bounds by slacks s and multipliers w > 0 and drives s w and the
residuals to 0: M. Kojima, N. Megiddo, T. Noma, A. Yoshise, A Unified Approach to
Interior Point Algorithms for Linear Complementarity Problems, Springer (1991); with
Mehrotra's and Gondzio's steps, regularized factors, and finally the basic solution of
its active set, also where that basis is singular: the basic variables solve M_BB z_B =
-(q + M z_N)_B by a proximal iteration, (M_BB + eps) dz = -w_B, which converges to the
solution closest to the interior point if there are several.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from typing import NamedTuple

import numpy as np

from lcpcli.basis.exchanges import BasicSolution, block_principal_pivoting
from lcpcli.errors import ProblemError
from lcpcli.linalg.doubles import EPS, ROUNDING, largest
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse, multiplier, plus_diagonal, principal
from lcpcli.linalg.shifted_systems import systems
from lcpcli.methods.definite import definite
from lcpcli.methods.direct import MAX_AS_DENSE
from lcpcli.methods.interior_steps import (
    PredictorCorrector,
    PrimalDualPoint,
    RefinedShiftedSolver,
    proof_of,
    slack_form,
)
from lcpcli.methods.stages import (
    Breakdown,
    Ending,
    Finished,
    GivenUp,
    Iterate,
    MethodSequence,
    NoSolution,
    RecordedStages,
    Stage,
    Stalled,
)
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Vector

FINISH, BEST = "finish", "best"
MAX_INTERIOR_STEPS = 150  # of an attempt: a few times the tens that it usually takes
WARM_UP_STEPS = 8  # after which an attempt with short steps may be abandoned
# It is abandoned if the mean length of the last RECENT_STEPS steps is below
# SLOW_LENGTH.
RECENT_STEPS, SLOW_LENGTH = 7, 0.4
# Steps without progress after which an attempt stops: fewer below NEAR_MERIT.
PATIENT_STEPS, IMPATIENT_STEPS = 25, 10
NEAR_MERIT = 1e-8  # relative: the accuracy at which rounding may prevent progress
CLOSE_MERIT = 1e-5  # relative: the accuracy at which the active set is first tested
# The factor by which the merit has to fall before the active set is tested again.
MERIT_DROP = 1e-2
# mu at which signs are final, and at which an attempt stops. Where z_i and w_i are both
# 0, they are as large as the root of mu.
SMALL_MU, VANISHED_MU = 1e-24, 1e-30
# Steps between searches for a proof that there is no solution: one costs less than a
# step.
PROOF_EVERY = 5
# eps of the proximal iteration: with 1e-8, rounding makes a pivot 0 in one of four
# programs.
PROXIMAL_SHIFT = 3e-8
# eps where factors fail, and first from a point that is close to a solution.
LARGER_SHIFT = 1e-6
# Proximal steps at most; the iteration stops if w_B falls by less than this factor.
PROXIMAL_STEPS, SLOW_PROXIMAL = 15, 0.7
MIN_STEPS = 2  # at least, so that rows with small terms are solved as accurately
EXCHANGE_ROUNDS = 5  # block pivots: an almost right active set needs one or two
# Block pivots from a starting point: more of them cost a large part of a run without
# it.
START_ROUNDS = 2
# Pivoting stops at a natural residual above WORSE_FACTOR times the smallest one so far,
# and above FAR_RESIDUAL.
WORSE_FACTOR, FAR_RESIDUAL = 1e2, 1e-1
# In scaled variables: the largest residual that is rounding, and the largest
# infeasibility that may be.
EXACT_RESIDUAL, WRONG_SIGN = 1e-13, 1e-12
# In scaled variables: the largest residual that a basic solution need not reduce.
SOLVED_RESIDUAL = 100 * EPS


@dataclass(frozen=True)
class InteriorAttempt:
    """The settings of one attempt.

    slack, rho : factors of the smallest slack at the start, and of the regularization:
        of the first, the smallest and the largest one.
    shift : eps, in scaled variables; with M + eps I there is one solution, close to the
        smallest one for M if eps is small: Tikhonov's regularization, as in F.
        Facchinei, J.-S. Pang, Finite-Dimensional Variational Inequalities and
        Complementarity Problems (2003), section 12.2.
    gives_up : whether the attempt stops if its steps remain short.
    """

    slack: float
    rho: tuple[float, float, float] = (1.0, 1e-5, 1e1)
    shift: float = 0.0
    gives_up: bool = False


class PathStep(NamedTuple):
    """The quantities of a step along the central path. mu : the mean product of slacks
    and multipliers after it. length : the fraction of the full step that was taken. rho
    : what is added to the diagonal of the factors."""

    mu: float
    length: float
    rho: float


FIRST_ATTEMPTS = (
    InteriorAttempt(1.0, gives_up=True),
    InteriorAttempt(1.0, shift=1e-6, gives_up=True),
)
FURTHER_ATTEMPTS = (
    InteriorAttempt(1e4, (1e-3, 1e-6, 1e1)),
    InteriorAttempt(1e2),
    InteriorAttempt(1.0, (1.0, 1.0, 1.0)),
)


def interior(
    problem: Problem,
    x0: Vector,  # noqa: ARG001
    *,
    start_slack: float = 1.0,
    regularization: float = 1e-8,
) -> Stage:
    """Follow the central path from one start after another up to the solution, or to a
    proof that there is none.

    It is meant for M + M' positive semidefinite and then takes some tens of steps, each
    with one factorization of M + D, D a positive diagonal. For other M, and where
    rounding is too large for it, it may stall. A sparse M that is positive definite has
    steps in twice the precision, without a regularization (`methods.definite`): it may
    be stiff.

    Yields the complementary points closest to z and w, with mu, the step length and rho
    as step; and the basic solutions of active sets, with step "finish". NoSolution with
    a Farkas vector y, from a diverging z; Breakdown or Stalled if no attempt reaches
    the solution.
    """
    sequence = MethodSequence(np.zeros(problem.n))
    if is_sparse(problem.M) and problem.M.diagonal().min(initial=1.0) > 0:
        ending = yield from sequence.run_stage("", definite(problem, start_slack))
        if isinstance(ending, Finished):
            return ending
    stage = all_attempts(problem, start_slack, regularization)
    return (yield from sequence.run_stage("", stage))


def of_stiff(problem: Problem) -> Stage:
    """Do what `interior` does for an M that is positive definite up to rounding; if
    that fails, no other method does better on a large problem, and all take long."""
    sequence = MethodSequence(np.zeros(problem.n))
    first = yield from sequence.run_stage("", definite(problem))
    if isinstance(first, Finished):
        return first
    ending = yield from sequence.run_stage("", all_attempts(problem))
    is_large = problem.n > MAX_AS_DENSE
    if is_large and isinstance(ending, Stalled | Breakdown):
        return GivenUp(getattr(first, "reason", ""))
    return ending


def attempts(
    problem: Problem,
    settings: Sequence[InteriorAttempt],
    start_slack: float = 1.0,
    regularization: float = 1e-8,
    by_units: bool = False,
) -> Stage:
    """Make some of the attempts of `interior`, as it does. by_units : whether M is
    scaled by the units of rows and columns."""
    try:
        run = Run(problem, by_units)
    except ProblemError:
        return Breakdown("numbers overflow in the scaled problem")
    return (yield from run.attempts(settings, start_slack, regularization))


def _in_turn(
    problem: Problem,
    parts: Iterable[tuple[Sequence[InteriorAttempt], bool]],
    start_slack: float,
    regularization: float,
) -> Stage:
    """Make attempts, each part scaled by units or not, up to a proof that there is no
    solution."""
    sequence = MethodSequence(np.zeros(problem.n), faults=())
    ending: Ending = Breakdown("no attempt was made")
    for settings, by_units in parts:
        stage = attempts(problem, settings, start_slack, regularization, by_units)
        ending = yield from sequence.run_stage("", stage)
        if isinstance(ending, NoSolution):
            break
    return ending


def _further_parts(
    problem: Problem,
) -> Iterator[tuple[Sequence[InteriorAttempt], bool]]:
    """Generate what follows FIRST_ATTEMPTS: the same scaled by units, which solves most
    programs with rows in units that differ by factors of 1e4 and more, on which all
    others stall; and other attempts."""
    # The rows of a symmetric M are in the units of its columns.
    if problem.signs is None or (problem.signs < 0).any():
        yield FIRST_ATTEMPTS, True
    yield FURTHER_ATTEMPTS, False


def further_attempts(
    problem: Problem, start_slack: float = 1.0, regularization: float = 1e-8
) -> Stage:
    """Make the attempts after those of FIRST_ATTEMPTS."""
    return _in_turn(problem, _further_parts(problem), start_slack, regularization)


def all_attempts(
    problem: Problem, start_slack: float = 1.0, regularization: float = 1e-8
) -> Stage:
    """Make the first attempts, and where they stall, the further ones."""
    parts = chain([(FIRST_ATTEMPTS, False)], _further_parts(problem))
    return _in_turn(problem, parts, start_slack, regularization)


first_attempts = partial(attempts, settings=FIRST_ATTEMPTS)


def at_point(
    problem: Problem, x: Vector, recorded_stages: RecordedStages | None = None
) -> Stage:
    """Yield the basic solutions of the active set that x = (z - w) / 2 suggests, as
    those of the last iterates are.

    Finished : one of them has no infeasibility beyond rounding. Stalled : all have; for
    a large sparse M, the first attempts, which share their scaling with this one, are
    put in `recorded_stages`, unless it is None.
    """
    try:
        run = Run(problem)
    except ProblemError:
        return Breakdown("numbers overflow in the scaled problem")
    ending = yield from run.at_point(x)
    if (
        recorded_stages is not None
        and not isinstance(ending, Finished)
        and is_sparse(problem.M)
        and problem.n > MAX_AS_DENSE
    ):
        recorded_stages["interior"] = [run.attempts(FIRST_ATTEMPTS)]
    return ending


class Run:
    """The attempts on one problem, scaled by `slack_form`; ProblemError is raised if
    numbers overflow."""

    def __init__(self, problem: Problem, by_units: bool = False) -> None:
        self._original_problem = problem
        self.within = slack_form(problem, "units" if by_units else "ruiz")
        self._count = 0
        self._is_solved = False  # by the last basic solution

    def attempts(
        self,
        settings: Sequence[InteriorAttempt],
        start_slack: float = 1.0,
        regularization: float = 1e-8,
    ) -> Stage:
        ending: Ending = Breakdown("no factorization succeeded")
        self._count = 0
        for attempt in settings:
            rho = [factor * regularization for factor in attempt.rho]
            ending = yield from self._attempt(attempt, attempt.slack * start_slack, rho)
            if isinstance(ending, NoSolution):
                break
        return ending

    def _attempt(
        self, attempt: InteriorAttempt, slack: float, rho: Sequence[float]
    ) -> Stage:
        within = self.within
        if attempt.shift:
            inner = replace(
                within.problem, M=plus_diagonal(within.problem.M, attempt.shift)
            )
            within = replace(within, problem=inner)
        M = within.problem.M
        try:
            steps = PredictorCorrector(
                within, solver := RefinedShiftedSolver(M, systems(M, within.S), *rho)
            )
            best = along = at = steps.start(slack)
        except SingularMatrix:
            return Breakdown("a factorization failed")
        smallest_merit = merit_at_pivoting = np.inf
        idle_steps, lengths = 0, list[float]()
        for k in range(MAX_INTERIOR_STEPS + 1):
            mu = steps.mu(at)
            merit = max(steps.pairs * mu / steps.gap_size(at), steps.residuals(at)[2])
            idle_steps = 0 if merit < 0.9 * smallest_merit else idle_steps + 1
            if merit < smallest_merit:
                best, smallest_merit = at, merit
            if merit < CLOSE_MERIT and merit < MERIT_DROP * merit_at_pivoting:
                merit_at_pivoting = merit
                # These come before the point itself, which is less accurate.
                yield from self._exchanged(at.z, self._active(at))
            if lengths:
                step = f"mu {mu:.0e}, {lengths[-1]:.2f}, rho {solver.rho:.0e}"
                # Signs are not final yet where the next points are better.
                yield self._shown(at.z, step)._replace(
                    signs_final=mu < SMALL_MU,
                    quantities=partial(PathStep, mu, lengths[-1], solver.rho),
                )
            due = k % PROOF_EVERY == PROOF_EVERY - 1 and merit > CLOSE_MERIT
            if due and (
                proof := proof_of(self._original_problem, self.within, (at.z, along.z))
            ):
                return NoSolution(proof)
            is_close = not smallest_merit > NEAR_MERIT
            patience = IMPATIENT_STEPS if is_close else PATIENT_STEPS
            if mu < VANISHED_MU or idle_steps > patience:
                break
            if attempt.gives_up and _are_short(lengths):
                break
            try:
                at, length, along = steps.next(at)
            except SingularMatrix:
                break  # the best point so far may have the active set of the solution
            lengths.append(length)
            self._count += 1
        if proof := proof_of(self._original_problem, self.within, (at.z,)):
            return NoSolution(proof)
        yield from self._exchanged(best.z, self._active(best), last=True)
        yield self._shown(best.z, BEST)
        return Stalled("its steps no longer reduce the residual")

    def residual(self, z: Vector) -> float:
        """Return the natural residual of a z of the original problem, in scaled
        variables."""
        inner, z = self.within.problem, z[self.within.kept_columns] / self.within.units
        return largest(inner.box.gaps(z, multiplier(inner.M)(z) + inner.q))

    def at_point(
        self,
        x: Vector,
        rounds: int = START_ROUNDS,
        max_residual: float = 0.0,
        initial_guess: Vector | None = None,
        shift: float = PROXIMAL_SHIFT,
    ) -> Stage:
        """Yield the basic solutions of block principal pivoting from the basis of an x
        of the original problem. The first iterate of the run is the initial guess, put
        on the bounds of this basis, if no more than rounding keeps it from solving the
        problem.

        rounds : the largest number of block pivots.
        max_residual : the scaled residual up to which pivoting continues if the
            residual has grown.
        initial_guess : the z from which the basic solutions are computed, by default
            the z of x.
        shift : eps of the proximal iteration.
        """
        within = self.within
        inner = self.within.problem
        times = multiplier(self.within.problem.M)
        z = self._original_problem.box.z_of(x)
        start, z = (
            v[within.kept_columns] / within.units
            for v in (z if initial_guess is None else initial_guess, z)
        )
        basis = inner.box.basis_of((z - times(z) - inner.q) / 2)
        z = np.where(
            basis == BASIC, inner.box.project(start), inner.box.nonbasic(basis)
        )
        if (
            not self._count
            and largest(inner.box.gaps(z, times(z) + inner.q)) <= SOLVED_RESIDUAL
        ):
            self._count += 1
            yield self._shown(z, FINISH)._replace(signs_final=False)
        for point in islice(
            self._exchanged(start, basis, max_residual=max_residual, shift=shift),
            rounds,
        ):
            yield point._replace(signs_final=point.signs_final or self._is_solved)
            if self._is_solved:
                return Finished()
        return Stalled("the active set at the starting point is not that of a solution")

    def _exchanged(
        self,
        z: Vector,
        basis: BasisStatus,
        last: bool = False,
        max_residual: float = FAR_RESIDUAL,
        shift: float = PROXIMAL_SHIFT,
    ) -> Iterator[Iterate]:
        """Yield the basic solutions of block principal pivoting from this basis,
        computed from z, while their residual is at most `max_residual` or not much
        larger than the smallest one. Their signs are final for the last point, or if
        they solve the problem up to rounding."""
        inner = self.within.problem
        proximal = _ProximalSolutions(inner, self.within.S, z, shift)
        smallest_residual = largest(
            inner.box.gaps(proximal.z, multiplier(inner.M)(proximal.z) + inner.q)
        )
        with suppress(SingularMatrix):
            for basic_solution in islice(
                block_principal_pivoting(proximal, basis), EXCHANGE_ROUNDS
            ):
                size = largest(inner.box.gaps(basic_solution.z, basic_solution.w))
                if not size <= max(WORSE_FACTOR * smallest_residual, max_residual):
                    return  # the basis is wrong, and almost singular
                smallest_residual = min(size, smallest_residual)
                self._count += 1
                self._is_solved = basic_solution.is_solution
                yield self._shown(proximal.z, FINISH)._replace(
                    signs_final=size <= EXACT_RESIDUAL or last
                )
                if basic_solution.is_solution:
                    return

    def _active(self, at: PrimalDualPoint) -> BasisStatus:
        """Return the active set: a variable is at a bound where its slack is below its
        multiplier."""
        return self.within.basis(at.s < at.w, at.s)

    def _shown(self, z: Vector, step: str) -> Iterate:
        return Iterate(self.within.back(z / 2), None, step, self._count)


# Without it: programs of control in 200 unknowns take 4.8 times as long.
class _ProximalSolutions:
    """Basic solutions of a problem with signs S, each by proximal steps from the last
    z, moved within the bounds."""

    def __init__(
        self, problem: Problem, S: Vector | None, z: Vector, shift: float
    ) -> None:
        self._problem = problem
        self._S = S
        self.box = problem.box
        self.z = problem.box.project(z)
        self._shift = shift

    @np.errstate(all="ignore")
    def at(self, basis: BasisStatus) -> BasicSolution:
        """Return the basic solution of a basis; raise SingularMatrix if z is not
        finite."""
        basic = (basis == BASIC).nonzero()[0]
        times = multiplier(self._problem.M)
        q = self._problem.q
        z = np.where(basis == BASIC, self.z, self.box.nonbasic(basis))
        w = times(z) + q
        last = smallest_residual = float(np.abs(w[basic]).max(initial=0.0))
        best = z, w
        if basic.size:
            shifted_solver = systems(
                principal(self._problem.M, basic),
                None if self._S is None else self._S[basic],
                once=True,
            )
            try:
                shifted_solver.factorize(np.full(basic.size, self._shift))
            except SingularMatrix:  # rounding has made a pivot 0
                if not self._shift < LARGER_SHIFT:
                    raise
                shifted_solver.factorize(np.full(basic.size, LARGER_SHIFT))
        for step in range(PROXIMAL_STEPS if basic.size else 0):
            z = z.copy()
            z[basic] -= shifted_solver.solve(w[basic])
            if not np.isfinite(z).all():
                raise SingularMatrix
            w = times(z) + q
            size = float(np.abs(w[basic]).max())
            if size < smallest_residual or size <= ROUNDING:
                best, smallest_residual = (z, w), min(size, smallest_residual)
            if size > SLOW_PROXIMAL * last and step >= MIN_STEPS:
                break
            last = size
        z, w = best
        wrong = self.box.violations(z, w, basis) > WRONG_SIGN
        self.z = self.box.project(z)
        return BasicSolution(basis, z, w, wrong, not wrong.any())


def _are_short(lengths: list[float]) -> bool:
    """Return whether the last of these lengths of steps are short, after a start that
    often has short steps."""
    return len(lengths) >= WARM_UP_STEPS and bool(
        np.mean(lengths[-RECENT_STEPS:]) < SLOW_LENGTH
    )
