"""The smoothed vector-division method: Shi's secant method with descent safeguards,
applied to the LCP.

Y. El foutayeni and M. Khaladi, Using vector divisions in solving the linear
complementarity problem, Journal of Computational and Applied Mathematics 236 (2012)
1919-1925, section 4, after Y. Shi, Using vector divisions in solving nonlinear systems
of equations, International Journal of Contemporary Mathematical Sciences 3 (2008)
753-759. Steps are numbered as in the paper's algorithm.

With phi(x) = ln(1 + e^(px) + e^(-px)) / p instead of |x|,

    F~(p, x) = (M + I) x + (M - I) phi(x) + q = M z~ - w~ + q,
    z~ = phi(x) + x,    w~ = phi(x) - x.

For t = |x|, a = e^(-pt) and delta = phi - t = ln(1 + a + a^2) / p <= ln(3) / p there
are z~ = 2 max(x, 0) + delta, w~ = 2 max(-x, 0) + delta and phi' = sign(x) (1 - a^2) /
(1 + a + a^2), without overflow or cancellation. Where p t > WINDOW, a is zero in double
precision, so that exponentials are computed only for the few components within it.

With bounds, an extension: z = mid(l, u, 2x) is a sum of such moduli, l/2 + x + |x -
l/2| for a lower bound alone, (l + u)/2 + |x - l/2| - |x - u/2| for a box, and each is
smoothed like |x|, so that w~ = z~ - 2x and z~ = mid(l, u, 2x) + delta_l - delta_u; an
infinite bound has no delta. The bound on the smoothing error remains valid.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, TypeAlias

import numpy as np

from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import EPS
from lcpcli.linalg.krylov import safe_norm
from lcpcli.methods.registry import K_STAR, RHO, SIGMA, P
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import BASIC
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector

SELECTED = "1"
STEEPEST_AT_MULTIPLE = "2.2"
PLANE = "2.4"
AVERAGE = "2.5"
STEEPEST = "2.6"
SMOOTHED = 1e-3  # |F~| at a zero of F~, up to rounding, relative to the smoothing error
SMOOTHING = (
    "its smoothed equation is solved up to rounding; the remaining residual is the "
    "smoothing error"
)
LOWEST = "no step decreases |F~| any further in double precision"
STATIONARY = (
    "f = |F~|^2 / 2 is stationary at a point that is not a zero of F~: J is singular "
    "there"
)
UNDERFLOW = "|F~|^2 underflows; multiply q and the start by the same large number"
DESCENT = (SELECTED, STEEPEST_AT_MULTIPLE, STEEPEST)


def shi(
    problem: Problem,
    x0: Vector,
    *,
    x1: Vector | None = None,
    p: float | None = P.default,
    k_star: int = int(K_STAR.value),
    rho: float = RHO.value,
    sigma: float = SIGMA.value,
) -> Stage:
    """Solve F~(p, x) = 0 by descent on f = |F~|^2 / 2, along directions in the plane of
    F~ and the last step. The paper leaves the choice of x1 open; by default it comes
    from a steepest-descent step.

    In exact arithmetic, limit points of the steepest-descent steps are stationary
    points of f if its level sets are bounded; where J is nonsingular (for every
    P-matrix M) these are zeros of F~. In double precision a large p leaves kinks, at
    which descent may stall. A zero of F~ solves the LCP up to the smoothing error,
    |F - F~| <= (ln 3 / p) |M - I|_inf. An iteration costs a product with M for each
    trial of the line search and one with M' for each trial of sufficient decrease;
    nothing n-by-n is formed.

    Yields x1, x2, ... with F~ and the number of the step that produced it: "1"
    selected, "2.2" steepest descent at a multiple of k*, "2.4" best direction in the
    plane, "2.5" average, "2.6" steepest descent for lack of a descent direction, or
    because the line search after step 2.4 or 2.5 failed. Stalled : the decrease of f is
    below rounding, or F~ is zero up to rounding but the smoothing error is not, as p is
    small.
    """
    p, k_star = default_p(problem) if p is None else p, int(k_star)
    wolfe = WolfeConditions(rho, sigma)
    smoothed = Smoothed(problem, p)
    before: SmoothedPoint | None = None
    point = smoothed.at(x0)
    evaluations = 1
    if x1 is None:
        k, g = 0, smoothed.gradient(point)
        way = Direction(SELECTED, -g)
    else:
        k = 1
        before, point = point, smoothed.at(x1)
        evaluations += 1
        selected = partial(Selected, point, before)
        yield Iterate(point.x, point.F, SELECTED, evaluations, quantities=selected)
        g = smoothed.gradient(point)
        way = _select(k, k_star, point.F, x1 - x0, point.F - before.F, g)
    failed_trials = 0
    while point.f > 0:
        slope = float(g @ way.s)
        if not (math.isfinite(point.f) and math.isfinite(slope)):
            return Breakdown("|F~|^2 overflows; divide q and the start by their size")
        if slope == 0:
            return Breakdown(STATIONARY)
        # A parabola with this slope has its minimum 0 there.
        first_trial = -2 * point.f / slope
        outcome = search(smoothed, point, way.s, slope, first_trial, wolfe)
        if isinstance(outcome, int):
            if way.step in DESCENT:
                return _smoothed_solution(problem, p, point.F) or Stalled(LOWEST)
            evaluations += outcome
            failed_trials += outcome
            # F rises along s, by a kink or rounding: only d remains.
            way = way._replace(step=STEEPEST, s=-g, alpha=None, multiple=None)
            continue
        evaluations += outcome.trials
        if failed_trials:
            outcome = outcome._replace(trials=outcome.trials + failed_trials)
            failed_trials = 0
        step = partial(Step, way, (before, point), g, slope, outcome)
        before, point, g = point, outcome.point, outcome.gradient
        k += 1
        yield Iterate(point.x, point.F, way.step, evaluations, quantities=step)
        way = _select(k, k_star, point.F, way.s, point.F - before.F, g)
    if point.F.any():
        return Breakdown(UNDERFLOW)
    return _smoothed_solution(problem, p, point.F) or Finished()


def default_p(problem: Problem) -> float:
    """Return the p for which the smoothing error (ln 3 / p) (1 + |M|_inf) is the
    rounding error of q, eps |q|_inf."""
    scale = problem.sizes_of_q[1] or 1.0
    return min(math.log(3) * (1 + matrices.norm_inf(problem.M)) / EPS / scale, 1e300)


def _smoothed_solution(problem: Problem, p: float, F: Vector) -> Stalled | None:
    """Return the ending at a zero of F~ if the residual is only the smoothing error,
    and exceeds rounding; else None."""
    default, bound = default_p(problem), error(problem, p)
    if p >= default or np.max(np.abs(F)) > SMOOTHED * bound:
        return None
    at_most = f"(ln 3 / p) |M - I| = {bound:.2g} for p = {p:g} (default {default:.2g})"
    return Stalled(f"{SMOOTHING}, in F at most {at_most}")


class Direction(NamedTuple):
    """The direction of a step.

    step : the number of the step of the paper's algorithm that sets it.
    s : shape (n,); a positive multiple of the paper's s.
    alpha : that of step 2.4, +-infinity where s = +-(u - v), and nan where s = +-F~, as
        xi_1 is infinite, or F~ and v are parallel; None elsewhere.
    multiple : s = multiple / |u| times the paper's s, or 1 / |F~| times it if alpha is
        nan; None where s is the paper's.
    cosines : cos(dx, y) and cos(y, F~) of step 2.3, which decide the signs of xi_1 and
        xi_2; None where they are not computed.
    """

    step: str
    s: Vector
    alpha: float | None = None
    multiple: float | None = None
    cosines: tuple[float, float] | None = None


def _select(
    k: int, k_star: int, F: Vector, v: Vector, y: Vector, g: Vector
) -> Direction:
    if k % k_star == 0:
        return Direction(STEEPEST_AT_MULTIPLE, -g)
    return direction(F, v, y, g)


def direction(F: Vector, v: Vector, y: Vector, g: Vector) -> Direction:
    """Take steps 2.3 to 2.6: return the direction s, with <s, g> < 0 unless g = 0.

    Each of shape (n,): F = F~(x_k), v = x_k - x_(k-1) or a positive multiple of it, y =
    F~(x_k) - F~(x_(k-1)) and g = grad f(x_k) = -d. v and y are overwritten.

    Step 2.3 takes u = xi_1 F and xi_2 v with xi_1 = -|v|^2 / <v, y> and xi_2 = -<y, F>
    / |y|^2. As the line search makes the length of s irrelevant, both may be divided by
    the same positive number, |u|, so that neither can overflow: up to this, they are mu
    F / |F| and nu v / |v| with mu = -sign <v, y> and nu = -cos(y, F) |cos(v, y)|.
    """
    size_F = math.sqrt(float(F @ F))
    size_v = math.sqrt(float(v @ v))
    size_y = math.sqrt(float(y @ y))
    if 0 in (size_F, size_v, size_y):
        return Direction(STEEPEST, -g)
    cosines = cos_vy, cos_yF = (
        float(v @ y) / size_v / size_y,
        float(y @ F) / size_y / size_F,
    )
    mu, nu = -math.copysign(1.0, cos_vy), -cos_yF * abs(cos_vy)
    cos_Fv = float(F @ v) / size_F / size_v
    step, a, b, alpha, multiple = combine(
        mu, nu, cos_Fv, -float(F @ g) / size_F, -float(v @ g) / size_v
    )
    if step == STEEPEST:
        return Direction(STEEPEST, -g, cosines=cosines)
    s = np.multiply(F, a / size_F, out=y)
    v *= b / size_v
    s += v
    if not float(s @ g) < 0:
        return Direction(STEEPEST, -g, cosines=cosines)
    return Direction(step, s, alpha if cos_vy else math.nan, multiple, cosines)


Combination: TypeAlias = tuple[str, float, float, float | None, float]


def combine(mu: float, nu: float, cosine: float, F_d: float, v_d: float) -> Combination:
    """Take steps 2.4 to 2.6 for F and v of length 1 with that cosine: return the step,
    a, b of s = a F + b v, and alpha and `multiple` as in `Direction`.

    u = mu F and nu v, both divided by |u|, span the candidates alpha u + (1 - alpha) nu
    v; F_d and v_d are <F, d> and <v, d>. The projection of d onto the plane of F and v
    has the largest cosine with d; it is a candidate up to scaling if its coordinates
    along u and nu v have a positive sum. Otherwise the cosine approaches its supremum
    as alpha -> +-infinity, along sign <u - nu v, d> (u - nu v). (The printed bound on
    alpha is the descent condition for <u - nu v, d> > 0; for < 0 the inequality is
    reversed.) If F and v are parallel, all descent candidates have the same cosine:
    alpha is 1 if u is one of them.
    """
    u_d, w_d = mu * F_d, nu * v_d
    if abs(u_d - w_d) <= 8 * EPS * (abs(u_d) + abs(w_d)):
        if w_d > 0:  # (u + nu v) / 2 is half of this
            return AVERAGE, mu, nu, None, 2.0
        return STEEPEST, 0.0, 0.0, None, 1.0
    squared_sine = (1 - cosine) * (1 + cosine)
    if squared_sine <= 8 * EPS:
        alpha = 1.0 if u_d > 0 else math.nan
        return PLANE, math.copysign(1.0, F_d), 0.0, alpha, 1.0
    a, b = (F_d - cosine * v_d) / squared_sine, (v_d - cosine * F_d) / squared_sine
    sign = math.copysign(1.0, u_d - w_d)
    if nu == 0:  # v = 0, and all candidates that descend have the direction of +-u
        return PLANE, sign * mu, -sign * nu, 1.0 if sign > 0 else -math.inf, 1.0
    along_u, along_v = a / mu, b / nu
    both = along_u + along_v
    if both <= 0:
        return PLANE, sign * mu, -sign * nu, sign * math.inf, 1.0
    return PLANE, a, b, along_u / both, both


class Selected:
    """The quantities of a point that no line search has produced. before : the
    point before it."""

    def __init__(
        self, point: SmoothedPoint, before: SmoothedPoint | None = None
    ) -> None:
        self._point, self._from = point, before

    @property
    def of_start(self) -> Selected | None:
        return None if self._from is None else Selected(self._from)

    @property
    def f(self) -> float:
        return self._point.f

    @property
    def F(self) -> float:
        return safe_norm(self._point.F)


class Step(Selected):
    """The quantities of a step in the paper's terms: those of `direction` without its
    normalization; None where they are not defined.

    points : x_(k-1), or None for the first step, and x_k, where the step starts. g :
        grad f(x_k). slope : <g, s> for the normalized s, to which the accepted length
        refers too.
    """

    _from: SmoothedPoint

    def __init__(
        self,
        direction: Direction,
        points: tuple[SmoothedPoint | None, SmoothedPoint],
        g: Vector,
        slope: float,
        accepted: Accepted,
    ) -> None:
        super().__init__(accepted.point, points[1])
        self._before, self._from = points
        # Without its s, which the next step overwrites.
        self.step, _, self._alpha, self._multiple, self._cosines = direction
        self._g = g
        self._slope = slope
        self._gamma = accepted.length
        self.trials = accepted.trials

    @cached_property
    def _sizes(self) -> tuple[float, float, float]:
        """Return |dx|, |y| and |F~| of step 2.3."""
        assert self._before is not None
        dx, y = self._from.x - self._before.x, self._from.F - self._before.F
        return safe_norm(dx), safe_norm(y), safe_norm(self._from.F)

    @cached_property
    def xi1(self) -> float | None:
        """-|dx|^2 / <dx, y>, by the cosine that the step has used: its sign may be that
        of rounding."""
        if self._cosines is None or not self._cosines[0]:
            return None
        size_dx, size_y, _ = self._sizes
        value = -size_dx / size_y / self._cosines[0]
        return value if 0 < abs(value) < math.inf else None

    @cached_property
    def xi2(self) -> float | None:
        """-<y, F~> / |y|^2, likewise."""
        if self._cosines is None:
            return None
        _, size_y, size_F = self._sizes
        return -self._cosines[1] * size_F / size_y

    @property
    def _is_along_F(self) -> bool:
        alpha = self._alpha
        return self.xi1 is None or (alpha is not None and math.isnan(alpha))

    @property
    def alpha(self) -> float | None:
        alpha = self._alpha
        return alpha if alpha is not None and math.isfinite(alpha) else None

    @property
    def d(self) -> Vector:
        return -self._g

    @property
    def u(self) -> Vector | None:
        return None if self.xi1 is None else self.xi1 * self._from.F

    @property
    def v(self) -> Vector | None:
        if self._before is None or self.xi2 is None:
            return None
        return self.xi2 * (self._from.x - self._before.x)

    @property
    def s(self) -> Vector:
        if self._multiple is None:
            return self.d
        u, v = self.u, self.v
        alpha = self._alpha
        if self._is_along_F or u is None or v is None:
            return math.copysign(1.0, -float(self._from.F @ self._g)) * self._from.F
        if alpha is None:
            return (u + v) / 2
        if math.isinf(alpha):
            return math.copysign(1.0, alpha) * (u - v)
        return alpha * u + (1 - alpha) * v

    @cached_property
    def _factor(self) -> float:
        """Return the normalized s as a multiple of the paper's."""
        if self._multiple is None:
            return 1.0
        size = safe_norm(self._from.F)
        if self._is_along_F or self.xi1 is None:
            return 1.0 / size
        return self._multiple / abs(self.xi1) / size

    @property
    def slope(self) -> float:
        return self._slope / self._factor

    @property
    def length(self) -> float:
        return self._gamma * self._factor


