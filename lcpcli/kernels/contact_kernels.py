"""The next step of contacts in the plane in loops over numbers, compiled by numba: the
compact form, with the validation of its numbers; the next z, as `followed` of the
module `states` of contacts proposes it; and its acceptance tests, `answers.accepted`
and `verify.measure.decision` for dense LCPs whose scaling factors are known.
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
COLUMN = types.Array(types.int64, 2, "C", readonly=True)
BASIS = types.Array(types.int8, 1, "C", readonly=True)
STATUSES = types.Array(types.int8, 1, "C")
NEW_MATRIX = types.Array(NUMBER, 2, "C")
CONTACTS = types.Tuple((MATRIX, VECTOR, INDICES, COLUMN, VECTOR))
UNITS = types.Tuple((VECTOR, INDICES, NUMBER))
SIZES = types.UniTuple(NUMBER, 2)
SYSTEMS = types.Tuple((COUNT, COUNT, NUMBER))
NEW_STEP = types.Tuple((NUMBERS, NEW_MATRIX, STATUSES))
# Products and differences are rounded one by one, as those of numpy are.
EXACT_OPTIONS = {**OPTIONS, "fastmath": False}


@njit(**EXACT_OPTIONS)
def _fill(contacts: Any, M: Any) -> None:
    """Write the M of the compact form, as `cones.compact` returns it."""
    A, b, normals, tangents, mu = contacts
    n = b.size
    M[:] = 0.0
    for i in range(n):
        for j in range(n):
            M[i, j] = A[i, j]
        for k in range(mu.size):
            M[i, normals[k]] -= mu[k] * A[i, tangents[k, 0]]
    for k in range(mu.size):
        M[tangents[k, 0], n + k] = 1.0
        M[n + k, tangents[k, 0]] = -1.0
        M[n + k, normals[k]] = 2.0 * mu[k]


@compiled
def _range(M: Any) -> Any:
    """Return the smallest nonzero and the largest of the row maxima of |M|, which are
    not finite if an entry is not."""
    smallest, largest, total = np.inf, 0.0, 0.0
    for i in range(len(M)):
        row_maximum = 0.0
        for j in range(M.shape[1]):
            size = abs(M[i, j])
            total += size
            row_maximum = max(row_maximum, size)
        largest = max(largest, row_maximum)
        if row_maximum > 0.0:
            smallest = min(smallest, row_maximum)
    return smallest, largest if np.isfinite(total) else np.inf


@compiled
def _change(M: Any, base: Any) -> Any:
    """Return the Euclidean norm of the relative changes of the entries of a matrix;
    infinity if others are 0."""
    if M.shape != base.shape:
        return np.inf
    square, is_like = 0.0, True
    for i in range(len(M)):
        for j in range(M.shape[1]):
            is_like &= (M[i, j] != 0.0) == (base[i, j] != 0.0)
            change = (M[i, j] - base[i, j]) / (base[i, j] or 1.0)
            square += change * change
    return np.sqrt(square) if is_like else np.inf


@njit(
    types.Tuple((types.boolean, SIZES, SIZES, NUMBER))(
        CONTACTS, MATRIX, MATRIX, NEW_MATRIX, NUMBERS
    ),
    **OPTIONS,
)
def compact_form(contacts: Any, before: Any, base: Any, M: Any, q: Any) -> Any:
    """Write M and q of the compact form; return whether A is that of before, where M is
    not written; the smallest and largest of the row maxima of |M|, and of |q|, of which
    the largest is infinite if a number is not finite; and the relative change of M.

    contacts : A, b, the normal and the tangential unknowns, and mu. base : another M,
    of any shape.
    """
    A, b = contacts[0], contacts[1]
    q[: b.size] = b
    q[b.size :] = 0.0
    of_q = _range(q.reshape(-1, 1))
    if A.shape == before.shape:
        is_same = True
        for i in range(b.size):
            for j in range(b.size):
                is_same &= A[i, j] == before[i, j]
        if is_same:
            return True, (0.0, 0.0), of_q, 0.0
    _fill(contacts, M)
    return False, _range(M), of_q, _change(M, base)


@compiled
def _impulses(contacts: Any, statuses: Any, corrections: int, shift: float) -> Any:
    """Return x for these statuses, and whether it is unique."""
    A, b, normals, tangents, mu = contacts
    n = b.size
    x, is_free, slip = np.zeros(n), statuses == BASIC, np.zeros(n)
    for k in range(mu.size):
        t, f = tangents[k, 0], normals[k]
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
            t, f = tangents[k, 0], normals[k]
            if slip[t] != 0.0 and is_free[f]:
                block[a, position[f]] += A[i, t] * slip[t]
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
        t, f = tangents[k, 0], normals[k]
        if is_free[f] and slip[t] != 0.0:
            x[t] = slip[t] * x[f]
    return x, True


@compiled
def _write_motion(contacts: Any, x: Any, motion: Any) -> None:
    """Write x, w = A x + b, and the terms of its rows as `answers.Motion` has them."""
    A, b, normals, tangents, mu = contacts
    sizes = np.abs(x)
    for k in range(mu.size):
        t = tangents[k, 0]
        sizes[t] = max(sizes[t], mu[k] * abs(x[normals[k]]))
    motion[0] = x
    for i in range(b.size):
        w, terms = b[i], abs(b[i])
        for j in range(b.size):
            w += A[i, j] * x[j]
            terms += abs(A[i, j]) * sizes[j]
        motion[1, i], motion[2, i] = w, terms


@compiled
def _limits(contacts: Any, x: Any) -> Any:
    """Return the bounds of x, with the friction bounds for its normal components."""
    _, b, normals, tangents, mu = contacts
    low, high = np.zeros(b.size), np.full(b.size, np.inf)
    for k in range(mu.size):
        t = tangents[k, 0]
        high[t] = mu[k] * max(x[normals[k]], 0.0)
        low[t] = -high[t]
    return low, high


@compiled
def _is_right(contacts: Any, statuses: Any, x: Any, motion: Any) -> bool:
    """Write the motion of x, without rounding errors, and return whether all conditions
    are satisfied; where they are not, change the statuses.
    """
    n = x.size
    low, high = _limits(contacts, x)
    inside, is_wrong = x.copy(), np.zeros(n, np.bool_)
    small = SYSTEM_ROUNDING * np.abs(x).max()
    for i in range(n):
        inside[i] = min(max(x[i], low[i]), high[i])
        is_wrong[i] = abs(x[i] - inside[i]) > small and statuses[i] == BASIC
    for t in contacts[3].ravel():
        if abs(inside[t]) <= ROUNDING * high[t]:
            inside[t] = 0.0
    _write_motion(contacts, x if is_wrong.any() else inside, motion)
    w, terms = motion[1], motion[2]
    for i in range(n):
        is_pulled = statuses[i] * w[i] > SYSTEM_ROUNDING * terms[i]
        is_wrong[i] |= is_pulled and low[i] < high[i]
    if not is_wrong.any():
        return True
    for i in range(n):
        if is_wrong[i] and statuses[i] == BASIC:
            statuses[i] = LOWER if x[i] < low[i] else UPPER
        elif is_wrong[i]:
            statuses[i] = BASIC
        if high[i] == 0.0:  # a tangential unknown without a normal impulse
            statuses[i] = UPPER if w[i] < 0.0 else LOWER
    return False


@compiled
def _satisfies_laws(contacts: Any, motion: Any, tol: float) -> bool:
    """Return whether x and w satisfy the laws of contact to the tolerance, and up to
    rounding errors of a system, as `answers.accepted` requires."""
    x, w, terms = motion[0], motion[1], motion[2]
    low, high = _limits(contacts, x)
    for i in range(x.size):
        rounding = min(SYSTEM_ROUNDING, tol) * terms[i]
        nearest = min(max(x[i], low[i]), high[i])
        may_fall = w[i] >= -rounding or nearest == high[i]
        may_rise = w[i] <= rounding or nearest == low[i]
        if not (may_fall and may_rise):
            return False
    return True


@compiled
def _write_z(contacts: Any, motion: Any, z: Any) -> None:
    """Write the z of a motion as `answers.point_of` does."""
    _, b, normals, tangents, mu = contacts
    n, x, w, terms = b.size, motion[0], motion[1], motion[2]
    z[:n] = x
    for k in range(mu.size):
        t = tangents[k, 0]
        friction = mu[k] * x[normals[k]]
        zero, rounding = SYSTEM_ROUNDING * terms[t], ROUNDING * friction
        z[t] = x[t] + friction
        if z[t] <= rounding and w[t] > zero:
            z[t] = 0.0
        elif z[t] >= 2 * friction - rounding and w[t] < -zero:
            z[t] = 2 * friction
        z[n + k] = -w[t] if w[t] < -zero else 0.0


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
    types.Tuple((COUNT, types.boolean))(
        *(CONTACTS, BASIS, SYSTEMS, MATRIX, VECTOR, UNITS, NUMBER, NEW_STEP)
    ),
    **OPTIONS,
)
def contact_step(
    contacts: Any,
    basis: Any,
    systems: Any,
    M: Any,
    q: Any,
    units: Any,
    tol: float,
    new_step: Any,
) -> Any:
    """Write the next step; return the number of systems that led to it, 0 if none did,
    and whether its z solves the LCP with rounding errors of ROW_ROUNDING and its x the
    laws of contact.

    contacts : A, b, the normal and the tangential unknowns, and mu; the bounds of all
        others are 0 and infinity. basis : of the z before.
    systems : how many are solved at most, the corrections of each solution, and the
        relative shift of their diagonals.
    units : log2 of R, empty if it is not known, the components of the rows, and by how
        many binary digits quotients of two R_i may differ.
    new_step : z, the motion, with rows x, w and its terms, and the basis of z.
    """
    max_systems, corrections, shift = systems
    z, motion, new_basis = new_step
    n, tangents = motion.shape[1], contacts[3]
    statuses = basis[:n].copy()
    for k in range(len(tangents)):
        if basis[n + k] == BASIC:
            statuses[tangents[k, 0]] = UPPER
    for number in range(1, max_systems + 1):
        x, is_unique = _impulses(contacts, statuses, corrections, shift)
        if not is_unique or not np.isfinite(x).all():
            break
        if _is_right(contacts, statuses, x, motion):
            _write_z(contacts, motion, z)
            for i in range(z.size):
                new_basis[i] = BASIC if z[i] > 0.0 else LOWER
            is_certain = _surely_solves(M, q, units, tol, z)
            return number, is_certain and _satisfies_laws(contacts, motion, tol)
    return 0, False
