"""The smoothed equation F~(p, x) = 0 of El foutayeni and Khaladi (2012, section 4), and its line search.

With phi(x) = ln(1 + e^(px) + e^(-px)) / p in place of |x|,

    F~(p, x) = (M + I) x + (M - I) phi(x) + q = M z~ - w~ + q,    z~ = phi(x) + x,    w~ = phi(x) - x.

Let t = |x|, a = e^(-pt) and delta = phi - t = ln(1 + a + a^2) / p, which lies between 0 and ln(3) / p. Then
z~ = 2 max(x, 0) + delta, w~ = 2 max(-x, 0) + delta and phi' = sign(x) (1 - a^2) / (1 + a + a^2), without
overflow or cancellation. Where p t > WINDOW, a is zero in double precision and phi is |x| itself, so exponentials are
taken only for the few components within that window.

With bounds, an extension: z = mid(l, u, 2x) is a sum of such moduli, l/2 + x + |x - l/2| for a lower bound alone,
(l + u)/2 + |x - l/2| - |x - u/2| for a box, and each is smoothed like |x|, so that w~ = z~ - 2x and
z~ = mid(l, u, 2x) + delta_l - delta_u; an infinite bound has no delta. The bound on the smoothing error remains valid.

The line search satisfies the two conditions of step 2.7, the weak Wolfe conditions, in finitely many trials. With f
along the direction s from x, d = -grad f(x) and D = <d, s> > 0,

    f(x + gamma s) <= f(x) - gamma rho D        (sufficient decrease)
    <grad f(x + gamma s), s> >= -sigma D        (curvature).

A trial is accepted or becomes an end of the bracket: the upper one if it violates the decrease, the lower one if it
satisfies the decrease but not the curvature. The bracket expands while it has no upper end; from then on each pair of
trials at least halves it. Between the halvings the minimizer of a parabola that interpolates f is tried, which is exact
if f is quadratic (Nocedal and Wright 2006, section 3.5). Gradients are computed only where the decrease holds.

The merit function of Fischer and Burmeister, half the square of Phi, whose zeros are the solutions.

With phi(a, b) = a + b - (a^2 + b^2 + 2 mu)^(1/2) and mu = 0, Phi_i is phi(z_i - l_i, F_i) where z_i has a lower bound
only, -phi(u_i - z_i, -F_i) with an upper bound only, phi(z_i - l_i, -phi(u_i - z_i, -F_i)) with both, F_i with neither,
and z_i - l_i where these are equal. A. Fischer, A special Newton-type optimization method, Optimization 24 (1992)
269-284; S. C. Billups, Algorithms for complementarity problems and generalized equations, thesis (1995). A zero of its
gradient may be no solution. With mu > 0, Phi is smooth, and its zeros tend to a solution as mu tends to 0: C. Kanzow,
Some noninterior continuation methods for linear complementarity problems, SIAM J. Matrix Anal. Appl. 17 (1996) 851-868.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from lcpcli.clock import imports
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import is_finite
from lcpcli.linalg.factors import PrincipalSolver, SingularMatrix
from lcpcli.linalg.matrices import is_sparse, plus_diagonal, row_maxima
from lcpcli.model.box import BASIC, Box
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Matrix, Vector

NO_INDICES = np.empty(0, dtype=np.intp)
WINDOW = 746.0  # e^-746 is zero in double precision, denormals included
MAX_TRIALS = 200  # of one line search, which halves the bracket: far more than a double has digits
SHORT_STEP = 1e-6  # relative to the first trial length: for shorter trials, whether x changes at all is checked


def error(problem: Problem, p: float) -> float:
    """Return the bound (ln 3 / p) |M - I|_inf of |F~ - F|, in units of q."""
    with np.errstate(over="ignore"):
        return math.log(3) / p * matrices.norm_inf(matrices.plus_diagonal(problem.M, -1.0))


def excess(p: float, t: Vector) -> Vector:
    """Return delta = phi - |x| at t = |x| >= 0, for p t <= WINDOW; it lies between 0 and ln(3) / p."""
    a = np.exp(-p * t)
    return np.asarray(np.log1p(a + a * a) / p)


def slope(p: float, x: Vector) -> Vector:
    """Return phi'(x) = (e^(px) - e^(-px)) / (1 + e^(px) + e^(-px)) for p |x| <= WINDOW; it lies between -1 and 1."""
    b = -np.expm1(-p * np.abs(x))  # 1 - a, without cancellation near 0
    return np.asarray(np.copysign(b * (2 - b) / (3 - (3 - b) * b), x))