NO_INDICES = np.empty(0, dtype=np.intp)
WINDOW = 746.0  # e^-746 is zero in double precision, denormals included
# Trials of one line search, which halves the bracket: far more than numbers have binary
# digits.
MAX_TRIALS = 200
# Relative to the first trial length: for shorter trials, whether x changes at all is
# checked.
SHORT_STEP = 1e-6


def error(problem: Problem, p: float) -> float:
    """Return the bound (ln 3 / p) |M - I|_inf on |F~ - F|."""
    with np.errstate(over="ignore"):
        return (
            math.log(3) / p * matrices.norm_inf(matrices.plus_diagonal(problem.M, -1.0))
        )


def excess(p: float, t: Vector) -> Vector:
    """Return delta = phi - |x| at t = |x| >= 0, for p t <= WINDOW; it lies between 0
    and ln(3) / p."""
    a = np.exp(-p * t)
    return np.asarray(np.log1p(a + a * a) / p)


def slope(p: float, x: Vector) -> Vector:
    """Return phi'(x) = (e^(px) - e^(-px)) / (1 + e^(px) + e^(-px)) for p |x| <= WINDOW;
    it lies between -1 and 1."""
    b = -np.expm1(-p * np.abs(x))  # 1 - a, without cancellation at small x
    return np.asarray(np.copysign(b * (2 - b) / (3 - (3 - b) * b), x))


