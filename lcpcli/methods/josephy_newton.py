"""Newton's method of Josephy for nonlinear complementarity problems: each step solves
the linearization at z.

N. H. Josephy, Newton's method for generalized equations, MRC Technical Report 1965,
University of Wisconsin (1979); globally by S. P. Dirkse and M. C. Ferris, The PATH
solver, Optimization Methods and Software 5 (1995) 123-156, and by T. S. Munson, F.
Facchinei, M. C. Ferris, A. Fischer and C. Kanzow, The semismooth algorithm for large
scale complementarity problems, INFORMS Journal on Computing 13 (2001) 294-311.

The merit function is that of Fischer and Burmeister, half the square of Phi, whose
zeros are the solutions.

With phi(a, b) = a + b - (a^2 + b^2 + 2 mu)^(1/2) and mu = 0, Phi_i is phi(z_i - l_i,
F_i) where z_i has a lower bound only, -phi(u_i - z_i, -F_i) with an upper bound only,
phi(z_i - l_i, -phi(u_i - z_i, -F_i)) with both, F_i with neither, and z_i - l_i where
these are equal. A. Fischer, A special Newton-type optimization method, Optimization 24
(1992) 269-284; S. C. Billups, Algorithms for complementarity problems and generalized
equations, thesis (1995). A zero of its gradient may be no solution. With mu > 0, Phi is
smooth, and its zeros tend to a solution as mu tends to 0: C. Kanzow, Some noninterior
continuation methods for linear complementarity problems, SIAM J. Matrix Anal. Appl. 17
(1996) 851-868.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg.doubles import EPS, generator, is_finite, size
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import (
    absolute_product,
    dense,
    is_sparse,
    plus_diagonal,
    product,
    row_maxima,
)
from lcpcli.methods.stages import Ending, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import Box
from lcpcli.model.evaluations import Evaluations
from lcpcli.typing import BasisStatus, Matrix, Vector

# A step has to get below the largest of so many last merits, unless an attempt is
# monotone.
MEMORY = 10
# The first MEMORY steps have to get below this multiple of the merit at the start, if
# they are not perturbed.
SLACK = 100.0
MAX_HALVINGS = 20  # of the distance to another start, until F is finite there
# Relative to the natural residual at the start: a residual that may be rounding.
NEARLY_SOLVED = 1e-8
# The error of F in a row: rounding errors of its magnitude, and multiples of the noise
# of F.
FEW_ROUNDINGS, FEW_NOISES = 16, 8
MAX_NOISE_ESTIMATES = 3  # how often the noise of F is estimated in a run
# A z of more than this multiple of the size of the start diverges, so that other steps
# of finite differences do not help.
FAR = 1e8
# Steps that do not decrease the merit, or only within noise, after which the residual
# may be noise; or to points of a tiny residual that are not accepted as solutions.
FRUITLESS = 4
# Relative to the natural residual at the start: a residual that may be noise of F.
MAX_NOISY = 1e-2
# Unknowns of a problem that by default is stopped after the work of about a second.
MAX_UNKNOWNS_WORK_LIMITED = 200
MAX_LINEARIZATIONS = 1000  # of a small problem in about a second
# Unknowns from which on the cubic work of a linearization exceeds the rest.
CUBIC = 130
COSTLY = 300  # unknowns from which on a linearization takes much longer than a system
FUNCTIONS = 64  # evaluations of F that take as long as a small linearization
# Pivots that take as long as a small linearization, and unknowns from which on passes
# over the tableau dominate their time.
PIVOTS, QUADRATIC = 32, 150
FINE = 1e-12  # a natural residual that is not reduced any further
SMALL = 1e-6  # a natural residual that may be rounding
UNDEFINED = "the derivatives of F are not finite at z"
STATIONARY = "z is almost a stationary point of the merit function, but no solution"
SLOW = "the merit function decreases too slowly"
NO_FURTHER = "no step decreases the residual further"
LONG = (
    "stopped at the default work limit (about one second); pass restarts= to continue"
)

Linear = Callable[
    [Matrix, Vector, Box, "BasisStatus | None", bool],
    "tuple[Vector, BasisStatus] | None",
]
"""The solver of linearizations: called with M, q, the bounds, the basis to start from,
and whether to continue longer than before, it returns the solution and its basis, or
None."""


class _Attempt(NamedTuple):
    """How an attempt begins.

    first : the name of the first steps, a method of `_JosephyNewton`, if there are any.
    is_perturbed : whether it begins with the largest perturbation, and all its steps
        decrease the merit.
    seed : the seed of another start; 0 for the start of the problem.
    is_short : whether, with more than COSTLY unknowns, it ends where a linearization
        has no solution: smoothed steps take less time than perturbed linearizations.
    """

    first: str = ""
    is_perturbed: bool = False
    seed: int = 0
    is_short: bool = False


ATTEMPTS = (
    _Attempt("crash", is_short=True),
    _Attempt("smoothed"),
    _Attempt(),
    _Attempt(is_perturbed=True),
)  # then the first two alternate, from other starts


def josephy_newton(
    evaluations: Evaluations,
    start: Vector,
    linear: Linear,
    *,
    restarts: int = 12,
    is_brief: bool = False,
) -> Stage:
    """Solve a nonlinear problem by the solutions of its linearizations F(z) + J(z) d,
    for d with z + d in the bounds.

    start : a z within the bounds, where F is finite. linear : solves the
        linearizations.
    is_brief : whether, with at most MAX_UNKNOWNS_WORK_LIMITED unknowns, it is stopped
    after the work of about a second, which is measured by the numbers of
    linearizations, of their pivots, and of evaluations of F.

    The steps, as the trace names them: "crash" solves the linearization for the
    variables that are not held at their bounds, from the start and for as long as the
    merit function falls fast; "full" leads to the solution of the linearization,
    "damped" a part of the way there, to where the merit function is below the largest
    of the last MEMORY merits, at first below SLACK times that of the start. Where there
    is none, or it does not decrease the merit, "proximal" is such a step by J + mu D,
    where D has the sizes of the rows of J, with mu that falls from step to step. Where
    this fails, "semismooth" is a step of Newton's method for the merit function, and
    "gradient" one down its gradient; close to a solution "active" is the shortest step
    that solves the equations of its active set, for a singular J. All steps are cut
    back to where F and J are finite. Where they lead no further, "watchdog" goes back
    to the smallest merit, from where all steps have to decrease it. "restart" begins
    another attempt: the first one with "smoothed" steps, of Newton's method for
    smoothed merit functions, the next ones without crash and with perturbed
    linearizations, and then from other starts.

    Finished : the natural residual is 0, or almost 0 and no step decreases it. Stalled
        : all attempts are stuck, which proves nothing.
    """
    search = _MultistartNewton(
        evaluations, linear, is_brief and start.size <= MAX_UNKNOWNS_WORK_LIMITED
    )
    ending: Ending = Stalled(STATIONARY)
    for number in range(restarts + 1):
        if search.is_long:
            break
        attempt = (
            ATTEMPTS[number]
            if number < len(ATTEMPTS)
            else _Attempt(ATTEMPTS[number % 2].first, seed=number)
        )
        trial = search.start(attempt, start)
        if trial is None:
            continue
        is_large = start.size > COSTLY and restarts >= len(ATTEMPTS)
        search.is_short = attempt.is_short and is_large
        if number:
            yield search.iterate(trial, "restart")
        for reached in getattr(search, attempt.first)(trial) if attempt.first else ():
            trial = reached
            yield search.iterate(trial, attempt.first)
        last = yield from search.descent(trial, 1 if attempt.is_perturbed else MEMORY)
        if isinstance(last, Finished) and not last.reason:
            return last
        ending = ending if isinstance(ending, Finished) else last
        if search.is_rounding:
            break
    return ending


DECREASE = 1e-4  # of the merit, relative to the length of a step
# Smallest fraction of a step to the solution of a linearization; its square for other
# steps.
SHORTEST = 2.0**-12
# Perturbations of the diagonal of J, relative to its rows, where its linearization has
# no solution.
PERTURBATIONS = 1e-4, 1e-2, 1.0
MIN_PERTURBATION = 1e-12
# A perturbation is divided by FALL after a step, and multiplied by RISE where there is
# none.
FALL, RISE = 10.0, 100.0
# Fraction of a perturbed step from which on no other perturbation is attempted.
LONG_PART = 1 / 4
# Linearizations that were solved with more work and led to no step, after which no more
# work is spent on one.
MAX_FRUITLESS = 4
# Relative to the natural residual at the start: a residual at which the active set may
# be that of a solution.
NEAR = 1e-4
# Unknowns up to which the equations of the active set are solved, and relative singular
# values that are treated as 0.
MAX_ACTIVE, DEPENDENT = 1000, 1e-9
# The decrease of the merit that such a step needs; most of the merit may be rounding.
ACTIVE_DECREASE = 0.25
# Crash steps before the first linearization, and the decrease of the merit that they
# need.
MAX_CRASHED, CRASH_DECREASE = 20, 0.5
# The smallest fraction of a crash step, and the number of steps that are cut back, of
# which the last is not made.
SHORTEST_CRASH, MAX_DAMPED = 2.0**-4, 4
# Fraction of the merit that a full step leaves: above it, the step may lead half of the
# way to a singular solution.
HALF_WAY = 1 / 64
# Fraction of the merit after a full step that twice the step has to reach.
FASTER = 1 / 64
# So many steps have to reduce the residual, the square root of the merit, to this
# fraction.
PATIENCE, PROGRESS = 24, 0.5
SMOOTHER = 0.2  # how fast mu falls in steps for smoothed merit functions
# The smallest mu, and the natural residual, relative to the first one, at which
# smoothed steps stop.
MIN_MU, ALMOST = 1e-22, 1e-6


class TrialPoint(NamedTuple):
    """A z within the bounds with F, Phi, half the square of Phi, and the natural
    residual, signed for each row."""

    z: Vector
    F: Vector
    phi: Vector
    merit: float
    gaps: Vector


_Solved = tuple[float, float, TrialPoint, BasisStatus]
"""A perturbation, a part t of the step to the solution of the linearization, the trial
point to which it leads, and the basis of the solution."""


def is_slow(merits: Sequence[float]) -> bool:
    """Return whether the last PATIENCE merits have left more than PROGRESS of the
    smallest residual before."""
    first = len(merits) - PATIENCE
    return first > 0 and min(merits[first:]) > PROGRESS**2 * min(merits[:first])


class _JosephyNewton:
    """The steps of a run.

    reference : the natural residual at its start. basis : the basis of the last
    linearization. undefined : a row in which steps have left the domain of F.
    linearizations : how many have been solved, or attempted.
    """

    def __init__(self, evaluations: Evaluations, linear: Linear) -> None:
        self.evaluations = evaluations
        self._linear = linear
        self.box = evaluations.problem.box
        self.reference = self._perturbation = 0.0
        self.basis: BasisStatus | None = None
        self.undefined: int | None = None
        self._is_active = False  # whether the last step was one of the active set
        self.is_short = False  # whether the attempt is, as in `_Attempt`
        self.linearizations = self._fruitless = 0

    @np.errstate(all="ignore")
    def at(self, z: Vector) -> TrialPoint | None:
        """Return the trial point at z; None if F, or the merit function, is not finite
        there."""
        F = self.evaluations.values(z)
        if not is_finite(F):
            self.undefined = int(np.argmax(~np.isfinite(F)))
            return None
        values = phi(self.box, z, F)
        merit = 0.5 * float(values @ values)
        return (
            TrialPoint(z, F, values, merit, self.box.gaps(z, F))
            if np.isfinite(merit)
            else None
        )

    def along(
        self, z: Vector, d: Vector, shortest: float, max_merit: float, decrease: float
    ) -> Iterator[tuple[float, TrialPoint]]:
        """Yield t and the trial points z + t d, within the bounds, for t = 1, 1/2, 1/4,
        ..., where F is finite and the merit at most (1 - decrease t) times
        `max_merit`."""
        t, full_step = 1.0, self.box.add_within(d, self.box.shifted_by(z), z)
        while t >= shortest:
            trial = self.at(self.box.project(z + t * d if t < 1.0 else full_step))
            if trial is not None and trial.merit <= max_merit * (1 - decrease * t):
                yield t, trial
            t /= 2

    def crash(self, trial: TrialPoint) -> Iterator[TrialPoint]:
        """Yield the trial points to which projected Newton steps lead, in the variables
        that are not held at a bound by the sign of F."""
        damped_steps_left = MAX_DAMPED
        for _ in range(MAX_CRASHED):
            t, trial = self._crashed(trial)
            damped_steps_left -= t < 1.0
            if not t or not damped_steps_left:
                return
            yield trial

    @np.errstate(all="ignore")
    def _crashed(self, trial: TrialPoint) -> tuple[float, TrialPoint]:
        """Return the length of such a step, 0 if there is none, and the trial point to
        which it leads."""
        J, box = self.evaluations.finite_jacobian(trial.z), self.box
        held = ((trial.z <= box.lower) & (trial.F >= 0)) | (
            (trial.z >= box.upper) & (trial.F <= 0)
        )
        moving, d = (~(held | box.fixed)).nonzero()[0], np.zeros(trial.z.size)
        if J is None or not moving.size or not trial.merit:
            return 0.0, trial
        try:
            d[moving] = PrincipalSolver(J).solve(moving, -trial.F[moving])
        except SingularMatrix:
            return 0.0, trial
        t, reached = next(
            self.along(trial.z, d, SHORTEST_CRASH, trial.merit, CRASH_DECREASE),
            (0.0, trial),
        )
        return t, self._farther(trial, d, reached) if t == 1 else reached

    def smoothed(self, trial: TrialPoint) -> Iterator[TrialPoint]:
        """Yield the trial points to which steps for the smoothed merit function lead,
        with mu that falls whenever Phi is small relative to it, until they are close to
        a solution, or no step decreases the function."""
        mu, merits = 0.5 * min(size(trial.gaps), 1.0) ** 2, [trial.merit]
        while not is_slow(merits) and size(trial.gaps) > ALMOST * self.reference:
            J = self.evaluations.finite_jacobian(trial.z)
            next_step = None if J is None else self.downhill(trial, J, mu)
            if next_step is None:
                return
            trial = next_step[1]
            merits.append(trial.merit)
            yield trial
            if size(phi(self.box, trial.z, trial.F, mu)) <= mu**0.5:
                mu = max(min(SMOOTHER * mu, size(trial.gaps) ** 2), MIN_MU)

    @np.errstate(all="ignore")
    def step(
        self,
        trial: TrialPoint,
        J: Matrix,
        max_merit: float,
        max_merit_unperturbed: float,
    ) -> tuple[str, TrialPoint] | None:
        """Return the name of the step from a trial point, and where it leads; None if
        there is none.

        max_merit, max_merit_unperturbed : the merit must get below these by a step of a
            perturbed linearization, and by one that is not perturbed.
        """
        relative_residual = size(trial.gaps) / self.reference if self.reference else 0.0
        is_near_solution, short = relative_residual <= NEAR, list[_Solved]()
        # Where one such step was better than those to solutions, more of them follow.
        if is_near_solution and self._is_active:
            if reached := self._active_step(trial, J):
                return "active", reached
            is_near_solution = False
        self._is_active = False
        for perturbation, is_longer in self._kinds(relative_residual):
            if is_longer and short:
                break
            next_step = self._solved(
                trial,
                J,
                max_merit if perturbation else max_merit_unperturbed,
                perturbation,
                is_longer,
            )
            if next_step is not None and (
                next_step[1] >= LONG_PART or not perturbation
            ):
                short = [next_step]
                break
            short += [] if next_step is None else [next_step]
            if self.is_short and not is_near_solution:
                return None
            if is_near_solution and (reached := self._active_step(trial, J)):
                self._is_active = True
                return "active", reached
            is_near_solution = False
        if not short:
            self.basis = None
            return self.downhill(trial, J)
        perturbation, t, reached, self.basis = min(
            short, key=lambda candidate: candidate[2].merit
        )
        fallen = perturbation / (FALL if t < 1 else FALL**2)
        self._perturbation = fallen if fallen >= PERTURBATIONS[0] / RISE**2 else 0.0
        if perturbation:
            return "proximal", reached
        return ("damped" if t < 1 else "full"), reached

    def _kinds(self, relative_residual: float) -> Iterator[tuple[float, bool]]:
        """Yield the linearizations to solve one after another, each by its perturbation
        and whether its solution may take longer.

        relative_residual : the natural residual relative to that of the start:
            perturbations of this size do not keep the steps from being fast.
        """
        last_perturbation, rising = self._perturbation, tuple[float, ...](PERTURBATIONS)
        if last_perturbation:
            rising = RISE * last_perturbation, RISE**2 * last_perturbation
        elif relative_residual < PERTURBATIONS[0]:
            rising = max(relative_residual, MIN_PERTURBATION), *PERTURBATIONS
        for perturbation in (last_perturbation, *rising):
            if perturbation <= PERTURBATIONS[-1]:
                yield perturbation, False
        if self._fruitless < MAX_FRUITLESS:
            yield last_perturbation, True

    def _solved(
        self,
        trial: TrialPoint,
        J: Matrix,
        max_merit: float,
        perturbation: float,
        is_longer: bool,
    ) -> _Solved | None:
        """Return the step to the solution of the linearization with this perturbation,
        or a part of the step."""
        sizes = row_maxima(J)
        M = (
            plus_diagonal(J, perturbation * np.where(sizes > 0, sizes, 1.0))
            if perturbation
            else J
        )
        self.linearizations += 1
        answer = self._linear(
            M, trial.F, self.box.shifted_by(trial.z), self.basis, is_longer
        )
        if answer is not None:
            d, self.basis = answer
            for t, reached in self.along(trial.z, d, SHORTEST, max_merit, DECREASE):
                if self._is_differentiable(reached):
                    return (
                        perturbation,
                        t,
                        self._farther(trial, d, reached) if t == 1 else reached,
                        self.basis,
                    )
        self._fruitless += is_longer
        return None

    def _farther(self, trial: TrialPoint, d: Vector, reached: TrialPoint) -> TrialPoint:
        """Return where twice the step leads if that is much better than where the step
        leads: close to a solution with a singular J, Newton's method goes half of the
        way (D. W. Decker, H. B. Keller and C. T. Kelley 1983)."""
        if HALF_WAY * trial.merit <= reached.merit < trial.merit:
            twice = self.at(self.box.project(trial.z + 2 * d))
            if (
                twice is not None
                and twice.merit <= FASTER * reached.merit
                and self._is_differentiable(twice)
            ):
                return twice
        return reached

    def _active_step(self, trial: TrialPoint, J: Matrix) -> TrialPoint | None:
        """Return where the shortest step leads that solves the equations of the active
        set at a trial point close to a solution, as well as they can be solved: J may
        be singular there, if multipliers are not unique."""
        if trial.z.size > MAX_ACTIVE:
            return None
        lower, upper = self.box.shifted_by(trial.z).vectors(trial.z.size)
        low, high = lower >= -trial.F, upper <= -trial.F
        d = np.where(low, lower, np.where(high, upper, 0.0))
        moving = (~(low | high)).nonzero()[0]
        with suppress(SingularMatrix):
            rows = dense(J[moving])
            d[moving] = np.linalg.lstsq(
                rows[:, moving], -(trial.F[moving] + rows @ d), rcond=DEPENDENT
            )[0]
            for t, reached in self.along(
                trial.z, d, SHORTEST_CRASH, trial.merit, ACTIVE_DECREASE
            ):
                return self._farther(trial, d, reached) if t == 1 else reached
        return None

    def _is_differentiable(self, trial: TrialPoint) -> bool:
        return not trial.merit or self.evaluations.finite_jacobian(trial.z) is not None

    @np.errstate(all="ignore")
    def downhill(
        self, trial: TrialPoint, J: Matrix, mu: float = 0.0
    ) -> tuple[str, TrialPoint] | None:
        """Return a semismooth step, or one down the gradient of the merit function,
        projected on the bounds."""
        values = phi(self.box, trial.z, trial.F, mu) if mu else trial.phi
        G = slopes(self.box, trial.z, trial.F, J, mu)
        merit = 0.5 * float(values @ values)
        gradient = product(G.T, values)
        square = float(gradient @ gradient)
        if not 0 < square < np.inf:
            return None
        downhill = -2 * merit / square * gradient
        for step, d in (
            ("semismooth", newton_direction(G, values, gradient)),
            ("gradient", downhill),
        ):
            t = 1.0
            while d is not None and t >= SHORTEST**2:
                y = self.box.project(trial.z + t * d)
                if (reached := self.at(y)) is not None:
                    values = phi(self.box, y, reached.F, mu) if mu else reached.phi
                    now = 0.5 * float(values @ values)
                    below = DECREASE * min(float(gradient @ (y - trial.z)), 0.0)
                    if (
                        now <= merit + below
                        and now < merit
                        and self._is_differentiable(reached)
                    ):
                        return step, reached
                t /= 2
        return None


class _MultistartNewton(_JosephyNewton):
    """The attempts of a run. is_rounding : whether the last one has ended where the
    residual is rounding, or noise."""

    def __init__(
        self, evaluations: Evaluations, linear: Linear, is_brief: bool
    ) -> None:
        super().__init__(evaluations, linear)
        self._is_brief = is_brief
        self._last_size = np.inf
        self.is_rounding = False
        self._noise_estimates_left = MAX_NOISE_ESTIMATES
        self._last_noise_trial: TrialPoint | None = None

    @property
    def is_long(self) -> bool:
        n, evaluations = self.evaluations.problem.n, self.evaluations
        work = self.linearizations * (
            1 + (n / CUBIC) ** 3
        ) + evaluations.pivots / PIVOTS * (1 + (n / QUADRATIC) ** 2)
        return (
            self._is_brief
            and work + evaluations.functions / FUNCTIONS > MAX_LINEARIZATIONS
        )

    def iterate(self, trial: TrialPoint, step: str) -> Iterate:
        """Return the iterate for the loop; it is final if its residual is in each row
        tiny or rounding, or did not decrease much."""
        now, before = size(trial.gaps), self._last_size
        self._last_size = now
        is_final = now <= FINE or now > 0.5 * before
        if not is_final and now <= max(SMALL, NEARLY_SOLVED * self.reference):
            is_final = self._is_rounded(trial, FINE)
        return Iterate(
            trial.z / 2,
            trial.gaps,
            step,
            self.evaluations.functions,
            signs_final=is_final,
        )

    def start(self, attempt: _Attempt, first: Vector) -> TrialPoint | None:
        """Return the start of an attempt, farther from the first one with each seed;
        None if the merit is not finite there."""
        self._last_size = np.inf
        start, seed = first, attempt.seed
        if seed:
            displacement = 2.0 ** (seed - len(ATTEMPTS)) * generator(seed).uniform(
                -1.0, 1.0, first.size
            )
            displacement *= np.maximum(1.0, np.abs(first))
            starts = (
                self.box.project(first + 0.5**halvings * displacement)
                for halvings in range(MAX_HALVINGS)
            )
            start = next(
                (
                    start
                    for start in starts
                    if is_finite(self.evaluations.values(start))
                ),
                first,
            )
        trial = self.at(start)
        if trial is not None:
            self.basis = None
            self._perturbation = PERTURBATIONS[-1] if attempt.is_perturbed else 0.0
            self.reference = self.reference or size(trial.gaps)
        return trial

    def descent(self, trial: TrialPoint, memory: int) -> Stage:
        """Take steps until the merit hardly falls; then begin once more at its smallest
        value, with steps that all decrease it."""
        best = trial
        nonmonotone_steps = 0
        noisy_steps = 0
        while True:
            merits, first = [trial.merit], SLACK * trial.merit if memory > 1 else 0.0
            while trial.merit and not (is_slow(merits) or self.is_long):
                max_merit = max(merits[-memory:])
                J = self.evaluations.finite_jacobian(trial.z)
                max_merit_unperturbed = (
                    max(max_merit, first) if len(merits) <= memory else max_merit
                )
                next_step = (
                    None
                    if J is None
                    else self.step(trial, J, max_merit, max_merit_unperturbed)
                )
                if next_step is None:
                    break
                step, trial = next_step
                nonmonotone_steps = (
                    0 if trial.merit < best.merit else nonmonotone_steps + 1
                )
                noisy_steps += self._is_within_noise(trial)
                best = trial if trial.merit < best.merit else best
                merits.append(trial.merit)
                yield self.iterate(trial, step)
                if FRUITLESS in (nonmonotone_steps, noisy_steps):
                    if self._is_noise(best):
                        break
                    self.evaluations.adapt(trial.z)
            if not trial.merit:
                return Finished()
            if self._is_noise(best):
                return Finished(NO_FURTHER)
            if self.is_long or self.is_short:
                return self._ending(best, merits)
            if size(trial.z) <= FAR * max(
                1.0, size(self.evaluations.problem.x0)
            ) and self.evaluations.adapt(trial.z):
                continue
            if trial is best or memory == 1:
                return self._ending(best, merits)
            trial, memory = best, 1
            self.basis = None
            yield self.iterate(trial, "watchdog")

    def _ending(self, best: TrialPoint, merits: Sequence[float]) -> Ending:
        """Return the ending of a descent, at the trial point with the smallest merit;
        if it is stalled, with the row in which steps have left the domain of F."""
        if size(best.gaps) > NEARLY_SOLVED * self.reference:
            if self.is_long:
                reason = LONG
            elif not is_finite(row_maxima(self.evaluations.jacobian(best.z))):
                reason = UNDEFINED
            elif is_slow(merits):
                reason = SLOW
            else:
                reason = STATIONARY
            if (i := self.undefined) is not None:
                name = self.evaluations.problem.names[i] or str(i + 1)
                reason += (
                    f"; steps to where F is undefined, in row {name}, were cut back"
                )
            return Stalled(reason)
        self.is_rounding = self._is_rounded(best, 0.0)
        return Finished(NO_FURTHER)

    @np.errstate(all="ignore")
    def _is_rounded(self, trial: TrialPoint, tiny: float) -> bool:
        """Return whether the residual is in each row no more than a few rounding errors
        of F, or tiny."""
        J = self.evaluations.jacobian(trial.z)
        terms = absolute_product(J, np.abs(trial.z)) + np.abs(trial.F)
        limits = np.maximum(FEW_ROUNDINGS * EPS * terms, tiny)
        return bool((np.abs(trial.gaps) <= limits).all())

    def _is_noise(self, best: TrialPoint) -> bool:
        """Return whether the residual may be noise of F."""
        is_small = size(
            best.gaps
        ) <= MAX_NOISY * self.reference or self._is_within_noise(best)
        if (
            self._last_noise_trial is not best
            and self._noise_estimates_left
            and is_small
        ):
            self._last_noise_trial = best
            self._noise_estimates_left -= 1
            self.evaluations.noise_at(best.z)
            self.is_rounding = self._is_within_noise(best)
        return self.is_rounding

    def _is_within_noise(self, trial: TrialPoint) -> bool:
        """Return whether the residual is no more than a few times the noise of F, as
        far as this is known."""
        return bool((np.abs(trial.gaps) <= FEW_NOISES * self.evaluations.noise).all())


DAMPING = 1e-6  # of Newton steps where their matrix is singular, relative to it


def phi(box: Box, z: Vector, F: Vector, mu: float = 0.0) -> Vector:
    """Return Phi at a z within the bounds, shape (n,)."""
    below, above = np.isfinite(box.lower), np.isfinite(box.upper)
    upper = np.where(above, -_phi(np.where(above, box.upper - z, 0.0), -F, mu), F)
    both = np.where(below, _phi(np.where(below, z - box.lower, 0.0), upper, mu), upper)
    return np.where(box.fixed, z - box.lower, both)


def slopes(box: Box, z: Vector, F: Vector, J: Matrix, mu: float = 0.0) -> Matrix:
    """Return the Jacobian of Phi, where mu = 0 an element of the generalized one, dense
    or a csr array."""
    below, above = np.isfinite(box.lower), np.isfinite(box.upper)
    distance_to_upper = np.where(above, box.upper - z, 0.0)
    upper = np.where(above, -_phi(distance_to_upper, -F, mu), F)
    by_gap, by_F = (
        np.where(above, slope, other)
        for slope, other in zip(
            _slopes(distance_to_upper, -F, mu), (0.0, 1.0), strict=True
        )
    )
    by_z, by_upper = _slopes(np.where(below, z - box.lower, 0.0), upper, mu)
    by_z, by_upper = np.where(below, by_z, 0.0), np.where(below, by_upper, 1.0)
    a = np.where(box.fixed, 1.0, by_z + by_upper * by_gap)
    b = np.where(box.fixed, 0.0, by_upper * by_F)
    if is_sparse(J):
        with imports:
            from scipy.sparse import diags_array
        return (diags_array(b) @ J + diags_array(a)).tocsr()
    return b[:, np.newaxis] * J + np.diag(a)


def _root(a: Vector, b: Vector, mu: float) -> Vector:
    root: Vector = np.hypot(a, b)
    return np.hypot(root, (2 * mu) ** 0.5) if mu else root


def _phi(a: Vector, b: Vector, mu: float) -> Vector:
    """Return phi(a, b) without cancellation, with root^2 = a^2 + b^2 + 2 mu.

    For a, b > 0 it is 2 (a b - mu) / (a + b + root). Where a is positive alone it is b
    - (root - a), and root - a = (b^2 + 2 mu) / (root + a): a + b - root would be 0 for
    a far larger than |b|, and any such z a solution. Likewise for b.
    """
    root = _root(a, b, mu)
    larger, smaller = np.maximum(a, b), np.minimum(a, b)
    both, one = smaller > 0, larger > 0
    sums = np.where(both, a + b + root, 1.0)
    of_root = np.where(one, larger + root, 1.0)
    differences = smaller * (smaller / of_root) + 2 * mu / of_root
    return np.where(
        both,
        2 * a * (b / sums) - 2 * mu / sums,
        np.where(one, smaller - differences, a + b - root),
    )


def _slopes(a: Vector, b: Vector, mu: float) -> tuple[Vector, Vector]:
    """Return the derivatives of phi by a and b; where both are 0, those in the
    direction (1, 1)."""
    root = _root(a, b, mu)
    zero = root == 0
    root = np.where(zero, 1.0, root)
    kink = 1.0 - 0.5**0.5
    return np.where(zero, kink, 1.0 - a / root), np.where(zero, kink, 1.0 - b / root)


@np.errstate(all="ignore")
def newton_direction(G: Matrix, values: Vector, gradient: Vector) -> Vector | None:
    """Return the Newton step of Phi or, where it is not one of descent, that of
    Levenberg and Marquardt; or None."""
    everything = np.arange(values.size)
    with suppress(SingularMatrix):
        d = PrincipalSolver(G).solve(everything, -values)
        if float(gradient @ d) < 0:
            return d
    H = G.T @ G
    shift = DAMPING * float(row_maxima(H).max(initial=0.0))
    with suppress(SingularMatrix):
        d = PrincipalSolver(
            plus_diagonal(H.tocsr() if is_sparse(H) else H, shift)
        ).solve(everything, -gradient)
        return d if is_finite(d) and float(gradient @ d) < 0 else None
    return None
