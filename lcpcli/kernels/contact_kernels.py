"""The next step of contacts in the plane, and the acceptance test of its z, compiled by
numba: what `followed` of the module `states` of contacts does, and
`verify.measure.decision` for dense LCPs whose scaling factors are known, in loops over
numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from lcpcli.kernels.kernels import (
    COUNT,
    MATRIX,
    NUMBER,
    NUMBERS,
    OPTIONS,
    VECTOR,
    compiled,
    factorize,
    solve,
)
from lcpcli.linalg.doubles import ROUNDING, ROW_ROUNDING, SYSTEM_ROUNDING
from lcpcli.linalg.matrices import TINY_TERMS
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.verify.measure import CERTAIN

INDICES = types.Array(types.int64, 1, "C", readonly=True)
STATUSES = types.Array(types.int8, 1, "C")
CONTACTS = types.Tuple((MATRIX, *(VECTOR,) * 3, INDICES, INDICES, VECTOR))
UNITS = types.Tuple((VECTOR, INDICES, NUMBER))
SYSTEMS = types.Tuple((COUNT, COUNT, NUMBER))


@compiled
def _impulses(contacts: Any, statuses: Any, corrections: int, shift: float) -> Any:
    """Return x for these statuses, and whether it is unique."""
    A, b, lower, upper, normals, tangents, mu = contacts
    n = b.size
    x, is_free, slip = np.zeros(n), np.zeros(n, np.bool_), np.zeros(n)
    for i in range(n):
        is_free[i] = statuses[i] == BASIC
        if not is_free[i]:
            x[i] = upper[i] if statuses[i] == UPPER else lower[i]
    for k in range(mu.size):
        t, f = tangents[k], normals[k]
        # If a normal impulse is 0, its tangential one is 0 too.
        is_free[t] = is_free[t] and (is_free[f] or x[f] > 0.0)
        slip[t] = statuses[t] * mu[k]
        x[t] = slip[t] * x[f]
    free = is_free.nonzero()[0]
    m, largest = free.size, 0.0
    block, row = np.empty((m, m)), np.empty(m)
    position = np.full(n, -1)
    position[free] = np.arange(m)
    for a in range(m):
        i = free[a]
        row[a] = b[i]
        for j in range(n):
            row[a] += A[i, j] * x[j]
        for c in range(m):
            block[a, c] = A[i, free[c]]
        for k in range(mu.size):
            if slip[tangents[k]] != 0.0 and is_free[normals[k]]:
                block[a, position[normals[k]]] += A[i, tangents[k]] * slip[tangents[k]]
        for c in range(m):
            largest = max(largest, abs(block[a, c]))
    factors, rows = block.copy(), np.empty(m, np.int64)
    for a in range(m):
        factors[a, a] += shift * largest
    if not factorize(factors, rows, m):
        return x, False
    y = -row
    solve(factors, rows, m, y)
    for _ in range(corrections):
        residual = row.copy()
        for a in range(m):
            for c in range(m):
                residual[a] += block[a, c] * y[c]
        solve(factors, rows, m, residual)
        y -= residual
    x[free] = y
    for k in range(mu.size):
        if is_free[normals[k]] and slip[tangents[k]] != 0.0:
            x[tangents[k]] = slip[tangents[k]] * x[normals[k]]
    return x, True


@compiled
def _velocities(contacts: Any, x: Any) -> Any:
    """Return w = A x + b, and the terms of its rows as `answers.Motion` has them."""
    A, b, _, _, normals, tangents, mu = contacts
    sizes, w, terms = np.abs(x), b.copy(), np.abs(b)
    for k in range(mu.size):
        t = tangents[k]
        sizes[t] = max(sizes[t], mu[k] * abs(x[normals[k]]))
    for i in range(b.size):
        for j in range(b.size):
            w[i] += A[i, j] * x[j]
            terms[i] += abs(A[i, j]) * sizes[j]
    return w, terms


@compiled
def _motion(contacts: Any, statuses: Any, x: Any) -> Any:
    """Return x without rounding errors, w and the terms of its rows, and whether all
    conditions are satisfied; where they are not, change the statuses.
    """
    _, b, lower, upper, normals, tangents, mu = contacts
    n = b.size
    low, high, is_wrong = lower.copy(), upper.copy(), np.zeros(n, np.bool_)
    is_closed = np.zeros(n, np.bool_)
    for k in range(mu.size):
        high[tangents[k]] = mu[k] * max(x[normals[k]], 0.0)
        low[tangents[k]] = -high[tangents[k]]
        is_closed[tangents[k]] = high[tangents[k]] == 0.0
    inside, is_outside = x.copy(), False
    small = SYSTEM_ROUNDING * np.abs(x).max()
    for i in range(n):
        inside[i] = min(max(x[i], low[i]), high[i])
        is_wrong[i] = abs(x[i] - inside[i]) > small and statuses[i] == BASIC
        is_outside |= is_wrong[i]
    for t in tangents:
        if abs(inside[t]) <= ROUNDING * high[t]:
            inside[t] = 0.0
    at = x if is_outside else inside
    w, terms = _velocities(contacts, at)
    is_right = True
    for i in range(n):
        is_pulled = statuses[i] * w[i] > SYSTEM_ROUNDING * terms[i]
        is_wrong[i] |= is_pulled and low[i] < high[i]
        is_right &= not is_wrong[i]
    for i in range(n):
        if is_wrong[i] and statuses[i] == BASIC:
            statuses[i] = LOWER if x[i] < low[i] else UPPER
        elif is_wrong[i]:
            statuses[i] = BASIC
        if is_closed[i] and not is_right:
            statuses[i] = UPPER if w[i] < 0.0 else LOWER
    return at, w, terms, is_right


@compiled
def _z(contacts: Any, x: Any, w: Any, terms: Any) -> Any:
    """Return the z of an x as `answers.point_of` does."""
    _, b, _, _, normals, tangents, mu = contacts
    n = b.size
    z = np.zeros(n + mu.size)
    z[:n] = x
    for k in range(mu.size):
        t = tangents[k]
        friction = mu[k] * x[normals[k]]
        zero, rounding = SYSTEM_ROUNDING * terms[t], ROUNDING * friction
        z[t] = x[t] + friction
        if z[t] <= rounding and w[t] > zero:
            z[t] = 0.0
        elif z[t] >= 2 * friction - rounding and w[t] < -zero:
            z[t] = 2 * friction
        if w[t] < -zero:
            z[n + k] = -w[t]
    return z


@compiled
def _surely_solves(M: Any, q: Any, units: Any, tol: float, z: Any) -> bool:
    """Return whether z >= 0 solves an LCP with rounding errors of ROW_ROUNDING, by the
    terms of its rows and bounds on their caps as `measure.least_caps` computes them.
    """
    rho, parts, digits = units
    n = q.size
    sizes = np.full(rho.size, -np.inf)
    for i in range(rho.size):
        if q[i] < 0.0:
            sizes[parts[i]] = max(sizes[parts[i]], np.log2(-q[i]) + rho[i])
    for i in range(n):
        w, terms = q[i], abs(q[i])
        if not z[i] >= 0.0:
            return False
        for j in range(n):
            term = M[i, j] * z[j]
            w += term
            terms += abs(term)
        worst = (abs(w) if z[i] > 0.0 else -w) + ROW_ROUNDING * terms
        if terms <= TINY_TERMS:
            for j in range(n):
                if M[i, j] != 0.0 and z[j] != 0.0:
                    return False  # the product may have underflowed
        if not worst <= tol * abs(q[i]):
            if not rho.size:
                return False
            cap = CERTAIN * 2.0 ** (sizes[parts[i]] - rho[i] - digits)
            if not worst <= tol * min(terms, cap):
                return False
    return True


@njit(
    types.Tuple((COUNT, types.boolean, *(NUMBERS,) * 4))(
        CONTACTS, STATUSES, SYSTEMS, MATRIX, VECTOR, UNITS, NUMBER
    ),
    **OPTIONS,
)
def contact_step(
    contacts: Any, statuses: Any, systems: Any, M: Any, q: Any, units: Any, tol: float
) -> Any:
    """Return the number of systems that led to a solution, 0 if none did; whether z
    solves the LCP with rounding errors of ROW_ROUNDING; and z, x, w and its terms.

    contacts : A, b, the bounds, the normal and the tangential unknowns, and mu.
    statuses : of each unknown, to be changed. systems : how many are solved at most,
    the corrections of each solution, and the relative shift of their diagonals.
    units : log2 of R, empty if it is not known, the components of the rows, and by how
        many binary digits quotients of two R_i may differ.
    """
    max_systems, corrections, shift = systems
    for number in range(1, max_systems + 1):
        x, is_unique = _impulses(contacts, statuses, corrections, shift)
        if not is_unique or not np.isfinite(x).all():
            break
        x, w, terms, is_right = _motion(contacts, statuses, x)
        if is_right:
            z = _z(contacts, x, w, terms)
            return number, _surely_solves(M, q, units, tol, z), z, x, w, terms
    nothing = np.zeros(0)
    return 0, False, nothing, nothing, nothing, nothing
