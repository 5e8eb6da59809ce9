"""The interior point method where M + M' is positive definite, however stiff M is.

Newton by levels, Krylov methods and coarse versions of M are made for matrices without
positive entries off the diagonal, on which block pivots advance from one side, and
whose coarse versions have the same sign pattern. Fourth differences have neither: block
pivots cycle (of a clamped beam with 500 unknowns that touches an obstacle at two of
them, 10,000 pivots leave 76 infeasibilities), conjugate gradients need as many products
as the root of the condition number, n^2 for a beam, and smoothed aggregation, which
reproduces constants only, does not reduce its smooth vectors. An interior point method
takes 15 to 40 factorizations, whatever the condition number is, if it is computed so
accurately that rounding does not decide:

z is stored in double-double, as a z in double precision leaves eps |M| |z| in each row,
which at a condition number of about 1e16 is all of w. s and w are stored separately, so
that their relative accuracy does not depend on z. Directions come from factors in
double precision and refinement, or from fixed-point factors
(`linalg.definite_systems`). Which variables are basic is shown by the indicators of
Tapia, s+ / s and w+ / w, of which one tends to 1 and the other to 0 (A. S. El-Bakry, R.
A. Tapia and Y. Zhang, A study of indicators for identifying zero variables in
interior-point methods, SIAM Review 36 (1994) 45-72): unlike a comparison of s with w
they do not depend on scaling. Then the basic solution of this active set, whose signs
are right to the last digits, completes the run, or the one after a few pivots: on all
infeasibilities while these become fewer, else on the largest one in scaled variables.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.errors import ProblemError
from lcpcli.linalg.definite_systems import (
    DefiniteSystems,
    condition,
    is_nearly_definite,
)
from lcpcli.linalg.double_double import DoubleDouble
from lcpcli.linalg.doubles import EPS, each_step
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import may_be_stiff
from lcpcli.linalg.patterns import affordable
from lcpcli.methods.interior_steps import (
    PredictorCorrector,
    PrimalDualPoint,
    SlackForm,
    slack_form,
)
from lcpcli.methods.stages import (
    Breakdown,
    Finished,
    Iterate,
    Stage,
    Stalled,
)
from lcpcli.model.box import BASIC, LOWER
from lcpcli.model.problem import Problem
from lcpcli.typing import BasisStatus, Mask, Matrix, Vector

MADE_FOR_IT = "interior"  # the method that begins with this one
# A condition number from which on methods without factors need hundreds of iterations
# for a digit; and one beyond which double precision does not determine it.
STIFF, MAX_TOLD = 1e4, 1e16
FINISH = "finish"
MAX_STEPS = 120  # where 15 to 40 are usual
# Largest ratio of the two indicators of a variable with which they show its status; it
# may be larger for FEW_UNCLEAR variables, or for this fraction of all.
CLEAR = 0.3
FEW_UNCLEAR = 2
UNCLEAR_SHARE = 0.01
# At one check: pivots that do not leave fewer infeasibilities, and the largest fraction
# of infeasible variables with which pivoting continues.
MAX_STAGNANT, MAX_WRONG = 3, 0.2
VANISHED_MU = 1e-80
# Relative to the largest z: what double-double leaves of 0 in z, and in w.
ZERO_Z, ZERO_W = EPS**1.2, 8 * EPS**2
# Shift, in scaled variables, of the system that estimates the size of z, so that
# rounding of M does not make it indefinite.
SHIFT = 1e-13
NOT_DEFINITE = "M is not positive definite"
ROUNDING_DECIDES = (
    "M is positive definite only up to rounding of its entries, which decides whether "
    "there is a solution"
)
STALLED = "its steps no longer reduce the residual"


def stiffness(M: Matrix) -> float | None:
    """Return the estimated condition number of M + M', scaled to a diagonal of 1, if M
    is stiff: sparse, with an affordable factorization, positive definite up to
    rounding, but no M-matrix, and ill-conditioned; else None."""
    if not (may_be_stiff(M) and affordable(M) and is_nearly_definite(M)):
        return None
    size = condition(M)
    return size if size >= STIFF else None


def in_words(size: float) -> str:
    """Return a condition number as messages report it."""
    return f"about {size:.0e}" if size <= MAX_TOLD else f"above {MAX_TOLD:.0e}"


# Without it no verdict is lost, and a beam of 30,000 unknowns takes a third of the
# time, but the active sets of beams from 4000 unknowns on are wrong, and z has fewer
# correct digits.
def definite(problem: Problem, start_slack: float = 1.0) -> Stage:
    """Follow the central path of a problem with M + M' positive definite to the basic
    solution of its active set.

    Yields the complementary points closest to z and w, and the basic solutions that are
    tested, with step "finish". Finished : the last one has no infeasibility. Breakdown
    : M is not positive definite, or rounding is too large. Stalled : each basic
        solution has infeasibilities.

    M must be sparse, with a positive diagonal. start_slack : the slacks at the start,
    relative to the size of the z with w = 0.
    """
    try:
        within = slack_form(problem, "diagonal")
    except ProblemError:
        return Breakdown("numbers overflow in the scaled problem")
    if not is_nearly_definite(within.problem.M):
        return Breakdown(NOT_DEFINITE)
    try:
        return (yield from _Run(within).steps(start_slack))
    except SingularMatrix:
        return Breakdown(ROUNDING_DECIDES)


class _AccurateSteps(PredictorCorrector):
    """PredictorCorrector with z in double-double."""

    # So that a full step does not make an s or w vanish
    max_length, max_boundary_fraction = 2.0, 0.995
    tiny = 1e-150

    @np.errstate(all="ignore")
    def start(self, slack: float) -> PrimalDualPoint:
        """Return a point with slacks of the size of the z that has w = 0, at least 1,
        times `slack`.

        Slacks that are too small make steps short until they have grown, by a factor in
        each step: for soft springs z may be 1e6 times q. With M + d I, d = 1 / size, z
        and w have these sizes too. No slack is larger than the distance of two bounds:
        on 36 beams between two obstacles that saves a third of the steps.
        """
        p, index = self.problem, self._index
        free = self._solution(np.full(p.n, SHIFT)).high
        size = slack * max(float(np.abs(free).max(initial=0.0)), 1.0)
        D = np.zeros(p.n)
        D[index] = 1.0 / size
        z = self._solution(D).high
        s = self._sign * (z[index] - self._bound)
        w = np.maximum(self._sign * (D * -z)[index], 0.0)
        if not self.pairs:
            return PrimalDualPoint(DoubleDouble.of(z), s, w)
        s, w = (v + max(0.0, -1.5 * float(v.min())) for v in (s, w))
        lower, upper = p.box.vectors(p.n)
        s = np.maximum(np.minimum(s + size, (upper - lower)[index]), self.tiny)
        return PrimalDualPoint(DoubleDouble.of(z), s, w + slack)

    def _image(self, z: DoubleDouble) -> Vector:
        image: Vector = self._systems.product(z, self.problem.q)
        return image

    def _beyond(self, at: PrimalDualPoint) -> Vector:
        distance = at.z[self._index] - self._bound
        distances: Vector = self._sign * distance.high - at.s
        distances += self._sign * distance.low
        return distances

    def _accuracy(self, *_: float) -> float:
        """Return 0: where eigenvalues are 1e-16, a residual that is small relative to
        mu may change all digits of z."""
        return 0.0

    def _at_bounds(self, z: DoubleDouble) -> Vector:
        return np.asarray(z.high[self._index])


class _Run:
    """The steps, and checks of the active set to which they converge."""

    def __init__(self, within: SlackForm) -> None:
        self._within, self._problem = within, within.problem
        self._exchanges = Exchanges(within)

    @each_step(all="ignore")
    def steps(self, start_slack: float) -> Stage:
        steps = _AccurateSteps(self._within, self._exchanges.systems)
        at, checked_basis = steps.start(start_slack), b""
        for _ in range(MAX_STEPS):
            before = at
            at, length, _ = steps.next(at)
            self._exchanges.count += 1
            mu = steps.mu(at)
            yield self._exchanges.shown(at.z.high, f"mu {mu:.0e}, {length:.2f}")
            basis, are_clear = self._states(at, before)
            if (are_clear or mu < VANISHED_MU) and basis.tobytes() != checked_basis:
                checked_basis = basis.tobytes()
                yield from self._exchanges.from_states(basis)
                if self._exchanges.is_solved:
                    return Finished()
            if mu < VANISHED_MU:
                break
        is_definite = self._exchanges.systems.is_definite
        return Stalled(STALLED if is_definite else ROUNDING_DECIDES)

    def _states(
        self, at: PrimalDualPoint, before: PrimalDualPoint
    ) -> tuple[BasisStatus, bool]:
        """Return the basis that the indicators of the last step show, and whether
        almost all of them are clear."""
        of_s, of_w = at.s / before.s, at.w / before.w
        active = of_s < of_w
        ratios = np.where(active, of_s / of_w, of_w / of_s)
        unclear = np.count_nonzero(ratios > CLEAR)
        basis = self._within.basis(active, at.s)
        return basis, bool(unclear <= max(FEW_UNCLEAR, UNCLEAR_SHARE * active.size))


class Exchanges:
    """Basic solutions of one scaled problem, and pivots on their infeasibilities.

    is_solved : whether the last one has no infeasibility.
    """

    def __init__(self, within: SlackForm) -> None:
        self.within, self.problem = within, within.problem
        self.systems = DefiniteSystems(within.problem.M, within.S)
        self.count = 0
        self.is_solved = False

    def from_states(self, basis: BasisStatus) -> Iterator[Iterate]:
        """Yield the basic solutions from this basis on, while they have few
        infeasibilities."""
        box = self.problem.box
        min_infeasible = self.problem.n + 1
        stagnant = 0
        while stagnant <= MAX_STAGNANT:
            basic = basis == BASIC
            z, w = self.systems.basic(self.problem.q, box.nonbasic(basis), basic)
            violations = self._violations(z, w, basis)
            wrong = violations > 0.0
            count = int(np.count_nonzero(wrong))
            self.count += 1
            self.is_solved = not count
            yield self._finished(z.high, basis)
            if not count or count > MAX_WRONG * self.problem.n:
                return
            stagnant += count >= min_infeasible
            if count > min_infeasible:
                wrong = np.arange(wrong.size) == violations.argmax()
            min_infeasible = min(count, min_infeasible)
            basis = box.exchanged(basis, wrong, z.high)

    def _violations(self, z: DoubleDouble, w: Vector, basis: BasisStatus) -> Vector:
        """Return the infeasibilities beyond rounding, relative to the largest z or w,
        as the diagonal of M is about 1."""
        box = self.problem.box
        basic = basis == BASIC
        lower, upper = box.vectors(z.high.size)
        below, above = (self._distance(z, bound, basic) for bound in (lower, upper))
        sizes = float(np.abs(z.high).max()), float(np.abs(w).max())
        of_z = np.maximum(below, -above) - ZERO_Z * sizes[0]
        of_w = box.violations(z.high, w, basis) - ZERO_W * sizes[0]
        return np.where(basic, of_z / (sizes[0] or 1.0), of_w / (sizes[1] or 1.0))

    def _distance(self, z: DoubleDouble, bound: Vector, basic: Mask) -> Vector:
        """Return bound - z where z is basic and has that bound, else a value that
        violates nothing."""
        distance = z - np.where(np.isfinite(bound), bound, 0.0)
        finite = basic & np.isfinite(bound)
        return np.where(finite, -(distance.high + distance.low), -np.sign(bound) * 0.0)

    def _finished(self, z: Vector, inner_basis: BasisStatus) -> Iterate:
        """Return a basic solution as an iterate: z as it is, whatever rounding leaves
        of w."""
        within, original_problem = self.within, self.within.original
        original_z = original_problem.box.vectors(original_problem.n)[0].copy()
        basis = np.full(original_problem.n, LOWER)
        original_z[within.kept_columns] = self.problem.box.project(z) * within.units
        basis[within.kept_columns] = inner_basis
        x = original_problem.box.x_within(
            original_z, original_problem.w(original_z), basis
        )
        final = basis if self.is_solved else None
        return Iterate(
            x, None, FINISH, self.count, signs_final=self.is_solved, basis=final
        )

    def shown(self, z: Vector, step: str) -> Iterate:
        x = self.within.back(z / 2)
        return Iterate(x, None, step, self.count, signs_final=False)
