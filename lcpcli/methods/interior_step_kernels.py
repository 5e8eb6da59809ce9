"""The steps of the interior point method, as in `interior_steps`, compiled by numba: Mehrotra's predictor and corrector
(1992) with Gondzio's further correctors (1996); and the indicators of Tapia, which tell early which bounds are active
(A. S. El-Bakry, R. A. Tapia, Y. Zhang, A study of indicators for identifying zero variables in interior-point methods,
SIAM Review 36 (1994) 45-72)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lcpcli.methods import interior_system_kernels as systems
from lcpcli.methods.interior_scaling_kernels import times
from lcpcli.methods.interior_steps import (
    AIM_ACCURACY,
    BOUNDARY_SHARE,
    CORRECTORS,
    LEAST_SIGMA,
    MU_ACCURACY,
    PRODUCT_SPREAD,
    SAFE_SIGMA,
    SHORT_LENGTH,
    SYSTEM_ACCURACY,
    TINY,
    WORTH_GAIN,
)
from lcpcli.methods.interior_system_kernels import Systems
from lcpcli.methods.ldl_kernels import INDEX, compiled
from lcpcli.model.box import BASIC, LOWER, UPPER

SIGMA_EXPONENT = 4  # of what the affine step leaves of mu
GOOD_LENGTH, ASPIRED_GAIN = 0.8, 0.5  # of a step that is long enough without correctors; what one of them aims at
AFFINE_ACCURACY = 10.0  # relative to that of the other directions: the affine one is corrected anyway
SHIFTED, LEAST_PRODUCT = 1.5, 1e-8  # of the start
LEAST_GAP = 1e-10  # of which the gap is a part


class Point(NamedTuple):
    """z of shape (n,); slacks s and multipliers w of the m finite bounds; or a direction."""

    z: Any
    s: Any
    w: Any


class Steps(NamedTuple):
    """The steps of one attempt.

    systems : the systems, with the problem. variable, sign, bound : of each finite bound its variable, 1 if it is a
    lower one, else -1, and the bound. at : the point. dual, primal : M z + q minus the multipliers, and the distances
    to the bounds minus the slacks.
    ratio, absorbs : w / s, and minus the sign where w absorbs what a system leaves, else 0; both for each bound.
    aim : the changes of s w that a direction makes to first order; further_aim, right, directions : work.
    tapia, changes : the active set by Tapia's indicators, and how many states the last step has changed.
    """

    systems: Systems
    variable: Any
    sign: Any
    bound: Any
    at: Point
    dual: Any
    primal: Any
    ratio: Any
    absorbs: Any
    aim: Any
    further_aim: Any
    right: Any
    found: Point
    other: Point
    tapia: Any
    changes: Any


@compiled
def _point(n: int, m: int) -> Point:
    return Point(np.zeros(n), np.ones(m), np.ones(m))


@compiled
def steps_of(own: Systems) -> Steps:
    """Return the steps on the problem of these systems, before their start."""
    lower, upper, n, m = own.problem.lower, own.problem.upper, own.problem.q.size, 0
    for i in range(n):
        m += int(lower[i] > -np.inf) + int(upper[i] < np.inf)
    variable, sign, bound, k = np.empty(m, INDEX), np.empty(m), np.empty(m), 0
    for i in range(n):
        if lower[i] > -np.inf:
            variable[k], sign[k], bound[k] = i, 1.0, lower[i]
            k += 1
        if upper[i] < np.inf:
            variable[k], sign[k], bound[k] = i, -1.0, upper[i]
            k += 1
    residuals, parts = (np.empty(n), np.empty(m)), (np.empty(m), np.empty(m), np.empty(m), np.empty(m))
    work = np.empty(n), _point(n, m), _point(n, m)
    tapia = np.zeros(n, np.int8), np.full(1, n, np.int64)
    return Steps(own, variable, sign, bound, _point(n, m), *residuals, *parts, *work, *tapia)


@compiled
def start(own: Steps, slack: float) -> None:
    """Start near the reference point, with slacks and multipliers of at least `slack`, as Mehrotra does."""
    at, problem, D, m = own.at, own.systems.problem, own.systems.D, own.bound.size
    D[:] = 0.0
    for k in range(m):
        D[own.variable[k]] = 1.0
    systems.factorize_anew(own.systems)
    for i in range(D.size):
        own.right[i] = D[i] * problem.z_ref[i] - problem.q[i]
    if not systems.solve(own.systems, own.right, 0.0, at.z):
        at.z[:] = problem.z_ref
    times(problem, at.z, own.dual)
    least_s = 0.0
    for k in range(m):
        i = own.variable[k]
        at.s[k] = own.sign[k] * (at.z[i] - own.bound[k])
        at.w[k] = max(own.sign[k] * (own.dual[i] + problem.q[i]), 0.0)
        least_s = min(least_s, at.s[k])
    product = of_s = of_w = 0.0
    for k in range(m):
        at.s[k] -= SHIFTED * least_s
        product += at.s[k] * at.w[k]
        of_s += at.s[k]
        of_w += at.w[k]
    product = max(product, LEAST_PRODUCT * m)
    more_s = max(0.5 * product / max(of_w, LEAST_PRODUCT), slack)
    more_w = max(0.5 * product / max(of_s, LEAST_PRODUCT), slack)
    for k in range(m):
        at.s[k] += more_s
        at.w[k] += more_w


@compiled
def measure(own: Steps) -> tuple[float, float, float]:
    """Compute the residuals of the point; return the largest of these and of the gap relative to its terms, mu, and the
    largest residual."""
    at, problem = own.at, own.systems.problem
    times(problem, at.z, own.dual)
    gap = of_bounds = positive = negative = largest = 0.0
    for i in range(at.z.size):
        term = problem.q[i] * at.z[i]
        own.dual[i] += problem.q[i]
        positive, negative = positive + max(term, 0.0), negative + max(-term, 0.0)
    for k in range(at.s.size):
        i = own.variable[k]
        own.dual[i] -= own.sign[k] * at.w[k]
        own.primal[k] = own.sign[k] * (at.z[i] - own.bound[k]) - at.s[k]
        gap += at.s[k] * at.w[k]
        of_bounds += own.sign[k] * own.bound[k] * at.w[k]
        largest = max(largest, abs(own.primal[k]))
    for value in own.dual:
        largest = max(largest, abs(value))
    terms = max(max(LEAST_GAP, positive), max(negative, abs(of_bounds)))
    return max(gap / terms, largest), gap / max(at.s.size, 1), largest


@compiled
def by_size(own: Steps, states: Any) -> None:
    """Write the active set of the point: a bound is active where its slack is below its multiplier, the nearer one of
    two."""
    states[:] = BASIC
    nearest = np.full(states.size, np.inf)
    for k in range(own.bound.size):
        i = own.variable[k]
        if own.at.s[k] < own.at.w[k] and own.at.s[k] < nearest[i]:
            nearest[i] = own.at.s[k]
            states[i] = LOWER if own.sign[k] > 0.0 else UPPER


@compiled
def _indicate(own: Steps, affine: Point) -> None:
    """Find the active set by the affine direction, in which the slack of an active bound vanishes faster than its
    multiplier, the fastest one of two; and count its changes."""
    before, fastest = own.tapia.copy(), np.zeros(own.tapia.size)
    own.tapia[:] = BASIC
    for k in range(own.bound.size):
        i, rate = own.variable[k], affine.s[k] / own.at.s[k]
        if rate < affine.w[k] / own.at.w[k] and (own.tapia[i] == BASIC or rate < fastest[i]):
            fastest[i] = rate
            own.tapia[i] = LOWER if own.sign[k] > 0.0 else UPPER
    own.changes[0] = np.sum(before != own.tapia)


@compiled
def _factorize(own: Steps) -> None:
    """Factorize M + D for the sums D of the ratios w / s, and choose the multipliers that absorb what is left: those of
    the nearer bounds, if they are above the slacks."""
    D = own.systems.D
    D[:] = 0.0
    for k in range(own.bound.size):
        own.ratio[k] = own.at.w[k] / own.at.s[k]
        D[own.variable[k]] += own.ratio[k]
    for k in range(own.bound.size):
        absorbs = own.ratio[k] > 1.0 and 2.0 * own.ratio[k] >= D[own.variable[k]]
        own.absorbs[k] = -own.sign[k] if absorbs else 0.0
    systems.factorize_anew(own.systems)


@compiled
def _direction(own: Steps, aim: Any, target: float, along: Point) -> bool:
    """Write the direction that changes the products s w by the aim, to first order, and makes the residuals 0 up to
    the target; return whether it is finite."""
    right, at = own.right, own.at
    for i in range(right.size):
        right[i] = -own.dual[i]
    for k in range(aim.size):
        right[own.variable[k]] += own.sign[k] * (aim[k] / at.s[k] - own.ratio[k] * own.primal[k])
    if not systems.solve(own.systems, right, target, along.z):
        return False
    left = own.systems.left
    for k in range(aim.size):
        i = own.variable[k]
        along.s[k] = own.sign[k] * along.z[i] + own.primal[k]
        along.w[k] = aim[k] / at.s[k] - own.ratio[k] * along.s[k] + own.absorbs[k] * left[i]
    return True


@compiled
def _longest(at: Point, along: Point) -> float:
    """Return the longest step, at most 1, that keeps s and w nonnegative."""
    fastest = 1.0
    for k in range(at.s.size):
        if -along.s[k] > fastest * at.s[k]:
            fastest = -along.s[k] / at.s[k]
        if -along.w[k] > fastest * at.w[k]:
            fastest = -along.w[k] / at.w[k]
    return 1.0 / fastest


@compiled
def _corrected(own: Steps, length: float, mu: float, target: float) -> tuple[Point, Point, float]:
    """Return the direction `own.found`, or one by Gondzio's correctors that allows a longer step, the other of these
    two, and the length of the step."""
    at, found, other, aim, further = own.at, own.found, own.other, own.aim, own.further_aim
    for _ in range(CORRECTORS):
        if length > GOOD_LENGTH:
            break
        aspired = min(1.0, length + ASPIRED_GAIN)
        for k in range(aim.size):
            product = (at.s[k] + aspired * found.s[k]) * (at.w[k] + aspired * found.w[k])
            change = min(max(product, mu / PRODUCT_SPREAD), mu * PRODUCT_SPREAD) - product
            further[k] = aim[k] + max(change, -mu * PRODUCT_SPREAD)
        if not _direction(own, further, target, other):
            break
        longer = _longest(at, other)
        if longer < length + WORTH_GAIN:
            break
        length = longer
        found, other = other, found
        aim, further = further, aim
    return found, other, length


@compiled
def advance(own: Steps, mu: float, residual: float) -> float:
    """Make a step; return its length, 0 if there is no finite direction."""
    at, aim, m = own.at, own.aim, own.bound.size
    accuracy = max(SYSTEM_ACCURACY * residual, MU_ACCURACY * mu)
    _factorize(own)
    for k in range(m):
        aim[k] = -at.s[k] * at.w[k]
    if not _direction(own, aim, AFFINE_ACCURACY * accuracy, own.found):
        return 0.0
    affine, after = own.found, 0.0
    _indicate(own, affine)
    affine_length = _longest(at, affine)
    for k in range(m):
        after += (at.s[k] + affine_length * affine.s[k]) * (at.w[k] + affine_length * affine.w[k])
    sigma = max(min(max(after / m, 0.0) / mu, 1.0) ** SIGMA_EXPONENT, LEAST_SIGMA)
    for k in range(m):
        aim[k] = sigma * mu - at.s[k] * at.w[k] - affine.s[k] * affine.w[k]
    target = max(SYSTEM_ACCURACY * residual, min(MU_ACCURACY * mu, AIM_ACCURACY * sigma * mu))
    if not _direction(own, aim, target, own.found):
        return 0.0
    along, spare, length = _corrected(own, _longest(at, own.found), sigma * mu, target)
    if length < min(SHORT_LENGTH, 0.5 * affine_length):  # a step that only centres may be longer
        for k in range(m):
            own.further_aim[k] = max(sigma, SAFE_SIGMA) * mu - at.s[k] * at.w[k]
        if _direction(own, own.further_aim, accuracy, spare) and _longest(at, spare) > length:
            along, length = spare, _longest(at, spare)
    if length < 1.0:
        length *= min(1.0, max(BOUNDARY_SHARE, 1.0 - mu))
    for i in range(at.z.size):
        at.z[i] += length * along.z[i]
    for k in range(m):
        at.s[k] = max(at.s[k] + length * along.s[k], TINY)
        at.w[k] = max(at.w[k] + length * along.w[k], TINY)
    return length
