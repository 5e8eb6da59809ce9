"""The linear systems of the interior point method's steps.

The systems (M + D) x = b are solved more accurately than by their regularized factors, of M + D + rho, alone:
refinement removes rho, and where it converges slowly, GMRES takes over, with the factors as its preconditioner.
rho grows where the factors themselves are poor, and shrinks where rho itself slows refinement.

The steps of the interior point method.

Mehrotra's predictor and corrector with Gondzio's further correctors, from infeasible points: S. Mehrotra, On the
implementation of a primal-dual interior point method, SIAM J. Optim. 2 (1992) 575-601; J. Gondzio, Multiple centrality
corrections in a primal-dual method for linear programming, Comput. Optim. Appl. 6 (1996) 137-156.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.krylov import gmres
from lcpcli.linalg.matrices import multiplier
from lcpcli.linalg.shifted_systems import Systems
from lcpcli.methods.interior_scaling import SlackForm
from lcpcli.typing import Matrix, Vector

SYSTEM_REFINEMENTS = 8  # each costs a solve; GMRES takes over if they are not enough
SLOW_REFINEMENT = 0.3  # the factor per refinement above which GMRES takes over
LEAST_ACCURACY = 1e-13  # of a solution, relative to the right-hand side: more is out of reach in doubles
DOUBTFUL_RESIDUAL = 1e-5  # relative to the right-hand side: refinement that leaves more calls for a smaller rho
POOR_FACTORS, USELESS_FACTORS = 1e-7, 1e-2  # the same of the factors: a larger rho next time, or at once
GMRES_STEPS = 8  # at most


@dataclass
class Regularization:
    """The regularization rho, with its range."""

    rho: float = 1e-8
    least: float = 1e-13
    most: float = 1e-7


class AccurateSystems:
    """Systems with one M and its regularization; `solve` also returns the residual that is left."""

    def __init__(self, M: Matrix, systems: Systems, regularization: Regularization) -> None:
        self._times, self._systems, self.regularization = multiplier(M), systems, regularization
        self._of_factors = self._left = 0.0
        self._used_gmres = False

    def factorize(self, D: Vector) -> None:
        """Adapt rho to the last systems, and factorize M + D + rho."""
        own = self.regularization
        if self._of_factors > POOR_FACTORS:
            own.rho = min(own.rho * 10, own.most)
        elif self._used_gmres or self._left > DOUBTFUL_RESIDUAL:
            own.rho = max(own.rho / 10, own.least)
        self._of_factors, self._left, self._used_gmres = 0.0, 0.0, False
        self._D, self._weights = D, 1.0 / (1.0 + D)
        self._systems.factorize(D + own.rho)

    def solve(self, b: Vector, target: float = 0.0) -> tuple[Vector, Vector]:
        """Return x and b - (M + D) x, whose weighted norm is at most the target, or LEAST_ACCURACY times the norm of
        b, if that can be attained."""
        size, own = self._norm(b) + 1e-300, self.regularization
        goal = max(LEAST_ACCURACY * size, target)
        x, r, of_factors = self._first(b)
        while not of_factors <= USELESS_FACTORS * size and own.rho < own.most:
            own.rho = own.least = min(own.rho * 10, own.most)  # from now on the least one
            self._systems.factorize(self._D + own.rho)
            x, r, of_factors = self._first(b)
        if not np.isfinite(of_factors):
            raise SingularMatrix
        self._of_factors = max(self._of_factors, of_factors / size)
        x, r, left = self._refined(x, r, b, goal)
        if left > max(10 * goal, DOUBTFUL_RESIDUAL * size):
            x, r, left = self._by_gmres(x, r, b, goal)
        if left > 10 * goal:
            self._left = max(self._left, left / size)
        return x, r

    def _first(self, b: Vector) -> tuple[Vector, Vector, float]:
        """Return the x of the factors, its residual, and the norm of its residual in the factors' own system."""
        x = self._systems.solve(b)
        r = b - self._product(x)
        return x, r, self._norm(r - self.regularization.rho * x)

    def _refined(self, x: Vector, r: Vector, b: Vector, goal: float) -> tuple[Vector, Vector, float]:
        left = self._norm(r)
        for _ in range(SYSTEM_REFINEMENTS):
            if left <= goal:
                break
            better = x + self._systems.solve(r)
            residual = b - self._product(better)
            size = self._norm(residual)
            if not size < left:
                break
            rate, x, r, left = size / left, better, residual, size
            if rate > SLOW_REFINEMENT:
                break
        return x, r, left

    def _by_gmres(self, x: Vector, r: Vector, b: Vector, goal: float) -> tuple[Vector, Vector, float]:
        """Return x, its residual and the norm of the residual after at most GMRES_STEPS."""
        self._used_gmres, weights = True, self._weights
        better = x + gmres(
            lambda v: weights * self._product(v),
            weights * r,
            GMRES_STEPS,
            lambda v: self._systems.solve(v / weights),
            0.1 * goal,
        )
        residual = b - self._product(better)
        size, left = self._norm(residual), self._norm(r)
        return (better, residual, size) if size < left else (x, r, left)

    def _product(self, x: Vector) -> Vector:
        product = self._times(x)
        product += self._D * x
        return product

    def _norm(self, v: Vector) -> float:
        return float(np.abs(self._weights * v).max(initial=0.0))


