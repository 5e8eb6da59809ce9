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
    found, other, right = _point(n, m), _point(n, m), np.empty(n)
    tapia = np.zeros(n, np.int8), np.full(1, n, np.int64)
    return Steps(own, variable, sign, bound, _point(n, m), *residuals, *parts, right, found, other, *tapia)


@compiled
def _parts(own: Steps) -> Any:
    """Return what most functions use: arrays of named tuples are counted as references when they are taken from these,
    which costs as much as some arithmetic and so is done outside of loops."""
    return own.systems.problem, own.systems.D, own.right, own.variable, own.sign, own.bound


@compiled
def start(own: Steps, slack: float) -> None:
    """Start near the reference point, with slacks and multipliers of at least `slack`, as Mehrotra does."""
    problem, D, right, variable, sign, bound = _parts(own)
    (z, s, w), w_of_z, q, z_ref = own.at, own.dual, problem.q, problem.z_ref
    D[:] = 0.0
    for k in range(s.size):
        D[variable[k]] = 1.0
    systems.factorize_anew(own.systems)
    for i in range(D.size):
        right[i] = D[i] * z_ref[i] - q[i]
    if not systems.solve(own.systems, right, 0.0, z):
        z[:] = z_ref
    times(problem, z, w_of_z)
    least = 0.0
    for k in range(s.size):
        i = variable[k]
        s[k] = sign[k] * (z[i] - bound[k])
        w[k] = max(sign[k] * (w_of_z[i] + q[i]), 0.0)
        least = min(least, s[k])
    product = of_s = of_w = 0.0
    for k in range(s.size):
        s[k] -= SHIFTED * least
        product += s[k] * w[k]
        of_s += s[k]
        of_w += w[k]
    product = max(product, LEAST_PRODUCT * s.size)
    more_s = max(0.5 * product / max(of_w, LEAST_PRODUCT), slack)
    more_w = max(0.5 * product / max(of_s, LEAST_PRODUCT), slack)
    for k in range(s.size):
        s[k] += more_s
        w[k] += more_w


@compiled
def measure(own: Steps) -> tuple[float, float, float]:
    """Compute the residuals of the point; return the largest of these and of the gap relative to its terms, mu, and the
    largest residual."""
    problem, _, _, variable, sign, bound = _parts(own)
    (z, s, w), dual, primal, q = own.at, own.dual, own.primal, problem.q
    times(problem, z, dual)
    gap = of_bounds = positive = negative = largest = 0.0
    for i in range(z.size):
        term = q[i] * z[i]
        dual[i] += q[i]
        positive, negative = positive + max(term, 0.0), negative + max(-term, 0.0)
    for k in range(s.size):
        i = variable[k]
        dual[i] -= sign[k] * w[k]
        primal[k] = sign[k] * (z[i] - bound[k]) - s[k]
        gap += s[k] * w[k]
        of_bounds += sign[k] * bound[k] * w[k]
        largest = max(largest, abs(primal[k]))
    for i in range(z.size):
        largest = max(largest, abs(dual[i]))
    terms = max(max(LEAST_GAP, positive), max(negative, abs(of_bounds)))
    return max(gap / terms, largest), gap / max(s.size, 1), largest


@compiled
def by_size(own: Steps, states: Any) -> None:
    """Write the active set of the point: a bound is active where its slack is below its multiplier, the nearer one of
    two."""
    (_, s, w), variable, sign = own.at, own.variable, own.sign
    states[:] = BASIC
    nearest = np.full(states.size, np.inf)
    for k in range(s.size):
        i = variable[k]
        if s[k] < w[k] and s[k] < nearest[i]:
            nearest[i] = s[k]
            states[i] = LOWER if sign[k] > 0.0 else UPPER


@compiled
def _indicate(own: Steps, affine: Point) -> None:
    """Find the active set by the affine direction, in which the slack of an active bound vanishes faster than its
    multiplier, the fastest one of two; and count its changes."""
    (_, s, w), (_, ds, dw), variable, sign, tapia = own.at, affine, own.variable, own.sign, own.tapia
    before, fastest, changes = tapia.copy(), np.zeros(tapia.size), 0
    tapia[:] = BASIC
    for k in range(s.size):
        i, rate = variable[k], ds[k] / s[k]
        if rate < dw[k] / w[k] and (tapia[i] == BASIC or rate < fastest[i]):
            fastest[i] = rate
            tapia[i] = LOWER if sign[k] > 0.0 else UPPER
    for i in range(tapia.size):
        changes += int(before[i] != tapia[i])
    own.changes[0] = changes


@compiled
def _factorize(own: Steps) -> None:
    """Factorize M + D for the sums D of the ratios w / s, and choose the multipliers that absorb what is left: those of
    the nearer bounds, if they are above the slacks."""
    _, D, _, variable, sign, _ = _parts(own)
    (_, s, w), ratio, absorbs = own.at, own.ratio, own.absorbs
    D[:] = 0.0
    for k in range(s.size):
        ratio[k] = w[k] / s[k]
        D[variable[k]] += ratio[k]
    for k in range(s.size):
        absorbs[k] = -sign[k] if ratio[k] > 1.0 and 2.0 * ratio[k] >= D[variable[k]] else 0.0
    systems.factorize_anew(own.systems)