@dataclass(frozen=True, eq=False)
class SmoothedPoint:
    """F~ and f = |F~|^2 / 2 at one x, each vector of shape (n,); window holds the
    indices of smoothed components."""

    x: Vector
    F: Vector
    f: float
    window: Indices


class Smoothed:
    """F~ of one problem for one p > 0."""

    def __init__(self, problem: Problem, p: float) -> None:
        self._problem, self._p = problem, p
        self._half_bounds = [bound / 2 for bound in problem.box.vectors(problem.n)]
        self._kinks = [
            (s, bound)
            for s, bound in zip((1.0, -1.0), self._half_bounds, strict=True)
            if np.isfinite(bound).any()
        ]

    def split(self, x: Vector) -> tuple[Vector, Vector, Indices]:
        """Return z~ and w~, each of shape (n,), and the indices for which p |x_i - l_i
        / 2| or p |x_i - u_i / 2| is at most WINDOW."""
        t, half_width = x + x, WINDOW / self._p
        z: Vector = self._problem.box.project(t)
        w = np.subtract(z, t, out=t)
        distances = [np.abs(x - kink) for _, kink in self._kinks]
        distance = (
            distances[0]
            if len(distances) == 1
            else np.minimum.reduce(distances, initial=np.inf)
        )
        window = (
            np.flatnonzero(distance <= half_width)
            if distance.min() <= half_width
            else NO_INDICES
        )
        if window.size:
            delta = sum(
                s * excess(self._p, t[window])
                for (s, _), t in zip(self._kinks, distances, strict=True)
            )
            z[window] += delta
            w[window] += delta
        return z, w, window

    def at(self, x: Vector) -> SmoothedPoint:
        """Return F~ and f at x, with one product with M; f is infinite if it
        overflows."""
        z, w, window = self.split(x)
        F = matrices.product(self._problem.M, z)
        F -= w
        F += self._problem.q
        with np.errstate(over="ignore"):
            f = 0.5 * float(F @ F)
        return SmoothedPoint(x, F, f, window)

    def gradient(self, point: SmoothedPoint) -> Vector:
        """Return the gradient of f, J' F~ = 2 (F~ + h (y - F~)), y = M' F~, with one
        product with M'.

        h = (1 + phi') / 2, half the derivative of z~; with bounds (phi'(x - l/2) -
        phi'(x - u/2)) / 2.
        """
        y = matrices.product(self._problem.M.T, point.F)
        y -= point.F
        window = point.window
        low, high = (
            slope(self._p, point.x[window] - bound[window])
            for bound in self._half_bounds
        )
        inner = 0.5 * (low - high) * y[window]
        y *= self._problem.box.basis_of(point.x) == BASIC
        y[window] = inner
        y += point.F
        y *= 2
        return y