LEAST_SIGMA = 1e-6  # of mu: the smallest target of a step, so that products s w do not vanish one before another
CORRECTORS = 2  # of Gondzio's, at most
WORTH_GAIN, ASPIRED_GAIN = 0.01, 0.3  # the least gain in step length that a corrector is worth, and the one aimed at
PRODUCT_SPREAD = 10.0  # the factor between products s w and their target beyond which they are corrected
GOOD_LENGTH, SHORT_LENGTH = 0.95, 0.1  # of a step: long enough without correctors; so short that centring is needed
SAFE_SIGMA = 0.5  # of mu: the target of a step that only centres
BOUNDARY_SHARE = 0.995  # of the longest step: so far it goes at least, so that s and w stay positive
TINY = 1e-30  # the least s and w, so that ratios of them are finite
SYSTEM_ACCURACY = 1e-2  # relative to the infeasibility: a step reduces it hardly less than an exact one
MU_ACCURACY, AIM_ACCURACY = 0.1, 100.0  # relative to mu, and to the mu aimed at: more accuracy gains nothing


@dataclass(frozen=True, eq=False)
class PrimalDualPoint:
    """z of shape (n,); slacks s and multipliers w of the finite bounds, first the lower ones, all positive. It may also
    be a direction, the change of a point in a step of length 1."""

    z: Vector
    s: Vector
    w: Vector


class Residuals(NamedTuple):
    """M z + q minus the multipliers; the distances to the bounds minus the slacks; the largest of these numbers."""

    dual: Vector
    primal: Vector
    largest: float


