"""The basic solution of a basis, with its judgement by the whole measure, compiled by numba.

These are `path_end._basic`, `Measure.surely_solves` and `linalg.units.units` once more, for dense LCPs with
moderate numbers. Where they find no solution beyond doubt, the methods themselves decide. As numba's cache knows of
changes in this file alone, it uses no kernels of others.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types

from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.rounding import TINY_TERMS
from lcpcli.linalg.units import MOST_CG_STEPS, SETTLED_ERROR
from lcpcli.methods.free_variables import NEAR_ONE
from lcpcli.methods.path_end import CORRECTIONS, SINGULAR
from lcpcli.verify.measure import DROWNED, ROUNDING

OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}
compiled = njit(**OPTIONS)
NUMBER, COUNT = types.float64, types.int64
VECTOR, MATRIX = (types.Array(NUMBER, d, "C", readonly=True) for d in (1, 2))
NUMBERS, PARTS = types.Array(NUMBER, 1, "C"), types.Array(COUNT, 1, "C")
UNITS = types.Tuple((NUMBERS, NUMBERS, PARTS, PARTS, COUNT))
STATES = types.Array(types.boolean, 1, "C", readonly=True)


@compiled
def _label(M: Any, i: int, count: int, rows: Any, columns: Any, queue: Any) -> None:
    """Give the number of a component to row i and to all that is connected with it."""
    n = rows.size
    rows[i], queue[0], first, last = count, i, 0, 1
    while first < last:
        row = queue[first]
        first += 1
        for j in range(n):
            if M[row, j] != 0.0 and columns[j] < 0:
                columns[j] = count
                for other in range(n):
                    if rows[other] < 0 and M[other, j] != 0.0:
                        rows[other], queue[last] = count, other
                        last += 1


@compiled
def _units_of(M: Any) -> Any:
    """Return the same as `linalg.units.units` for a dense M of moderate numbers."""
    n, entries = M.shape[0], np.count_nonzero(M)
    of_row, of_column = np.empty(entries, np.int64), np.empty(entries, np.int64)
    e, counts, at = np.zeros((2, n)), np.zeros((2, n)), 0
    for i in range(n):
        for j in range(n):
            if M[i, j] != 0.0:
                exponent = float(math.frexp(M[i, j])[1])
                e[0, i] += exponent
                e[1, j] += exponent
                counts[0, i] += 1.0
                counts[1, j] += 1.0
                of_row[at], of_column[at] = i, j
                at += 1
    counts = np.maximum(counts, 1.0)
    x, residual = np.zeros((2, n)), -e
    step = residual / counts
    direction, size = step.copy(), (residual * step).sum()
    for _ in range(MOST_CG_STEPS):
        if not np.abs(step).max() > SETTLED_ERROR:
            break
        image = counts * direction
        for at in range(entries):
            i, j = of_row[at], of_column[at]
            image[0, i] += direction[1, j]
            image[1, j] += direction[0, i]
        length = size / (direction * image).sum()
        x += length * direction
        residual -= length * image
        step = residual / counts
        before, size = size, (residual * step).sum()
        direction = step + size / before * direction
    rows, columns, queue, count = np.full(n, -1), np.full(n, -1), np.empty(n, np.int64), 0
    for i in range(n):
        if rows[i] < 0:
            _label(M, i, count, rows, columns, queue)
            count += 1
    for j in range(n):
        if columns[j] < 0:
            columns[j] = count
            count += 1
    return x[0].copy(), x[1].copy(), rows, columns, count


@njit(UNITS(MATRIX), **OPTIONS)
def units_of(M: Any) -> Any:
    """Return `_units_of` a matrix."""
    return _units_of(M)


@compiled
def _solves(M: Any, q: Any, tol: float, z: Any) -> bool:
    """Return whether a z >= 0 solves the problem, whatever the rounding errors in w are."""
    n, is_closed = q.size, True
    terms, worst = np.empty(n), np.empty(n)
    for i in range(n):
        w, total = q[i], abs(q[i])
        for j in range(n):
            term = M[i, j] * z[j]
            w += term
            total += abs(term)
        terms[i], worst[i] = total, (abs(w) if z[i] > 0.0 else -w) + ROW_ROUNDING * total
        if not worst[i] <= tol * abs(q[i]):
            is_closed = False
            if not worst[i] <= max(tol, ROUNDING) * total:
                return False
        if total <= TINY_TERMS:
            for j in range(n):
                if M[i, j] != 0.0 and z[j] != 0.0:
                    return False  # the product may have underflowed
    return is_closed or _are_within_caps(M, q, tol, terms, worst)


@compiled
def _are_within_caps(M: Any, q: Any, tol: float, terms: Any, worst: Any) -> bool:
    """Return whether violations of at most `worst` are allowed by the caps of their rows, as `Measure.caps` has them
    for an LCP."""
    rho, _, parts, _, count = _units_of(M)
    sizes, of_reference = np.full(count, -np.inf), np.full(count, -np.inf)
    for i in range(q.size):
        if q[i] != 0.0:
            size = np.log2(abs(q[i])) + rho[i]
            of_reference[parts[i]] = max(of_reference[parts[i]], size)
            if q[i] < 0.0:
                sizes[parts[i]] = max(sizes[parts[i]], size)
    for i in range(q.size):
        size = sizes[parts[i]] if sizes[parts[i]] > -np.inf else of_reference[parts[i]]
        cap = max(2.0 ** (size - rho[i]), abs(q[i])) if size > -np.inf else np.inf
        if not worst[i] <= max(tol * min(terms[i], cap), ROUNDING * min(terms[i], DROWNED * cap)):
            return False
    return True


@njit(types.boolean(MATRIX, VECTOR, NUMBER, VECTOR), **OPTIONS)
def surely_solves(M: Any, q: Any, tol: float, z: Any) -> bool:
    """Return `_solves` of a point."""
    return bool(_solves(M, q, tol, z))


@compiled
def _equilibrated(M: Any, B: Any) -> Any:
    """Return M_BB with rows and columns of largest entries 1, and their factors."""
    k = B.size
    A, rows, columns = np.empty((k, k)), np.ones(k), np.ones(k)
    for a in range(k):
        largest = 0.0
        for c in range(k):
            A[a, c] = M[B[a], B[c]]
            largest = max(largest, abs(A[a, c]))
        if largest > 0.0:
            rows[a] = 1.0 / largest
            A[a] *= rows[a]
    for c in range(k):
        largest = np.abs(A[:, c]).max()
        if largest > 0.0:
            columns[c] = 1.0 / largest
            A[:, c] *= columns[c]
    return A, rows, columns


@njit(types.Tuple((types.boolean, NUMBERS))(MATRIX, VECTOR, STATES, NUMBER), **OPTIONS)
def solve_at(M: Any, q: Any, basic: Any, tol: float) -> Any:
    """Return whether the basic solution of a basis surely solves the problem, and its z, of shape (n,)."""
    z, B = np.zeros(q.size), basic.nonzero()[0]
    if not B.size:
        return q.min() >= 0.0, z
    A, rows, columns = _equilibrated(M, B)
    try:
        inverse = np.linalg.inv(A)
    except Exception:  # numba catches no other: M_BB is singular
        return False, z
    if not np.abs(inverse).max() < 1.0 / SINGULAR:
        return False, z
    r = np.empty(B.size)
    for _ in range(CORRECTIONS):
        for a in range(B.size):
            total = q[B[a]]
            for c in range(B.size):
                total += M[B[a], B[c]] * z[B[c]]
            r[a] = rows[a] * total
        step = inverse @ r
        for a in range(B.size):
            z[B[a]] -= columns[a] * step[a]
    for i in B:
        z[i] = max(z[i], 0.0)
    return _solves(M, q, tol, z), z


@njit(types.boolean(MATRIX), **OPTIONS)
def has_near_units(M: Any) -> bool:
    """Return whether the largest entries of all rows and columns but those of zeros are of about size 1, so that
    `Reduction` leaves the units of M as they are."""
    n = M.shape[0]
    sizes = np.zeros(2 * n)
    for i in range(n):
        for j in range(n):
            size = abs(M[i, j])
            sizes[i], sizes[n + j] = max(sizes[i], size), max(sizes[n + j], size)
    used = sizes[sizes > 0.0]
    return used.size == 0 or (used.max() <= NEAR_ONE and used.min() >= 1.0 / NEAR_ONE)
