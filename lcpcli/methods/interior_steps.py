"""The problem that the interior point method works on, its linear systems, and its
steps.

The problem has no fixed variables, and is scaled to numbers of about 1. Proofs that it
has no solution come from iterates that diverge: Farkas' y is the direction in which
they do.

The systems (M + D) x = b are solved more accurately than by their regularized factors,
of M + D + rho, alone: refinement removes rho, and where it converges slowly, GMRES
takes over, with the factors as its preconditioner. rho grows where the factors
themselves are poor, and shrinks where rho itself slows refinement.

The steps are Mehrotra's predictor and corrector with Gondzio's further correctors, from
infeasible points: S. Mehrotra, On the implementation of a primal-dual interior point
method, SIAM J. Optim. 2 (1992) 575-601; J. Gondzio, Multiple centrality corrections in
a primal-dual method for linear programming, Comput. Optim. Appl. 6 (1996) 137-156.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.factors import SingularMatrix, Solve
from lcpcli.linalg.krylov import gmres
from lcpcli.linalg.matrices import is_sparse, multiplier
from lcpcli.linalg.shifted_systems import Systems
from lcpcli.linalg.units import units
from lcpcli.model.box import of_masks
from lcpcli.model.changes import Change
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.typing import BasisStatus, Indices, Mask, Matrix, Vector
from lcpcli.verify.alternative import simplest
from lcpcli.verify.certificate import MANY, Proof, first_proof
from lcpcli.verify.farkas import Multiplied

# Rounds of Ruiz's scaling at most; it stops when the largest entries are so close to 1.
RUIZ_ROUNDS, RUIZ_CLOSE = 12, 0.1
# The factor by which Ruiz's scaling may change the start: half of the digits.
RUIZ_FARTHEST = 1e8
ENTRIES_FAR_APART = 60.0  # binary digits between entries of M: more than numbers have
# In scaled variables, in which solutions are about 1: what diverges is at least that
# large.
DIVERGED_SIZE = 1e2
# Relative to the largest entry of y: smaller ones are omitted first.
COARSE_ENTRY = 1e-3
# Relative to the sum of |y|: by how much a proof has to be negative, far above
# rounding.
CLEAR_MARGIN = 1e-10
# Relative to the sum of |y|: what is treated as 0 before and after rounding y.
ROUGHLY_ZERO, NEARLY_ZERO = 1e-2, 1e-5


@dataclass(eq=False, repr=False)
class SlackForm(Change):
    """The variables `kept_columns` of a problem, z = units z'; the others are fixed.

    S : signs with S M symmetric; None if there are none, or M is dense.
    low, high : the indices with finite lower and finite upper bounds.
    """

    kept_columns: Indices
    units: Vector
    S: Vector | None
    low: Indices
    high: Indices

    def back(self, x: Vector) -> Vector:
        """Return the x of z and w of the original problem, where z is within its
        bounds."""
        z = np.full(self.original.n, self.original.lower, dtype=float)
        z[self.kept_columns] = self.problem.box.z_of(x) * self.units
        z = self.original.box.project(z)
        return self.original.box.x_of(z, self.original.w(z))

    def basis(self, active: Mask, s: Vector) -> BasisStatus:
        """Return the basis with these active bounds, first the lower ones; of two of
        one variable, the one with the smaller slack s is."""
        count = self.low.size
        shape = 2, self.kept_columns.size
        at_bounds, slacks = np.zeros(shape, dtype=bool), np.zeros(shape)
        at_bounds[0, self.low], slacks[0, self.low] = active[:count], s[:count]
        at_bounds[1, self.high], slacks[1, self.high] = active[count:], s[count:]
        low, high = at_bounds
        return of_masks(~(low | high), high & ~(low & (slacks[0] <= slacks[1])))

    def multipliers(self, y: Vector) -> Vector:
        original_y = np.zeros(self.original.n)
        original_y[self.kept_columns] = y * self.units
        return original_y


@np.errstate(over="ignore", under="ignore", invalid="ignore")
def slack_form(
    problem: Problem, scaling: Literal["ruiz", "units", "diagonal"] = "ruiz"
) -> SlackForm:
    """Scale symmetrically: D M D has largest entries of about 1 in rows and columns (D.
    Ruiz, A scaling algorithm to equilibrate both rows and columns norms in matrices,
    RAL-TR-2001-034); q and the bounds are divided by the largest.

    scaling : "units" for the D by which solutions are verified, which takes no extra
        time: for S M symmetric it is the same for rows and columns, else their mean.
        "diagonal" for a D M D whose diagonal, which is positive, is about 1.
    """
    conditions = conditions_of(problem)
    kept_columns = np.flatnonzero(conditions.lower < conditions.upper)
    M = conditions.M
    q = conditions.q
    lower = conditions.lower
    upper = conditions.upper
    if kept_columns.size < problem.n:
        fixed = np.where(lower == upper, lower, 0.0)
        q = (problem.q + M @ fixed)[kept_columns]
        M = matrices.principal(M, kept_columns)
        lower, upper = lower[kept_columns], upper[kept_columns]
    if scaling == "diagonal":
        with imports:
            from lcpcli.linalg.definite_systems import diagonal_units
        d = diagonal_units(M)
    elif scaling == "units":
        rows, columns = problem.units.rows, problem.units.columns
        exponents = rows if problem.signs is not None else (rows + columns) / 2
        d = np.exp2(np.rint(exponents))[kept_columns]
    else:
        d = _ruiz(M, problem.signs is not None)
    M = matrices.scaled(M, d, d)
    q = q * d
    lower = lower / d
    upper = upper / d
    finite = [v[np.isfinite(v)] for v in (lower, upper)]
    largest = max(float(np.abs(v).max(initial=0.0)) for v in (q, *finite)) or 1.0
    largest = float(np.exp2(np.rint(np.log2(largest))))
    S = None if problem.signs is None else problem.signs[kept_columns]
    bounded_sides = (
        np.flatnonzero(np.isfinite(lower)),
        np.flatnonzero(np.isfinite(upper)),
    )
    # So that it is not copied again.
    (M.data if is_sparse(M) else M).setflags(write=False)
    inner = Problem(M, q / largest, lower=lower / largest, upper=upper / largest)
    return SlackForm(inner, problem, kept_columns, d * largest, S, *bounded_sides)


def _ruiz(M: Matrix, symmetric: bool) -> Vector:
    """Return Ruiz's scaling; symmetric : whether |M| is. If entries are far apart, it
    stays close to a D for which all of D M D are about 1: Ruiz's is not unique for
    bipartite parts of M. `equilibrate`, whose entries lie between 1/2 and 2 only, costs
    fewer iterations for unsymmetric M with random scaling, but 216 instead of 30 for
    QETAMACR and 47 instead of 10 for contact of jointed bodies, and stiff M are no
    longer recognized."""
    start, numbers = np.ones(M.shape[0]), M.data if is_sparse(M) else M
    sizes = np.log2(np.abs(numbers[numbers != 0]))
    if sizes.size and np.ptp(sizes) > ENTRIES_FAR_APART:
        scaling = units(M)
        start = np.exp2(np.rint((scaling.rows + scaling.columns) / 2))
    d = start
    for _ in range(RUIZ_ROUNDS):
        sizes = np.maximum(*matrices.row_and_column_maxima(M, d, d, symmetric))
        sizes[sizes == 0] = 1.0
        d = np.clip(d / np.sqrt(sizes), start / RUIZ_FARTHEST, start * RUIZ_FARTHEST)
        if (np.abs(sizes - 1) < RUIZ_CLOSE).all():
            break
    # So that nothing is rounded, and symmetry is preserved.
    return np.exp2(np.rint(np.log2(d)))


# Without it: to refute the linear program qual takes 2.7 times as long.
def proof_of(
    problem: Problem, within: SlackForm, directions: Sequence[Vector]
) -> Proof | None:
    """Return the certificate from one of the directions, or from its part with one of
    the signs S; or None."""
    S = within.S
    for direction in (
        candidate for candidate in directions if np.abs(candidate).max() > DIVERGED_SIZE
    ):
        signed_parts = (
            [] if S is None else [np.where(s == S, direction, 0.0) for s in (1, -1)]
        )
        for candidate_part in (*signed_parts, direction):
            y = problem.box.as_multipliers(within.multipliers(candidate_part))
            if not _is_clear(within, y, ROUGHLY_ZERO):
                continue
            # Integers and fractions close to y, and y, first without small entries.
            candidates = list[Vector]()
            for small in (COARSE_ENTRY * float(np.abs(y).max()), 0.0):
                candidates += reversed(
                    list(simplest(np.where(np.abs(y) < small, 0.0, y)))
                )
            clear = (
                candidate
                for candidate in candidates
                if _is_clear(within, candidate, NEARLY_ZERO)
            )
            proof = first_proof(problem, clear, rounded_from=MANY)
            if proof is not None:
                return proof
    return None


def _is_clear(within: SlackForm, y: Vector, max_zero: float) -> bool:
    """Return whether y is almost a proof in scaled variables and double precision,
    whatever the last digits of the data are."""
    y, inner = y[within.kept_columns] / within.units, within.problem
    of, size = Multiplied(inner.M, inner.q, y, inner.box), float(np.abs(y).sum())
    return bool(
        of.excess.max(initial=0.0) <= max_zero * size
        and of.total < -CLEAR_MARGIN * size
    )


SYSTEM_REFINEMENTS = 8  # each costs a solve; GMRES takes over if they are not enough
SLOW_REFINEMENT = 0.3  # the factor per refinement above which GMRES takes over
# Residual of a solution, relative to the right-hand side: a smaller one is out of reach
# in double precision.
MIN_ACCURACY = 1e-13
# Residual after refinement, relative to the right-hand side, above which rho is
# reduced.
DOUBTFUL_RESIDUAL = 1e-5
# Residual of the factors, relative to the right-hand side, above which rho is increased
# next time, or at once.
POOR_FACTORS, USELESS_FACTORS = 1e-7, 1e-2
GMRES_STEPS = 8


class _Refined(NamedTuple):
    """An x with its residual b - (M + D) x, and the weighted norm of this."""

    x: Vector
    residual: Vector
    size: float


class RefinedShiftedSolver:
    """Systems with one M and its regularization rho, within a range; `solve` also
    returns the remaining residual."""

    def __init__(
        self, M: Matrix, systems: Systems, rho: float, min_rho: float, max_rho: float
    ) -> None:
        self._times = multiplier(M)
        self._systems = systems
        self.rho = rho
        self._min_rho = min_rho
        self._max_rho = max_rho
        self._of_factors = 0.0
        self._remaining_residual = 0.0
        self._used_gmres = False

    def factorize(self, D: Vector) -> None:
        """Adapt rho to the last systems, and factorize M + D + rho."""
        if self._of_factors > POOR_FACTORS:
            self.rho = min(self.rho * 10, self._max_rho)
        elif self._used_gmres or self._remaining_residual > DOUBTFUL_RESIDUAL:
            self.rho = max(self.rho / 10, self._min_rho)
        self._of_factors = 0.0
        self._remaining_residual = 0.0
        self._used_gmres = False
        self._D, self._weights = D, 1.0 / (1.0 + D)
        self._systems.factorize(D + self.rho)

    def solve(self, b: Vector, target: float = 0.0) -> tuple[Vector, Vector]:
        """Return x and b - (M + D) x, with a weighted norm of at most the target or
        MIN_ACCURACY |b|, if that can be reached."""
        size = self._norm(b) + 1e-300
        goal = max(MIN_ACCURACY * size, target)
        x, r, of_factors = self._first(b)
        while not of_factors <= USELESS_FACTORS * size and self.rho < self._max_rho:
            # No smaller rho is used from now on.
            self.rho = self._min_rho = min(self.rho * 10, self._max_rho)
            self._systems.factorize(self._D + self.rho)
            x, r, of_factors = self._first(b)
        if not np.isfinite(of_factors):
            raise SingularMatrix
        self._of_factors = max(self._of_factors, of_factors / size)
        refined = self._iterative_refinement(
            _Refined(x, r, self._norm(r)), b, goal, self._systems.solve
        )
        if refined.size > max(10 * goal, DOUBTFUL_RESIDUAL * size):
            self._used_gmres = True
            weights, by_factors = self._weights, self._systems.solve

            def A(v: Vector) -> Vector:
                return weights * self._product(v)

            def inverse(v: Vector) -> Vector:
                return by_factors(v / weights)

            def by_gmres(r: Vector) -> Vector:
                return gmres(A, weights * r, GMRES_STEPS, inverse, 0.1 * goal)

            refined = self._iterative_refinement(refined, b, goal, by_gmres, 1)
        if refined.size > 10 * goal:
            self._remaining_residual = max(
                self._remaining_residual, refined.size / size
            )
        return refined.x, refined.residual

    def _first(self, b: Vector) -> tuple[Vector, Vector, float]:
        """Return the x of the factors, its residual, and the norm of its residual in
        the regularized system of the factors."""
        x = self._systems.solve(b)
        r = b - self._product(x)
        return x, r, self._norm(r - self.rho * x)

    def _iterative_refinement(
        self,
        start: _Refined,
        b: Vector,
        goal: float,
        solve: Solve,
        max_refinements: int = SYSTEM_REFINEMENTS,
    ) -> _Refined:
        """Return x after at most max_refinements refinements, while these converge
        fast."""
        last = start
        for _ in range(max_refinements):
            if last.size <= goal:
                break
            x = last.x + solve(last.residual)
            residual = b - self._product(x)
            size = self._norm(residual)
            if not size < last.size:
                break
            rate = size / last.size
            last = _Refined(x, residual, size)
            if rate > SLOW_REFINEMENT:
                break
        return last

    def _product(self, x: Vector) -> Vector:
        product = self._times(x)
        product += self._D * x
        return product

    def _norm(self, v: Vector) -> float:
        return float(np.abs(self._weights * v).max(initial=0.0))


# Relative to mu: the smallest target of a step, so that products s w do not vanish one
# before another.
MIN_SIGMA = 1e-6
CORRECTORS = 2  # of Gondzio's, at most
# The smallest gain in step length for which a corrector is worthwhile, and the one
# aimed at.
WORTH_GAIN, ASPIRED_GAIN = 0.01, 0.3
# The factor between products s w and their target beyond which they are corrected.
PRODUCT_SPREAD = 10.0
# Lengths of a step: long enough without correctors; so short that centring is needed.
GOOD_LENGTH, SHORT_LENGTH = 0.95, 0.1
SAFE_SIGMA = 0.5  # relative to mu: the target of a step that only centres
# Fraction of the longest step that is taken, at least, so that s and w stay positive.
BOUNDARY_SHARE = 0.995
TINY = 1e-30  # the smallest s and w, so that ratios of them are finite
# Residual of a system relative to the infeasibility, which a step then reduces hardly
# less than an exact one.
SYSTEM_ACCURACY = 1e-2
# Residual of a system relative to mu, and to the mu aimed at: more accuracy gains
# nothing.
MU_ACCURACY, AIM_ACCURACY = 0.1, 100.0


@dataclass(frozen=True, eq=False)
class PrimalDualPoint:
    """z of shape (n,), or in double-double; slacks s and multipliers w of the finite
    bounds, first the lower ones, all positive. It may also be a direction, the change
    of a point in a step of length 1."""

    z: Any
    s: Vector
    w: Vector


class PredictorCorrector:
    """The steps on one scaled problem. pairs : the number of its finite bounds."""

    # Steps are computed up to this length; one that long is cut to 1.
    max_length = max_boundary_fraction = 1.0
    tiny = TINY

    def __init__(self, within: SlackForm, systems: Any) -> None:
        self.problem = within.problem
        self._systems = systems
        self._times = multiplier(within.problem.M)
        self._index = np.concatenate((within.low, within.high))
        self.pairs = self._index.size
        self._sign = np.where(np.arange(self.pairs) < within.low.size, 1.0, -1.0)
        lower, upper = self.problem.box.vectors(self.problem.n)
        self._bound = np.concatenate((lower[within.low], upper[within.high]))
        _, low, high = np.intersect1d(within.low, within.high, return_indices=True)
        # The positions of both bounds of each variable that has two.
        self._partners = low, high + within.low.size
        self._measured: tuple[PrimalDualPoint, tuple[Vector, Vector, float]] | None = (
            None
        )

    @np.errstate(all="ignore")
    def start(self, slack: float) -> PrimalDualPoint:
        """Return a z close to the reference point, with slacks and multipliers of at
        least `slack`.

        Mehrotra's start: (M + D) z = -q + D mid(l, u, 0), D = 1 for bounded variables;
        slacks from z and multipliers from w, shifted to be positive.
        """
        p = self.problem
        D = np.zeros(p.q.size)
        D[self._index] = 1.0
        z = self._solution(D)
        s = self._sign * (z[self._index] - self._bound)
        w = np.maximum(self._sign * (p.M @ z + p.q)[self._index], 0.0)
        if not self.pairs:
            return PrimalDualPoint(z, s, w)
        s, w = (v + max(0.0, -1.5 * float(v.min())) for v in (s, w))
        product = max(float(s @ w), 1e-8 * self.pairs)
        min_s, min_w = (0.5 * product / max(float(v.sum()), 1e-8) for v in (w, s))
        return PrimalDualPoint(z, s + max(min_s, slack), w + max(min_w, slack))

    def _solution(self, D: Vector) -> Any:
        """Return the solution of (M + D) z = -q + D mid(l, u, 0)."""
        p = self.problem
        self._systems.factorize(D)
        return self._systems.solve(D * p.box.project(np.zeros(p.n)) - p.q)[0]

    def residuals(self, at: PrimalDualPoint) -> tuple[Vector, Vector, float]:
        """Return M z + q minus the multipliers, the distances to the bounds minus the
        slacks, and the largest of these numbers; those of the last point are cached."""
        if self._measured is None or self._measured[0] is not at:
            dual = self._image(at.z)
            dual -= self._spread(self._sign * at.w)
            primal = self._beyond(at)
            largest = max(float(np.abs(r).max(initial=0.0)) for r in (dual, primal))
            self._measured = at, (dual, primal, largest)
        return self._measured[1]

    def _image(self, z: Any) -> Vector:
        """Return M z + q."""
        image = self._times(z)
        image += self.problem.q
        return image

    def _beyond(self, at: PrimalDualPoint) -> Vector:
        """Return the distances to the bounds minus the slacks."""
        distances: Vector = self._sign * (at.z[self._index] - self._bound)
        return distances - at.s

    def mu(self, at: PrimalDualPoint) -> float:
        return float(at.s @ at.w) / max(self.pairs, 1)

    def gap_size(self, at: PrimalDualPoint) -> float:
        """Return the size of the terms of the gap, including the terms of q'z that
        cancel."""
        terms = self.problem.q * at.z
        sums = float(terms[terms > 0].sum()), -float(terms[terms < 0].sum())
        return max(1e-10, *sums, abs(float((self._sign * self._bound) @ at.w)))

    @np.errstate(all="ignore")
    def next(
        self, at: PrimalDualPoint
    ) -> tuple[PrimalDualPoint, float, PrimalDualPoint]:
        """Return the next point, the step length and the direction."""
        ratio = at.w / at.s
        pairs = self.pairs
        mu = self.mu(at)
        self._systems.factorize(self._spread(ratio))
        absorbing, (dual, primal, largest) = self._absorbing(ratio), self.residuals(at)

        def direction(aim: float, products: Vector) -> PrimalDualPoint:
            """Return Newton's direction, which removes the residuals and changes s w by
            `products`, to first order; the residual of the system, which multipliers
            absorb in part, is negligible relative to the mu that is aimed at."""
            change = products / at.s
            b = self._spread(self._sign * (change - ratio * primal)) - dual
            z, residual = self._systems.solve(b, self._accuracy(largest, mu, aim))
            ds = self._sign * self._at_bounds(z) + primal
            change -= ratio * ds
            change += absorbing * residual[self._index]
            return PrimalDualPoint(z, ds, change)

        affine = direction(mu, -at.s * at.w)
        if not pairs:
            return self._moved(at, affine, 1.0), 1.0, affine
        length = min(self._longest(at, affine), 1.0)
        after = float((at.s + length * affine.s) @ (at.w + length * affine.w)) / pairs
        sigma = max(min(max(after, 0.0) / mu, 1.0) ** 3, MIN_SIGMA)
        target = sigma * mu
        # By Mehrotra's direction, and then Gondzio's corrections.
        wanted = target - at.s * at.w - affine.s * affine.w
        step_direction = direction(target, wanted)
        step = self._longest(at, step_direction)
        for _ in range(CORRECTORS):
            if step > GOOD_LENGTH:
                break
            goal = min(1.0, step + ASPIRED_GAIN)
            s, w = at.s + goal * step_direction.s, at.w + goal * step_direction.w
            lowest, highest = target / PRODUCT_SPREAD, target * PRODUCT_SPREAD
            correction = np.clip(s * w, lowest, highest) - s * w
            more = wanted + np.maximum(correction, -PRODUCT_SPREAD * target)
            other = direction(target, more)
            if self._longest(at, other) < step + WORTH_GAIN:
                break
            step_direction = other
            step = self._longest(at, other)
            wanted = more
        if step < SHORT_LENGTH and step < 0.5 * length:
            target = max(sigma, SAFE_SIGMA) * mu
            central = direction(target, target - at.s * at.w)
            if self._longest(at, central) > step:
                step_direction, step = central, self._longest(at, central)
        if step < self.max_length:
            fraction = min(max(BOUNDARY_SHARE, 1.0 - mu), self.max_boundary_fraction)
            step = min(1.0, fraction * step)
        else:
            step = 1.0
        return self._moved(at, step_direction, step), step, step_direction

    def _moved(
        self, at: PrimalDualPoint, along: PrimalDualPoint, step: float
    ) -> PrimalDualPoint:
        s, w = (
            np.maximum(v + step * d, self.tiny)
            for v, d in ((at.s, along.s), (at.w, along.w))
        )
        if not (np.isfinite(s).all() and np.isfinite(w).all()):
            raise SingularMatrix
        return PrimalDualPoint(at.z + step * along.z, s, w)

    def _accuracy(self, infeasibility: float, mu: float, aim: float) -> float:
        """Return the residual that a system for a direction may leave."""
        return max(
            SYSTEM_ACCURACY * infeasibility, min(MU_ACCURACY * mu, AIM_ACCURACY * aim)
        )

    def _at_bounds(self, z: Any) -> Vector:
        """Return for each bound the component of z that it is of."""
        return np.asarray(z[self._index])

    def _longest(self, at: PrimalDualPoint, along: PrimalDualPoint) -> float:
        """Return the longest step, at most `max_length`, that keeps s and w
        nonnegative."""
        fastest = min(
            float((d / v).min(initial=-1.0 / self.max_length))
            for v, d in ((at.s, along.s), (at.w, along.w))
        )
        return -1.0 / fastest

    def _spread(self, values: Vector) -> Vector:
        """Return the sum, for each variable, of values that belong to its bounds."""
        return np.asarray(
            np.bincount(self._index, values, self.problem.q.size).astype(
                float, copy=False
            )
        )

    def _absorbing(self, ratio: Vector) -> Vector:
        """Return for each bound minus its sign if it is the closer one and its
        multiplier absorbs the residual of a system; else 0."""
        other = np.zeros(ratio.size)
        low, high = self._partners
        other[low], other[high] = ratio[high], ratio[low]
        nearer = (ratio > other) | ((ratio == other) & (self._sign > 0))
        return np.where((ratio > 1.0) & nearer, -self._sign, 0.0)