class Steps:
    """The steps on one scaled problem. pairs : the number of its finite bounds."""

    def __init__(self, within: SlackForm, systems: AccurateSystems) -> None:
        self.problem, self._systems, self._times = within.problem, systems, multiplier(within.problem.M)
        self.pairs, self._index = within.pairs, np.concatenate((within.low, within.high))
        self._sign = np.where(np.arange(self.pairs) < within.low.size, 1.0, -1.0)
        lower, upper = self.problem.box.vectors(self.problem.n)
        self._bound = np.concatenate((lower[within.low], upper[within.high]))
        _, low, high = np.intersect1d(within.low, within.high, return_indices=True)
        self._partners = low, high + within.low.size  # the places of both bounds of each variable with two
        self._measured: tuple[PrimalDualPoint, Residuals] | None = None

    @np.errstate(all="ignore")
    def start(self, slack: float) -> PrimalDualPoint:
        """Return a z near the reference point, with slacks and multipliers of at least `slack`.

        Mehrotra's start: (M + D) z = -q + D mid(l, u, 0), D = 1 for bounded variables; slacks from z and multipliers
        from w, shifted to be positive.
        """
        p = self.problem
        near = p.box.project(np.zeros(p.n))
        D = np.zeros(p.q.size)
        D[self._index] = 1.0
        self._systems.factorize(D)
        z, _ = self._systems.solve(D * near - p.q)
        s = self._sign * (z[self._index] - self._bound)
        w = np.maximum(self._sign * (p.M @ z + p.q)[self._index], 0.0)
        if not self.pairs:
            return PrimalDualPoint(z, s, w)
        s, w = (v + max(0.0, -1.5 * float(v.min())) for v in (s, w))
        product = max(float(s @ w), 1e-8 * self.pairs)
        s_least, w_least = (0.5 * product / max(float(v.sum()), 1e-8) for v in (w, s))
        return PrimalDualPoint(z, s + max(s_least, slack), w + max(w_least, slack))

    def residuals(self, at: PrimalDualPoint) -> Residuals:
        """Return the residuals of a point; those of the last one are cached."""
        if self._measured is None or self._measured[0] is not at:
            dual = self._times(at.z)
            dual += self.problem.q
            dual -= self._spread(self._sign * at.w)
            primal = self._sign * (at.z[self._index] - self._bound) - at.s
            largest = max(float(np.abs(r).max(initial=0.0)) for r in (dual, primal))
            self._measured = at, Residuals(dual, primal, largest)
        return self._measured[1]

    def mu(self, at: PrimalDualPoint) -> float:
        """Return the mean of the products s w."""
        return float(at.s @ at.w) / max(self.pairs, 1)

    def gap_size(self, at: PrimalDualPoint) -> float:
        """Return the size of the terms of the gap, including the terms of q'z that cancel."""
        terms = self.problem.q * at.z
        parts = float(terms[terms > 0].sum()), -float(terms[terms < 0].sum())
        return max(1e-10, *parts, abs(float((self._sign * self._bound) @ at.w)))

    @np.errstate(all="ignore")
    def next(self, at: PrimalDualPoint) -> tuple[PrimalDualPoint, float, PrimalDualPoint]:
        """Return the next point, the step length and the direction."""
        ratio, pairs = at.w / at.s, self.pairs
        self._systems.factorize(self._spread(ratio))
        direction = partial(self._direction, at, ratio, self._absorbing(ratio))
        affine = direction(self.mu(at), -at.s * at.w)
        if not pairs:
            return self._moved(at, affine, 1.0), 1.0, affine
        mu, length = self.mu(at), longest(at, affine)
        after = float((at.s + length * affine.s) @ (at.w + length * affine.w)) / pairs
        sigma = max(min(max(after, 0.0) / mu, 1.0) ** 3, LEAST_SIGMA)
        found, step = self._corrected(direction, at, affine, sigma * mu)
        if step < SHORT_LENGTH and step < 0.5 * length:
            target = max(sigma, SAFE_SIGMA) * mu
            central = direction(target, target - at.s * at.w)
            if longest(at, central) > step:
                found, step = central, longest(at, central)
        step = min(1.0, max(BOUNDARY_SHARE, 1.0 - mu) * step) if step < 1.0 else 1.0
        return self._moved(at, found, step), step, found

    def _direction(
        self, at: PrimalDualPoint, ratio: Vector, absorbing: Vector, mu: float, products: Vector
    ) -> PrimalDualPoint:
        """Return Newton's direction, which removes the residuals and changes s w by `products`, to first order, with
        factors for `ratio`, w / s; `absorbing` is the share of the multipliers in the residual that the system leaves,
        which hardly counts beside the mu aimed at."""
        dual, primal, largest = self.residuals(at)
        change = products / at.s
        b = self._spread(self._sign * (change - ratio * primal)) - dual
        worth = min(MU_ACCURACY * self.mu(at), AIM_ACCURACY * mu)
        z, left = self._systems.solve(b, max(SYSTEM_ACCURACY * largest, worth))
        ds = self._sign * z[self._index] + primal
        change -= ratio * ds
        change += absorbing * left[self._index]
        return PrimalDualPoint(z, ds, change)

    def _corrected(
        self,
        direction: Callable[[float, Vector], PrimalDualPoint],
        at: PrimalDualPoint,
        affine: PrimalDualPoint,
        target: float,
    ) -> tuple[PrimalDualPoint, float]:
        """Return Mehrotra's direction to products s w of `target`, with Gondzio's corrections as long as they pay."""
        wanted = target - at.s * at.w - affine.s * affine.w
        found = direction(target, wanted)
        step = longest(at, found)
        for _ in range(CORRECTORS):
            if step > GOOD_LENGTH:
                break
            goal = min(1.0, step + ASPIRED_GAIN)
            products = (at.s + goal * found.s) * (at.w + goal * found.w)
            correction = np.clip(products, target / PRODUCT_SPREAD, target * PRODUCT_SPREAD) - products
            more = wanted + np.maximum(correction, -PRODUCT_SPREAD * target)
            other = direction(target, more)
            length = longest(at, other)
            if length < step + WORTH_GAIN:
                break
            found, step, wanted = other, length, more
        return found, step

    def _moved(self, at: PrimalDualPoint, along: PrimalDualPoint, step: float) -> PrimalDualPoint:
        s, w = (np.maximum(v + step * d, TINY) for v, d in ((at.s, along.s), (at.w, along.w)))
        if not (np.isfinite(s).all() and np.isfinite(w).all()):
            raise SingularMatrix
        return PrimalDualPoint(at.z + step * along.z, s, w)

    def _spread(self, values: Vector) -> Vector:
        """Return the sum, for each variable, of values that belong to its bounds."""
        return np.asarray(np.bincount(self._index, values, self.problem.q.size).astype(float, copy=False))

    def _absorbing(self, ratio: Vector) -> Vector:
        """Return minus the sign of each nearer bound whose multiplier absorbs what a system leaves; else 0."""
        other = np.zeros(ratio.size)
        low, high = self._partners
        other[low], other[high] = ratio[high], ratio[low]
        nearer = (ratio > other) | ((ratio == other) & (self._sign > 0))
        return np.where((ratio > 1.0) & nearer, -self._sign, 0.0)


def longest(at: PrimalDualPoint, along: PrimalDualPoint) -> float:
    """Return the longest step, at most 1, that keeps s and w nonnegative."""
    fastest = min(float((d / v).min(initial=-1.0)) for v, d in ((at.s, along.s), (at.w, along.w)))
    return -1.0 / fastest
