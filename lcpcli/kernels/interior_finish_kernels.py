"""Solutions with the active set of an interior point, as in `interior`, compiled by numba: by a proximal iteration on
the basic system, until each row is small beside its own terms, as the criterion asks for."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lcpcli.kernels.interior_scaling_kernels import Scaled
from lcpcli.kernels.interior_system_kernels import FINITE, Systems, factorize, solve_by_factors
from lcpcli.kernels.ldl_kernels import arithmetic, borrowing, compiled
from lcpcli.methods.interior import (
    EXCHANGE_ROUNDS,
    FAR_RESIDUAL,
    NONBASIC,
    PROXIMAL_SHIFT,
    PROXIMAL_STEPS,
    SLOW_PROXIMAL,
    WORSE_FACTOR,
    WRONG_SIGN,
)
from lcpcli.model.box import BASIC, LOWER, UPPER

CLOSE = 1e-11  # relative to the terms of a row: a violation that is well within the usual tolerance
CLEAN = 1e-12  # the same, without rows of noise: then only these are left
ROUNDED = 3e-15  # the same: a residual that is rounding
NOISE = 5e-16  # in scaled units: violations that are noise beside the numbers of other rows
NOISY = 1e-9  # the measure of a point whose rows of noise are not clean: other solutions count more
LAST_DIGITS = 3e-16  # in scaled units: residuals of which no digit is right
CLEANING_STEPS = 4  # refinements of a point with rows of noise
WRONG_SHARE, FEW_WRONG = 0.01, 5  # of n, and besides: wrong signs of an active set that is nearly right
LEAST_EXPONENT, LARGEST_EXPONENT = -16, -11  # of ten, relative to the largest distance from z_ref: noise in z


class Best(NamedTuple):
    """The best point so far, of shape (n,), and its measure, of shape (1,)."""

    z: Any
    measure: Any


class Work(NamedTuple):
    """Work of shape (n,), for active sets and for `finish`, which overwrites the first of these."""

    states: Any
    least_states: Any
    z: Any
    w: Any
    start: Any
    clipped: Any
    own_w: Any


@compiled
def work_of(n: int) -> Work:
    """Return work for n unknowns."""
    states = np.empty(n, np.int8), np.empty(n, np.int8)
    return Work(*states, np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n))


@borrowing
def keep(best: Best, z: Any, measure: float) -> None:
    """Keep a point if its measure is less than that of the best one."""
    if measure < best.measure[0]:
        best.measure[0] = measure
        for i in range(z.size):
            best.z[i] = z[i]


@arithmetic
def largest_ratio(problem: Scaled, z: Any, w: Any, ignored: float) -> float:
    """Write M z + q into w; return the largest violation of a row relative to its own terms, as `verify.measure` counts
    them, but without caps; violations up to `ignored` do not count."""
    begin, columns, values, q, lower, upper, _, z_ref, q_ref, _, _ = problem
    largest, is_finite = 0.0, True
    for i in range(z.size):
        total, terms, from_reference = q[i], abs(q[i]), abs(q_ref[i])
        for p in range(begin[i], begin[i + 1]):
            j = columns[p]
            term = values[p] * z[j]
            total += term
            terms += abs(term)
            from_reference += abs(values[p] * (z[j] - z_ref[j]))
        w[i] = total
        violation = abs(total) if z[i] < upper[i] else max(total, 0.0)
        if not lower[i] < z[i]:
            violation = max(-total, 0.0)
        is_finite = is_finite and abs(total) < FINITE
        if violation > ignored:
            terms = min(terms, from_reference)
            largest = max(largest, violation / terms if terms > 0.0 else np.inf)
    return largest if is_finite else np.inf


@borrowing
def without_noise(problem: Scaled, z: Any, w: Any, trial: Any) -> Any:
    """Put components of z at z_ref whose distance is noise beside the largest one in components of the same sign S, if
    the rows are then smaller beside their terms; return the largest of these ratios. w, trial : work."""
    least = largest_ratio(problem, z, w, 0.0)
    signs, z_ref, farthest, farthest_below = problem.signs, problem.z_ref, 1.0, 1.0
    for i in range(z.size):
        if signs[i] > 0.0:
            farthest = max(farthest, abs(z[i] - z_ref[i]))
        else:
            farthest_below = max(farthest_below, abs(z[i] - z_ref[i]))
    for exponent in range(LEAST_EXPONENT, LARGEST_EXPONENT + 1):
        if least <= CLOSE:
            break
        for i in range(z.size):
            noise = 10.0**exponent * (farthest if signs[i] > 0.0 else farthest_below)
            trial[i] = z[i] if abs(z[i] - z_ref[i]) > noise else z_ref[i]
        ratio = largest_ratio(problem, trial, w, 0.0)
        if ratio < least:
            least = ratio
            for i in range(z.size):
                z[i] = trial[i]
    return least


@arithmetic
def _basic_residual(problem: Scaled, states: Any, z: Any, w: Any, r: Any) -> tuple[float, float]:
    """Write M z + q into w, and minus its basic components into r; return the largest of these, absolutely and relative
    to the terms of its row."""
    begin, columns, values, q = problem.begin, problem.columns, problem.values, problem.q
    largest, ratio = 0.0, 0.0
    for i in range(z.size):
        total, terms = q[i], abs(q[i])
        for p in range(begin[i], begin[i + 1]):
            term = values[p] * z[columns[p]]
            total += term
            terms += abs(term)
        w[i], r[i] = total, 0.0
        if states[i] == BASIC:
            r[i], size = -total, abs(total)
            largest = max(largest, size) if size < FINITE else np.inf
            if size > LAST_DIGITS:
                ratio = max(ratio, size / terms)
    return largest, ratio


@borrowing
def _basic_solution(own: Systems, states: Any, z: Any, w: Any, start: Any) -> None:
    """Solve (M z + q)_i = 0 for the basic z_i by the proximal iteration from a start, which is overwritten; the others
    are at their bounds. Write the best z and its w."""
    problem, D, r, step, own_w = own.problem, own.D, own.left, own.trial, own.other
    lower, upper = problem.lower, problem.upper
    for i in range(z.size):
        D[i] = PROXIMAL_SHIFT if states[i] == BASIC else NONBASIC
        if states[i] != BASIC:
            start[i] = lower[i] if states[i] == LOWER else upper[i]
    factorize(own, 0.0)
    least, least_ratio = np.inf, np.inf
    for k in range(PROXIMAL_STEPS + 1):
        largest, ratio = _basic_residual(problem, states, start, own_w, r)
        if not largest < FINITE:
            break
        if largest < least or ratio < least_ratio:
            for i in range(z.size):
                z[i], w[i] = start[i], own_w[i]
        is_slow = largest > SLOW_PROXIMAL * least and ratio > SLOW_PROXIMAL * least_ratio
        if ratio <= ROUNDED or is_slow or k == PROXIMAL_STEPS:
            break
        least, least_ratio = min(least, largest), min(least_ratio, ratio)
        solve_by_factors(own, r, step)
        for i in range(z.size):
            if states[i] == BASIC:
                start[i] += step[i]


@borrowing
def _cleaned(own: Systems, states: Any, z: Any, w: Any, trial: Any, best: Best) -> None:
    """Keep a solution, whose rows are right up to noise, without this noise, with further refinements."""
    problem, r, step, lower, upper = own.problem, own.left, own.trial, own.problem.lower, own.problem.upper
    for k in range(CLEANING_STEPS):
        for i in range(z.size):
            trial[i] = z[i]
        ratio = without_noise(problem, trial, w, own.other)
        keep(best, trial, min(ratio, NOISY))
        if ratio <= CLEAN or k == CLEANING_STEPS - 1:
            return
        _basic_residual(problem, states, z, w, r)
        solve_by_factors(own, r, step)
        for i in range(z.size):
            if states[i] == BASIC:
                z[i] = min(max(z[i] + step[i], lower[i]), upper[i])


@borrowing
def _exchanged(lower: Any, upper: Any, states: Any, z: Any, w: Any) -> int:
    """Exchange the states with wrong signs in a basic solution; return how many there were."""
    wrong = 0
    for i in range(z.size):
        before = states[i]
        if before == BASIC:
            if z[i] < lower[i] - WRONG_SIGN:
                states[i] = LOWER
            elif z[i] > upper[i] + WRONG_SIGN:
                states[i] = UPPER
        elif before * w[i] > WRONG_SIGN:
            states[i] = BASIC
        wrong += int(states[i] != before)
    return wrong


@borrowing
def finish(own: Systems, given: Any, near: Any, best: Best, work: Work) -> None:
    """Keep the best of the basic solutions of an active set and of those that exchanges of wrong signs lead to.

    given : the active set. near : a point near the solution."""
    problem, lower, upper, n = own.problem, own.problem.lower, own.problem.upper, near.size
    states, _, z, w, start, clipped, own_w = work
    least, last_wrong = np.inf, 4 * n
    for i in range(n):
        states[i], z[i], start[i] = given[i], 0.0, min(max(near[i], lower[i]), upper[i])
    for _ in range(EXCHANGE_ROUNDS):
        _basic_solution(own, states, z, w, start)
        residual = 0.0
        for i in range(n):
            clipped[i] = min(max(z[i], lower[i]), upper[i])
            nearest = min(max(clipped[i] - w[i], lower[i]), upper[i])
            residual = max(residual, abs(clipped[i] - nearest))
        ratio = largest_ratio(problem, clipped, own_w, NOISE)
        if ratio <= CLEAN:
            _cleaned(own, states, clipped, own_w, start, best)
            return
        keep(best, clipped, ratio)
        if not residual <= max(WORSE_FACTOR * least, FAR_RESIDUAL):
            return  # of a wrong basis, nearly singular
        least = min(residual, least)
        wrong = _exchanged(lower, upper, states, z, w)
        if wrong == 0 or wrong >= last_wrong or wrong > FEW_WRONG + WRONG_SHARE * n:
            return
        last_wrong = wrong
        for i in range(n):
            start[i] = clipped[i]
