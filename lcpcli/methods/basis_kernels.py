"""The basic solution of a basis of a mixed problem, compiled by numba.

It is that of `path_end` once more, for dense M and few unknowns; `measure_kernels` judge it. As numba's cache knows of
changes in this file alone, it uses no kernels of others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from lcpcli.methods.free_variables import NEAR_ONE
from lcpcli.methods.path_end import CORRECTIONS, DEPENDENT, SINGULAR
from lcpcli.model.box import BASIC, LOWER

OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "reassoc"}}
compiled = njit(**OPTIONS)
NUMBER, COUNT = types.float64, types.int64
VECTOR, MATRIX = (types.Array(NUMBER, d, "C", readonly=True) for d in (1, 2))
NUMBERS = types.Array(NUMBER, 1, "C")
STATES = types.Array(types.int8, 1, "C", readonly=True)


@compiled
def _subtract(M: Any, z: Any, rows: Any, b: Any) -> None:
    """Subtract these rows of M z from b."""
    columns = z.nonzero()[0]
    for a in range(rows.size):
        row, total = M[rows[a]], 0.0
        for j in columns:
            total += row[j] * z[j]
        b[a] -= total


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


@njit(NUMBERS(MATRIX, VECTOR, VECTOR, VECTOR, STATES), **OPTIONS)
def basic_solution(M: Any, q: Any, lower: Any, upper: Any, states: Any) -> Any:
    """Return the basic solution z of a basis, put within the bounds, shape (n,); the least one if M_BB is singular."""
    z, B = np.zeros(q.size), (states == BASIC).nonzero()[0]
    for i in range(q.size):
        if states[i] != BASIC:
            z[i] = lower[i] if states[i] == LOWER else upper[i]
    if not B.size:
        return z
    A, rows, columns = _equilibrated(M, B)
    inverse = A
    try:
        inverse = np.ascontiguousarray(np.linalg.inv(A))
        is_regular = np.abs(inverse).max() < 1.0 / SINGULAR
    except Exception:  # numba catches no other: M_BB is singular
        is_regular = False
    if not is_regular:
        inverse = np.ascontiguousarray(np.linalg.pinv(A, DEPENDENT))
    for _ in range(CORRECTIONS):
        r = -q[B]
        _subtract(M, z, B, r)
        step = inverse @ (rows * r)
        for a in range(B.size):
            z[B[a]] += columns[a] * step[a]
    for i in B:
        z[i] = min(max(z[i], lower[i]), upper[i])
    return z


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
