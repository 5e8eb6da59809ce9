"""The steps of the interior point method, as in `interior_steps`, compiled by numba: Mehrotra's predictor and corrector
(1992) with Gondzio's further correctors (1996)."""

from __future__ import annotations

from typing import Any

from lcpcli.kernels import interior_system_kernels as systems
from lcpcli.kernels.interior_point_kernels import Point, Steps, indicate, parts_of
from lcpcli.kernels.ldl_kernels import borrowing
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

SIGMA_EXPONENT = 4  # of what the affine step leaves of mu
GOOD_LENGTH, ASPIRED_GAIN = 0.8, 0.5  # of a step that is long enough without correctors; what one of them aims at
AFFINE_ACCURACY = 10.0  # relative to that of the other directions: the affine one is corrected anyway


@borrowing
def _factorize(own: Steps) -> None:
    """Factorize M + D for the sums D of the ratios w / s, and choose the multipliers that absorb what is left: those of
    the nearer bounds, if they are above the slacks."""
    _, D, _, variable, sign, _ = parts_of(own)
    (_, s, w), ratio, absorbs = own.at, own.ratio, own.absorbs
    D[:] = 0.0
    for k in range(s.size):
        ratio[k] = w[k] / s[k]
        D[variable[k]] += ratio[k]
    for k in range(s.size):
        absorbs[k] = -sign[k] if ratio[k] > 1.0 and 2.0 * ratio[k] >= D[variable[k]] else 0.0
    systems.factorize_anew(own.systems)


@borrowing
def _direction(own: Steps, aim: Any, target: float, along: Point) -> bool:
    """Write the direction that changes the products s w by the aim, to first order, and makes the residuals 0 up to
    the target; return whether it is finite."""
    _, _, right, variable, sign, _ = parts_of(own)
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


@borrowing
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


@borrowing
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


@borrowing
def _centring(own: Steps, sigma: float, mu: float, affine: Any, aim: Any) -> None:
    """Write the changes of s w that lead to sigma mu, with the products of an affine direction, if there is one."""
    (_, s, w), ds, dw = own.at, own.found.s, own.found.w
    for k in range(s.size):
        aim[k] = sigma * mu - s[k] * w[k] - (ds[k] * dw[k] if affine else 0.0)


@borrowing
def _mu_after(at: Point, along: Point, length: float) -> Any:
    """Return mu after a step."""
    (_, s, w), (_, ds, dw), total = at, along, 0.0
    for k in range(s.size):
        total += (s[k] + length * ds[k]) * (w[k] + length * dw[k])
    return total / max(s.size, 1)


@borrowing
def _move(at: Point, along: Point, length: float) -> None:
    (z, s, w), (dz, ds, dw) = at, along
    for i in range(z.size):
        z[i] += length * dz[i]
    for k in range(s.size):
        s[k] = max(s[k] + length * ds[k], TINY)
        w[k] = max(w[k] + length * dw[k], TINY)


@borrowing
def advance(own: Steps, mu: float, residual: float) -> Any:
    """Make a step; return its length, 0 if there is no finite direction."""
    at, found, aim = own.at, own.found, own.aim
    accuracy = max(SYSTEM_ACCURACY * residual, MU_ACCURACY * mu)
    _factorize(own)
    _centring(own, 0.0, mu, False, aim)
    if not _direction(own, aim, AFFINE_ACCURACY * accuracy, found):
        return 0.0
    indicate(own, found)
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
