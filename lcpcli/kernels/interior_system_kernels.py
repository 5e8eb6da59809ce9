"""The linear systems of `interior_systems`, (M + D) x = b, compiled by numba: refined against M + D with the factors of
S (M + D + rho), and by GMRES with these as its preconditioner where refinement is slow.

Y. Saad, A flexible inner-outer preconditioned GMRES algorithm, SIAM J. Sci. Comput. 14 (1993) 461-469.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lcpcli.kernels import ldl_kernels as ldl
from lcpcli.kernels.interior_scaling_kernels import Scaled, times
from lcpcli.kernels.ldl_kernels import Factors, arithmetic, borrowing, compiled
from lcpcli.methods.interior_systems import (
    DOUBTFUL_RESIDUAL,
    GMRES_STEPS,
    LEAST_ACCURACY,
    POOR_FACTORS,
    SLOW_REFINEMENT,
    SYSTEM_REFINEMENTS,
    USELESS_FACTORS,
)

NEAR_GOAL = 10.0  # times the accuracy that is asked for: what is left after refinement that does not matter
GMRES_ACCURACY = 0.1  # of that accuracy, as its own estimate may be too good
RHO, LEAST_RHO, MOST_RHO, OF_FACTORS, LEFT, USED_GMRES = range(6)  # in `Systems.state`
NOTHING = 1e-300
FINITE = 1e300


class Systems(NamedTuple):
    """The systems with one M.

    problem, diagonal : with M, and its diagonal. factors : of S (M + D + rho). D, weights : D and 1 / (1 + D).
    state : rho, its least and its largest value, and, since the last factorization, the largest residuals relative to
    the right-hand side, of the factors and of what was left, and whether GMRES was used.
    left, other, trial : work of shape (n,); `left` is b - (M + D) x after a solve. counts : of factorizations.
    """

    problem: Scaled
    diagonal: Any
    factors: Factors
    D: Any
    weights: Any
    state: Any
    left: Any
    other: Any
    trial: Any
    counts: Any


@compiled
def systems_of(problem: Scaled, diagonal: Any, factors: Factors) -> Systems:
    """Return the systems with the M of a problem, before anything is factorized."""
    n = diagonal.size
    work = np.empty(n), np.empty(n), np.empty(n)
    return Systems(problem, diagonal, factors, np.zeros(n), np.empty(n), np.zeros(6), *work, np.zeros(1, np.int64))


@borrowing
def factorize(own: Systems, shift: float) -> None:
    """Compute the factors of S (M + D + shift) for the D that `own` has."""
    diagonal, signs, M_diagonal, D, weights = own.factors.diagonal, own.factors.signs, own.diagonal, own.D, own.weights
    for i in range(D.size):
        diagonal[i] = signs[i] * (M_diagonal[i] + D[i] + shift)
        weights[i] = 1.0 / (1.0 + D[i])
    ldl.factorize(own.factors)
    own.counts[0] += 1


@borrowing
def factorize_anew(own: Systems) -> None:
    """Adapt rho to the last systems, and factorize M + D + rho."""
    state = own.state
    if state[OF_FACTORS] > POOR_FACTORS:
        state[RHO] = min(state[RHO] * 10.0, state[MOST_RHO])
    elif state[USED_GMRES] > 0.0 or state[LEFT] > DOUBTFUL_RESIDUAL:
        state[RHO] = max(state[RHO] / 10.0, state[LEAST_RHO])
    state[OF_FACTORS] = state[LEFT] = state[USED_GMRES] = 0.0
    factorize(own, state[RHO])


@borrowing
def solve_by_factors(own: Systems, b: Any, x: Any) -> None:
    """Write the solution of (M + D + rho) x = b into x."""
    signs = own.factors.signs
    for i in range(x.size):
        x[i] = signs[i] * b[i]
    ldl.solve(own.factors, x)


@arithmetic
def _residual(own: Systems, b: Any, x: Any, r: Any) -> float:
    """Write b - (M + D) x into r; return its weighted norm, infinite where it is not finite."""
    begin, columns, values, D, weights = own.problem.begin, own.problem.columns, own.problem.values, own.D, own.weights
    norm, is_finite = 0.0, True
    for i in range(x.size):
        total = D[i] * x[i]
        for p in range(begin[i], begin[i + 1]):
            total += values[p] * x[columns[p]]
        r[i] = b[i] - total
        size = abs(r[i]) * weights[i]
        norm = max(norm, size)
        is_finite = is_finite and size < FINITE
    return norm if is_finite else np.inf


@borrowing
def _norm(own: Systems, b: Any, x: Any, factor: float) -> float:
    """Return the weighted norm of b - factor x."""
    norm, weights = 0.0, own.weights
    for i in range(b.size):
        norm = max(norm, abs(b[i] - factor * x[i]) * weights[i])
    return norm


@borrowing
def solve(own: Systems, b: Any, target: float, x: Any) -> bool:
    """Write x with (M + D) x = b into x, and what is left of b into `own.left`, whose weighted norm is at most the
    target, or LEAST_ACCURACY times the norm of b, if that can be attained; return whether x is finite."""
    state, r = own.state, own.left
    size = max(_norm(own, b, b, 0.0), NOTHING)
    goal = max(LEAST_ACCURACY * size, target)
    while True:
        solve_by_factors(own, b, x)
        left = _residual(own, b, x, r)
        of_factors = _norm(own, r, x, state[RHO]) if left < FINITE else np.inf
        if of_factors <= USELESS_FACTORS * size or state[RHO] >= state[MOST_RHO]:
            break
        state[RHO] = state[LEAST_RHO] = min(state[RHO] * 10.0, state[MOST_RHO])
        factorize(own, state[RHO])
    if not of_factors < FINITE:
        return False
    state[OF_FACTORS] = max(state[OF_FACTORS], of_factors / size)
    left = _refined(own, b, x, left, goal)
    if left > max(NEAR_GOAL * goal, DOUBTFUL_RESIDUAL * size):
        state[USED_GMRES] = 1.0
        left = _by_gmres(own, b, x, left, goal)
    if left > NEAR_GOAL * goal:
        state[LEFT] = max(state[LEFT], left / size)
    return True


@borrowing
def _refined(own: Systems, b: Any, x: Any, left: float, goal: float) -> Any:
    """Refine x, as long as what is left falls fast; return its norm."""
    r, other, trial = own.left, own.other, own.trial
    for _ in range(SYSTEM_REFINEMENTS):
        if left <= goal:
            break
        solve_by_factors(own, r, trial)
        for i in range(x.size):
            trial[i] += x[i]
        norm = _residual(own, b, trial, other)
        if not norm < left:
            break
        rate, left = norm / left, norm
        for i in range(x.size):
            x[i], r[i] = trial[i], other[i]
        if rate > SLOW_REFINEMENT:
            break
    return left


@arithmetic
def _orthogonalized(V: Any, k: int, h: Any) -> Any:
    """Make V[k] orthogonal to the rows before it, twice against rounding, and of length 1; add the coefficients to h,
    and return the length it had."""
    v = V[k]
    for _ in range(2):
        for a in range(k):
            along = 0.0
            for i in range(v.size):
                along += V[a, i] * v[i]
            h[a] += along
            for i in range(v.size):
                v[i] -= along * V[a, i]
    length = 0.0
    for i in range(v.size):
        length += v[i] * v[i]
    length = np.sqrt(length)
    for i in range(v.size if length > 0.0 else 0):
        v[i] /= length
    return length


@compiled
def _by_gmres(own: Systems, b: Any, x: Any, left: float, goal: float) -> Any:
    """Improve x by at most GMRES_STEPS, which minimize the weighted 2-norm of what is left; return its norm."""
    n, D, weights, r, other, trial = x.size, own.D, own.weights, own.left, own.other, own.trial
    V, Z = np.empty((GMRES_STEPS + 1, n)), np.empty((GMRES_STEPS, n))
    R, g, turn = np.zeros((GMRES_STEPS, GMRES_STEPS + 1)), np.zeros(GMRES_STEPS + 1), np.zeros((GMRES_STEPS, 2))
    for i in range(n):
        V[0, i] = weights[i] * r[i]
    g[0] = _orthogonalized(V, 0, R[0])
    steps = 0
    for k in range(GMRES_STEPS):
        for i in range(n):
            trial[i] = V[k, i] / weights[i]
        solve_by_factors(own, trial, Z[k])
        times(own.problem, Z[k], other)
        for i in range(n):
            V[k + 1, i] = weights[i] * (other[i] + D[i] * Z[k, i])
        h = R[k]
        h[k + 1] = _orthogonalized(V, k + 1, h)
        for a in range(k):  # Givens' rotations
            h[a], h[a + 1] = turn[a, 0] * h[a] + turn[a, 1] * h[a + 1], turn[a, 0] * h[a + 1] - turn[a, 1] * h[a]
        length = np.hypot(h[k], h[k + 1])
        if not 0.0 < length < FINITE:
            break
        turn[k, 0], turn[k, 1] = h[k] / length, h[k + 1] / length
        h[k], g[k + 1], g[k] = length, -turn[k, 1] * g[k], turn[k, 0] * g[k]
        steps = k + 1
        if abs(g[k + 1]) <= GMRES_ACCURACY * goal:
            break
    for i in range(n):
        trial[i] = x[i]
    for a in range(steps - 1, -1, -1):
        for c in range(a + 1, steps):
            g[a] -= R[c, a] * g[c]
        g[a] /= R[a, a]
        for i in range(n):
            trial[i] += g[a] * Z[a, i]
    norm = _residual(own, b, trial, other)
    if not norm < left:
        return left
    for i in range(n):
        x[i], r[i] = trial[i], other[i]
    return norm