@dataclass(frozen=True, eq=False)
class SmoothedPoint:
    """F~ and f = |F~|^2 / 2 at one x, each vector of shape (n,); window holds the indices of smoothed components."""

    x: Vector
    F: Vector
    f: float
    window: Indices


class Smoothed:
    """F~ of one problem for one p > 0."""

    def __init__(self, problem: Problem, p: float) -> None:
        self._problem, self._p = problem, p
        self._ends = [end / 2 for end in problem.box.vectors(problem.n)]
        self._kinks = [(s, end) for s, end in zip((1.0, -1.0), self._ends, strict=True) if np.isfinite(end).any()]

    def split(self, x: Vector) -> tuple[Vector, Vector, Indices]:
        """Return z~ and w~, each of shape (n,), and the indices for which p |x_i - l_i / 2| or p |x_i - u_i / 2| is
        at most WINDOW."""
        t, half_width = x + x, WINDOW / self._p
        z: Vector = self._problem.box.project(t)
        w = np.subtract(z, t, out=t)
        near = [np.abs(x - kink) for _, kink in self._kinks]
        distance = near[0] if len(near) == 1 else np.minimum.reduce(near, initial=np.inf)
        window = np.flatnonzero(distance <= half_width) if distance.min() <= half_width else NO_INDICES
        if window.size:
            delta = sum(s * excess(self._p, t[window]) for (s, _), t in zip(self._kinks, near, strict=True))
            z[window] += delta
            w[window] += delta
        return z, w, window

    def at(self, x: Vector) -> SmoothedPoint:
        """Return F~ and f at x, with one product with M; f is infinite if it overflows."""
        z, w, window = self.split(x)
        F = matrices.product(self._problem.M, z)
        F -= w
        F += self._problem.q
        with np.errstate(over="ignore"):
            f = 0.5 * float(F @ F)
        return SmoothedPoint(x, F, f, window)

    def gradient(self, point: SmoothedPoint) -> Vector:
        """Return the gradient of f, J' F~ = 2 (F~ + h (y - F~)), y = M' F~, with one product with M'.

        h = (1 + phi') / 2, half the derivative of z~; with bounds (phi'(x - l/2) - phi'(x - u/2)) / 2.
        """
        y = matrices.product(self._problem.M.T, point.F)
        y -= point.F
        window = point.window
        low, high = (slope(self._p, point.x[window] - end[window]) for end in self._ends)
        inner = 0.5 * (low - high) * y[window]
        y *= self._problem.box.basis_of(point.x) == BASIC
        y[window] = inner
        y += point.F
        y *= 2
        return y


@dataclass
class Bracket:
    """Lengths low < high between which both conditions can be satisfied; f and its slope at low, f at high."""

    low: float
    f_low: float
    slope_low: float
    high: float = math.inf
    f_high: float = math.inf
    halve: bool = False

    def raise_low(self, gamma: float, f: float, slope: float) -> None:
        self.halve = gamma - self.low < 0.5 * (self.high - self.low)
        self.low, self.f_low, self.slope_low = gamma, f, slope

    def cut_high(self, gamma: float, f: float) -> None:
        self.halve = gamma - self.low > 0.5 * (self.high - self.low)
        self.high, self.f_high = gamma, f

    def next_trial(self, slope_start: float) -> float:
        if self.high == math.inf:
            flattening = self.slope_low / slope_start
            return self.low * (min(max(1 / (1 - flattening), 2.0), 10.0) if flattening < 1 else 10.0)
        width = self.high - self.low
        bend = self.f_high - self.f_low - self.slope_low * width
        inner = self.low - 0.5 * self.slope_low * width * (width / bend) if 0 < bend < math.inf else self.low
        if self.halve or not self.low < inner < self.high:
            return self.low + 0.5 * width
        return inner


