"""From an interior point to the basic solution of its active set, also where that basis is singular.

The basic variables solve M_BB z_B = -(q + M z_N)_B by a proximal iteration, (M_BB + eps) dz = -w_B, which converges to
the solution nearest to the interior point if there are several.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.shifted_systems import SuperLU, Systems, systems
from lcpcli.methods.interior.scaling import Scaled
from lcpcli.methods.interior.steps import Point
from lcpcli.typing import Indices, Mask, Vector

SHIFT = 1e-9  # eps
ITERATIONS, SLOW = 15, 0.7
POLISHING = 2  # more iterations once the residual is rounding
ROUNDS = 5  # of exchanges of wrong signs
WORSE, FAR = 1e2, 1e-1  # exchanges end above that factor of the least natural residual so far, and above FAR
POOR = 1e-3  # the factor of w_B above which pivoting is tried
EXACT = 1e-13  # a natural residual that is rounding, in scaled units
WRONG = 1e-12  # in scaled units


def basic_solutions(problem: Scaled, at: Point) -> Iterator[tuple[Vector, bool]]:
    """z within its bounds, scaled, of the active set of a point, and after exchanges; and whether it is a solution up
    to rounding."""
    low, high = _active(problem, at)
    z = np.clip(at.z, problem.lower, problem.upper)
    least = _natural_residual(problem, z, problem.M @ z + problem.q)
    for _ in range(ROUNDS):
        z = np.where(low, problem.lower, np.where(high, problem.upper, z))
        basic = ~(low | high)
        try:
            z, w = _solved(problem, z, np.flatnonzero(basic))
        except SingularMatrix:
            return
        size = _natural_residual(problem, z, w)
        if not size <= max(WORSE * least, FAR):
            return  # of a wrong basis, nearly singular
        least = min(size, least)
        yield np.clip(z, problem.lower, problem.upper), size <= EXACT
        below, above = basic & (z < problem.lower - WRONG), basic & (z > problem.upper + WRONG)
        from_low, from_high = low & (w < -WRONG), high & (w > WRONG)
        if not (below | above | from_low | from_high).any():
            return
        low, high = (low | below) & ~from_low, (high | above) & ~from_high
        z = np.clip(z, problem.lower, problem.upper)


def _natural_residual(problem: Scaled, z: Vector, w: Vector) -> float:
    return float(np.abs(z - np.clip(z - w, problem.lower, problem.upper)).max())


def _active(problem: Scaled, at: Point) -> tuple[Mask, Mask]:
    """Where the slack of the lower, or of the upper bound is less than its multiplier."""
    n, count = problem.q.size, problem.low.size
    s_low, s_high, w_low, w_high = np.full(n, np.inf), np.full(n, np.inf), np.zeros(n), np.zeros(n)
    s_low[problem.low], w_low[problem.low] = at.s[:count], at.w[:count]
    s_high[problem.high], w_high[problem.high] = at.s[count:], at.w[count:]
    low, high = s_low < w_low, s_high < w_high
    return low & ~(high & (s_low > s_high)), high & ~(low & (s_low <= s_high))


def _solved(problem: Scaled, z: Vector, basic: Indices) -> tuple[Vector, Vector]:
    """z with its basic variables solved for, and w; by partial pivoting where diagonal pivots lose the shift."""
    if not basic.size:
        return z, problem.M @ z + problem.q
    if not is_sparse(problem.M):
        return _proximal(problem, z, basic, systems(problem.M[np.ix_(basic, basic)], None))[:2]
    block = problem.M[basic][:, basic]
    try:
        found = _proximal(problem, z, basic, systems(block, None if problem.S is None else problem.S[basic]))
    except SingularMatrix:
        found = z, z, np.inf
    if found[2] > POOR:
        try:
            found = min(found, _proximal(problem, z, basic, SuperLU(block, pivoting=True)), key=lambda each: each[2])
        except SingularMatrix:
            if found[2] == np.inf:
                raise
    return found[:2]


@np.errstate(all="ignore")
def _proximal(problem: Scaled, z: Vector, basic: Indices, solver: Systems) -> tuple[Vector, Vector, float]:
    """z and w, and the largest w of a basic variable relative to what it was."""
    M, q = problem.M, problem.q
    w = M @ z + q
    solver.factorize(np.full(basic.size, SHIFT))
    best, last = (z, w), float(np.abs(w[basic]).max())
    first = least = last
    for _ in range(ITERATIONS):
        z = z.copy()
        z[basic] -= solver.solve(w[basic])
        if not np.isfinite(z).all():
            raise SingularMatrix
        w = M @ z + q
        size = float(np.abs(w[basic]).max())
        if size < least:
            best, least = (z, w), size
        if size > SLOW * last:
            break
        last = size
    if least <= EXACT and is_sparse(M):
        polished = _polished(problem, best[0], basic, solver)
        best = polished if float(np.abs(polished[1][basic]).max()) <= EXACT else best
    return *best, least / first if first > EXACT else 0.0


def _polished(problem: Scaled, z: Vector, basic: Indices, solver: Systems) -> tuple[Vector, Vector]:
    """z with small components as accurate as large ones, by residuals in extended precision if there is one; and w."""
    M, q, z = problem.M[basic].astype(np.longdouble), problem.q[basic], z.copy()
    for _ in range(POLISHING):
        z[basic] -= solver.solve((M @ z.astype(np.longdouble) + q).astype(float))
    return z, problem.M @ z + problem.q