class WolfeConditions(NamedTuple):
    """The two conditions of step 2.7 on the next point (weak Wolfe conditions):

    f(x + gamma s) <= f(x) + gamma rho <grad f(x), s>         (sufficient decrease)
    <grad f(x + gamma s), s> >= sigma <grad f(x), s>                (curvature).
    """

    rho: float
    sigma: float


class Accepted(NamedTuple):
    """The point to which a step leads, its length, the gradient of f there, and the
    number of trial lengths, also along an abandoned direction."""

    point: SmoothedPoint
    length: float
    gradient: Vector
    trials: int


def search(
    smoothed: Smoothed,
    start: SmoothedPoint,
    s: Vector,
    slope: float,
    gamma: float,
    wolfe: WolfeConditions,
) -> Accepted | int:
    """Return the point to which a step from start along s leads, where f has the slope
    <grad f, s> < 0, with first trial length gamma > 0, and which satisfies the Wolfe
    conditions; only the number of trial lengths if they become too short to change x:
    the decrease is below rounding.

    Any other trial becomes a limit of the bracket: the upper one if it violates the
    decrease, else the lower one. The bracket expands while it has no upper limit; from
    then on each pair of trials at least halves it. Between the halvings the trial is
    the minimizer of a parabola that interpolates f, which is exact if f is quadratic
    (Nocedal and Wright 2006, section 3.5). Gradients are computed only where the
    decrease holds.
    """
    rho, sigma = wolfe
    # The bracket, with f at its limits, and the slope at the lower one.
    low, f_low = 0.0, start.f
    high, f_high = math.inf, math.inf
    slope_low = slope
    first = gamma
    for trial in range(1, MAX_TRIALS + 1):
        x = gamma * s
        x += start.x
        point = smoothed.at(x)
        if not point.f <= start.f + gamma * rho * slope:
            if gamma < SHORT_STEP * first and np.array_equal(x, start.x):
                break
            halve = gamma - low > 0.5 * (high - low)
            high, f_high = gamma, point.f
        else:
            g = smoothed.gradient(point)
            slope_here = float(g @ s)
            if slope_here >= sigma * slope:
                return Accepted(point, gamma, g, trial)
            halve = gamma - low < 0.5 * (high - low)
            low, f_low = gamma, point.f
            slope_low = slope_here
        if high == math.inf:
            flattening = slope_low / slope
            gamma = low * (
                min(max(1 / (1 - flattening), 2.0), 10.0) if flattening < 1 else 10.0
            )
            continue
        width = high - low
        bend = f_high - f_low - slope_low * width
        inner = (
            low - 0.5 * slope_low * width * (width / bend)
            if 0 < bend < math.inf
            else low
        )
        gamma = low + 0.5 * width if halve or not low < inner < high else inner
    return trial