def search(
    smoothed: Smoothed, start: SmoothedPoint, s: Vector, slope: float, gamma: float, rho: float, sigma: float
) -> tuple[SmoothedPoint, Vector, int] | int:
    """Return the end of the step from start along s, where f has the slope <grad f, s> < 0, with first trial length
    gamma > 0, the gradient of f there, and the number of lengths tried; only that number if they become
    too short to change x: the decrease is below rounding.
    """
    bracket, first = Bracket(0.0, start.f, slope), gamma
    for trial in range(1, MAX_TRIALS + 1):
        x = gamma * s
        x += start.x
        point = smoothed.at(x)
        if not point.f <= start.f + gamma * rho * slope:
            if gamma < SHORT_STEP * first and np.array_equal(x, start.x):
                break
            bracket.cut_high(gamma, point.f)
        else:
            g = smoothed.gradient(point)
            slope_here = float(g @ s)
            if slope_here >= sigma * slope:
                return point, g, trial
            bracket.raise_low(gamma, point.f, slope_here)
        gamma = bracket.next_trial(slope)
    return trial


DAMPING = 1e-6  # of Newton steps where their matrix is singular, relative to it


def phi(box: Box, z: Vector, F: Vector, mu: float = 0.0) -> Vector:
    """Return Phi at an admissible z, shape (n,)."""
    below, above = np.isfinite(box.lower), np.isfinite(box.upper)
    upper = np.where(above, -_phi(np.where(above, box.upper - z, 0.0), -F, mu), F)
    both = np.where(below, _phi(np.where(below, z - box.lower, 0.0), upper, mu), upper)
    return np.where(box.fixed, z - box.lower, both)


def slopes(box: Box, z: Vector, F: Vector, J: Matrix, mu: float = 0.0) -> Matrix:
    """Return the Jacobian of Phi, where mu = 0 an element of the generalized one, dense or a csr array."""
    below, above = np.isfinite(box.lower), np.isfinite(box.upper)
    gap = np.where(above, box.upper - z, 0.0)
    upper = np.where(above, -_phi(gap, -F, mu), F)
    by_gap, by_F = (
        np.where(above, slope, other) for slope, other in zip(_slopes(gap, -F, mu), (0.0, 1.0), strict=True)
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
    """Return phi(a, b), for a, b > 0 without cancellation."""
    root = _root(a, b, mu)
    both = (a > 0) & (b > 0)
    sums = np.where(both, a + b + root, 1.0)
    return np.where(both, 2 * a * (b / sums) - 2 * mu / sums, a + b - root)


def _slopes(a: Vector, b: Vector, mu: float) -> tuple[Vector, Vector]:
    """Return the derivatives of phi by a and b; where both are 0, those in the direction (1, 1)."""
    root = _root(a, b, mu)
    zero = root == 0
    root = np.where(zero, 1.0, root)
    kink = 1.0 - 0.5**0.5
    return np.where(zero, kink, 1.0 - a / root), np.where(zero, kink, 1.0 - b / root)


@np.errstate(all="ignore")
def newton_direction(G: Matrix, values: Vector, gradient: Vector) -> Vector | None:
    """Return the Newton step of Phi or, where its matrix is singular or the step is not one of descent, the step of
    Levenberg and Marquardt; None if neither exists."""
    everything = np.arange(values.size)
    with suppress(SingularMatrix):
        d = PrincipalSolver(G).solve(everything, -values)
        if float(gradient @ d) < 0:
            return d
    H = G.T @ G
    shift = DAMPING * float(row_maxima(H).max(initial=0.0))
    with suppress(SingularMatrix):
        d = PrincipalSolver(plus_diagonal(H.tocsr() if is_sparse(H) else H, shift)).solve(everything, -gradient)
        return d if is_finite(d) and float(gradient @ d) < 0 else None
    return None