@compiled
def _direction(own: Steps, aim: Any, target: float, along: Point) -> bool:
    """Write the direction that changes the products s w by the aim, to first order, and makes the residuals 0 up to
    the target; return whether it is finite."""
    _, _, right, variable, sign, _ = _parts(own)
    (_, s, _), (dz, ds, dw), dual, primal, ratio = own.at, along, own.dual, own.primal, own.ratio
    for i in range(right.size):
        right[i] = -dual[i]
    for k in range(s.size):
        right[variable[k]] += sign[k] * (aim[k] / s[k] - ratio[k] * primal[k])
    if not systems.solve(own.systems, right, target, dz):
        return False
    left, absorbs = own.systems.left, own.absorbs
    for k in range(s.size):
        i = variable[k]
        ds[k] = sign[k] * dz[i] + primal[k]
        dw[k] = aim[k] / s[k] - ratio[k] * ds[k] + absorbs[k] * left[i]
    return True


@compiled
def _longest(at: Point, along: Point) -> float:
    """Return the longest step, at most 1, that keeps s and w nonnegative."""
    (_, s, w), (_, ds, dw) = at, along
    fastest = 1.0
    for k in range(s.size):
        if -ds[k] > fastest * s[k]:
            fastest = -ds[k] / s[k]
        if -dw[k] > fastest * w[k]:
            fastest = -dw[k] / w[k]
    return 1.0 / fastest


@compiled
def _corrected(own: Steps, length: float, mu: float, target: float) -> tuple[Point, Point, float]:
    """Return the direction `own.found`, or one by Gondzio's correctors that allows a longer step, the other of these
    two, and the length of the step."""
    (_, s, w), found, other, aim, further = own.at, own.found, own.other, own.aim, own.further_aim
    for _ in range(CORRECTORS):
        if length > GOOD_LENGTH:
            break
        aspired, ds, dw = min(1.0, length + ASPIRED_GAIN), found.s, found.w
        for k in range(s.size):
            product = (s[k] + aspired * ds[k]) * (w[k] + aspired * dw[k])
            change = min(max(product, mu / PRODUCT_SPREAD), mu * PRODUCT_SPREAD) - product
            further[k] = aim[k] + max(change, -mu * PRODUCT_SPREAD)
        if not _direction(own, further, target, other):
            break
        longer = _longest(own.at, other)
        if longer < length + WORTH_GAIN:
            break
        length = longer
        found, other = other, found
        aim, further = further, aim
    return found, other, length


@compiled
def _centring(own: Steps, sigma: float, mu: float, affine: Any, aim: Any) -> None:
    """Write the changes of s w that lead to sigma mu, with the products of an affine direction, if there is one."""
    (_, s, w), ds, dw = own.at, own.found.s, own.found.w
    for k in range(s.size):
        aim[k] = sigma * mu - s[k] * w[k] - (ds[k] * dw[k] if affine else 0.0)


@compiled
def _mu_after(at: Point, along: Point, length: float) -> Any:
    """Return mu after a step."""
    (_, s, w), (_, ds, dw), total = at, along, 0.0
    for k in range(s.size):
        total += (s[k] + length * ds[k]) * (w[k] + length * dw[k])
    return total / max(s.size, 1)


@compiled
def _move(at: Point, along: Point, length: float) -> None:
    (z, s, w), (dz, ds, dw) = at, along
    for i in range(z.size):
        z[i] += length * dz[i]
    for k in range(s.size):
        s[k] = max(s[k] + length * ds[k], TINY)
        w[k] = max(w[k] + length * dw[k], TINY)


@compiled
def advance(own: Steps, mu: float, residual: float) -> Any:
    """Make a step; return its length, 0 if there is no finite direction."""
    at, found, aim = own.at, own.found, own.aim
    accuracy = max(SYSTEM_ACCURACY * residual, MU_ACCURACY * mu)
    _factorize(own)
    _centring(own, 0.0, mu, False, aim)
    if not _direction(own, aim, AFFINE_ACCURACY * accuracy, found):
        return 0.0
    _indicate(own, found)
    affine_length = _longest(at, found)
    left = min(max(_mu_after(at, found, affine_length), 0.0) / mu, 1.0)
    sigma = max(left**SIGMA_EXPONENT, LEAST_SIGMA)
    _centring(own, sigma, mu, True, aim)
    target = max(SYSTEM_ACCURACY * residual, min(MU_ACCURACY * mu, AIM_ACCURACY * sigma * mu))
    if not _direction(own, aim, target, found):
        return 0.0
    along, spare, length = _corrected(own, _longest(at, found), sigma * mu, target)
    if length < min(SHORT_LENGTH, 0.5 * affine_length):  # a step that only centres may be longer
        _centring(own, max(sigma, SAFE_SIGMA), mu, False, own.further_aim)
        if _direction(own, own.further_aim, accuracy, spare) and _longest(at, spare) > length:
            along, length = spare, _longest(at, spare)
    if length < 1.0:
        length *= min(1.0, max(BOUNDARY_SHARE, 1.0 - mu))
    _move(at, along, length)
    return length
