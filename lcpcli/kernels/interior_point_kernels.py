"""A point of the compiled interior point method: its start, its residuals, the active set near it, and whether it tends
to infinity along a proof that there is no solution.

The indicators of Tapia tell early which bounds are active: A. S. El-Bakry, R. A. Tapia, Y. Zhang, A study of indicators
for identifying zero variables in interior-point methods, SIAM Review 36 (1994) 45-72.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lcpcli.kernels import interior_system_kernels as systems
from lcpcli.kernels.interior_scaling_kernels import Scaled, times
from lcpcli.kernels.interior_system_kernels import Systems
from lcpcli.kernels.ldl_kernels import INDEX, borrowing, compiled
from lcpcli.methods.interior_scaling import CLEAR_MARGIN, DIVERGED_SIZE
from lcpcli.model.box import BASIC, LOWER, UPPER

SHIFTED, LEAST_PRODUCT = 1.5, 1e-8  # of the start
LEAST_GAP = 1e-10  # of which the gap is a part
EXCLUDED_SUM = 1e4  # the sum of |z| up to which a vector has to exclude all z, in scaled units, to be nearly a proof


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


@borrowing
def parts_of(own: Steps) -> Any:
    """Return what most functions use: arrays of named tuples are counted as references when they are taken from these,
    which costs as much as some arithmetic and so is done outside of loops."""
    return own.systems.problem, own.systems.D, own.right, own.variable, own.sign, own.bound


@borrowing
def start(own: Steps, slack: float) -> None:
    """Start near the reference point, with slacks and multipliers of at least `slack`, as Mehrotra does."""
    problem, D, right, variable, sign, bound = parts_of(own)
    (z, s, w), w_of_z, q, z_ref = own.at, own.dual, problem.q, problem.z_ref
    D[:] = 0.0
    for k in range(s.size):
        D[variable[k]] = 1.0
    systems.factorize_anew(own.systems)
    for i in range(D.size):
        right[i] = D[i] * z_ref[i] - q[i]
    if not systems.solve(own.systems, right, 0.0, z):
        for i in range(D.size):
            z[i] = z_ref[i]
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


@borrowing
def measure(own: Steps) -> tuple[float, float, float]:
    """Compute the residuals of the point; return the largest of these and of the gap relative to its terms, mu, and the
    largest residual."""
    problem, _, _, variable, sign, bound = parts_of(own)
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


@borrowing
def by_size(own: Steps, states: Any) -> None:
    """Write the active set of the point: a bound is active where its slack is below its multiplier, the nearer one of
    two."""
    (_, s, w), variable, sign = own.at, own.variable, own.sign
    states[:] = BASIC
    for k in range(s.size):
        i = variable[k]  # the bound before this one may be the other one of the same variable
        if s[k] < w[k] and (states[i] == BASIC or s[k] < s[k - 1]):
            states[i] = LOWER if sign[k] > 0.0 else UPPER


@borrowing
def indicate(own: Steps, affine: Point) -> None:
    """Find the active set by the affine direction, in which the slack of an active bound vanishes faster than its
    multiplier, the fastest one of two; and count its changes."""
    (_, s, w), (_, ds, dw), variable, sign, tapia = own.at, affine, own.variable, own.sign, own.tapia
    changes, k = 0, 0
    while k < s.size:
        i, state, fastest = variable[k], BASIC, 0.0
        while k < s.size and variable[k] == i:
            rate = ds[k] / s[k]
            if rate < dw[k] / w[k] and (state == BASIC or rate < fastest):
                fastest, state = rate, LOWER if sign[k] > 0.0 else UPPER
            k += 1
        changes += int(tapia[i] != state)
        tapia[i] = state
    own.changes[0] = changes


@borrowing
def is_nearly_proof(problem: Scaled, z: Any, y: Any, turned: Any, product: Any) -> bool:
    """Return whether z, or its part with one of the signs S, is nearly a Farkas vector y, from which
    `interior_scaling.proof_of` may make a proof: for all admissible z of moderate size, q'y + z'M'y < 0.

    y, turned, product : work.
    """
    signs, q, lower, upper = problem.signs, problem.q, problem.lower, problem.upper
    for side in range(-1, 2):
        largest = size = total = outside = 0.0
        for i in range(z.size):
            y[i] = z[i] if side == 0 or side * signs[i] > 0.0 else 0.0
            if lower[i] > -np.inf:
                y[i] = max(y[i], 0.0)
            if upper[i] < np.inf:
                y[i] = min(y[i], 0.0)
            largest, size, total = max(largest, abs(y[i])), size + abs(y[i]), total + q[i] * y[i]
            turned[i] = signs[i] * y[i]
        if largest <= DIVERGED_SIZE:
            continue
        times(problem, turned, product)
        for i in range(z.size):
            slope = signs[i] * product[i]  # of M'y, as S M is symmetric
            end = upper[i] if slope > 0.0 else lower[i]
            if abs(end) < np.inf:
                total += end * slope
            else:
                outside = max(outside, abs(slope))
        if total + EXCLUDED_SUM * outside < -CLEAR_MARGIN * size:
            return True
    return False
