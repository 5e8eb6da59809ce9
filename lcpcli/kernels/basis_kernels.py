"""The basic solution of a basis of a mixed problem, also without small distances, the units that its reduction is
computed in, and the entries of M other than 0, compiled by numba.

They are those of `lemke_path` and of `linalg.units` once more, for dense M of moderate numbers and few unknowns. As
numba's cache knows of changes in this file alone, it uses no kernels of others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from lcpcli.basis.free_variables import NEAR_ONE
from lcpcli.linalg.doubles import FAR_FROM_ONE, LARGEST_DOUBLE, SMALL_DISTANCE
from lcpcli.linalg.units import EXPONENT_MARGIN, LARGEST_POWER, MOST_SWEEPS, NEAR_UNITS, UNITS_FAR_APART
from lcpcli.methods.lemke_path import CORRECTIONS, DEPENDENT, SINGULAR
from lcpcli.model.box import BASIC, LOWER

OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "reassoc"}}
compiled = njit(**OPTIONS)
NUMBER, COUNT = types.float64, types.int64
VECTOR, MATRIX = (types.Array(NUMBER, d, "C", readonly=True) for d in (1, 2))
NUMBERS, PLACES = (types.Array(each, 1, "C") for each in (NUMBER, types.uint32))
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
            rows[a] = min(1.0 / largest, LARGEST_DOUBLE)
            A[a] *= rows[a]
    for c in range(k):
        largest = np.abs(A[:, c]).max()
        if largest > 0.0:
            columns[c] = min(1.0 / largest, LARGEST_DOUBLE)
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


@compiled
def _entries(A: Any) -> Any:
    """Return the rows, the columns and the sizes of the entries of A other than 0."""
    n, used = A.shape[0], 0
    of_row, of_column, sizes = np.empty(n * n, np.int64), np.empty(n * n, np.int64), np.empty(n * n)
    for i in range(n):
        row = A[i]
        for j in range(n):
            if row[j] != 0.0:
                of_row[used], of_column[used], sizes[used] = i, j, abs(row[j])
                used += 1
    return of_row[:used], of_column[:used], sizes[:used]


@compiled
def _largest(entries: Any, rows: Any, columns: Any) -> Any:
    """Return the largest entries of rows, and then of columns, with these factors."""
    (of_row, of_column, sizes), n = entries, rows.size
    largest = np.zeros(2 * n)
    for at in range(sizes.size):
        i, j = of_row[at], of_column[at]
        size = sizes[at] * rows[i] * columns[j]
        largest[i], largest[n + j] = max(largest[i], size), max(largest[n + j], size)
    return largest


@compiled
def _are_near_one(largest: Any) -> bool:
    """Return whether all of these sizes but zeros are of about size 1."""
    used = largest[largest > 0.0]
    return bool(used.size == 0 or (used.max() <= NEAR_ONE and used.min() >= 1.0 / NEAR_ONE))


@njit(types.boolean(MATRIX), **OPTIONS)
def has_near_units(M: Any) -> bool:
    """Return whether the largest entries of all rows and columns but those of zeros are of about size 1, so that
    `Reduction` leaves the units of M as they are."""
    ones = np.ones(M.shape[0])
    return bool(_are_near_one(_largest(_entries(M), ones, ones)))


@compiled
def _half_powers(largest: Any) -> Any:
    """Return half the binary logarithms of sizes, rounded to integers; 0 where a size is 0."""
    return np.rint(0.5 * np.log2(np.where(largest > 0.0, largest, 1.0)))


@compiled
def _powers(A: Any, entries: Any, largest: Any) -> Any:
    """Return the exponents of the factors of rows, and then of columns, as `linalg.units.equilibrate` finds them, from
    the largest entries; none where it would balance logarithms first."""
    n, diagonal = A.shape[0], np.abs(np.diag(A))
    least, most = diagonal.min(), largest.max()
    if least > 1.0 / FAR_FROM_ONE and most < FAR_FROM_ONE:
        first, last = -np.rint(0.5 * np.log2(most)), -np.rint(0.5 * np.log2(least))
        if first == last:
            return np.full(2 * n, first)
    for part in (largest[:n], largest[n:]):
        used = part[part > 0.0]
        if used.size and np.log2(used.max()) - np.log2(used.min()) > UNITS_FAR_APART:
            return np.empty(0)
    powers, changes, low, high = np.zeros(2 * n), _half_powers(largest), -LARGEST_POWER, LARGEST_POWER
    if changes.max() - changes.min() <= NEAR_UNITS:
        low, high = -changes.max() - EXPONENT_MARGIN, -changes.min() + EXPONENT_MARGIN
    for _ in range(MOST_SWEEPS):
        if not changes.any():
            break
        powers = np.minimum(np.maximum(powers - changes, low), high)
        if (diagonal * np.exp2(powers[:n] + powers[n:]) >= 0.5).all():
            break  # as no entry is now above 2, all largest ones lie between 1/2 and 2
        changes = _half_powers(_largest(entries, np.exp2(powers[:n]), np.exp2(powers[n:])))
    return powers


@njit(types.Tuple((types.boolean, NUMBERS, NUMBERS))(types.Array(NUMBER, 2, "C")), **OPTIONS)
def equilibrated(A: Any) -> Any:
    """Scale A as `Reduction` does; return whether these factors are known here, and those of rows and of columns."""
    n, entries = A.shape[0], _entries(A)
    rows, columns = np.ones(n), np.ones(n)
    largest = _largest(entries, rows, columns)
    if _are_near_one(largest):
        return True, rows, columns
    powers = _powers(A, entries, largest)
    if not powers.size:
        return False, rows, columns
    rows, columns = np.exp2(powers[:n]), np.exp2(powers[n:])
    of_row, of_column, _ = entries
    for at in range(of_row.size):
        A[of_row[at], of_column[at]] *= rows[of_row[at]] * columns[of_column[at]]
    return True, rows, columns


@njit(types.Tuple((PLACES, PLACES, NUMBERS))(MATRIX), **OPTIONS)
def compressed(M: Any) -> Any:
    """Return a dense M in compressed sparse rows."""
    n, used = M.shape[0], 0
    begin, columns, values = np.zeros(n + 1, np.uint32), np.empty(n * n, np.uint32), np.empty(n * n)
    for i in range(n):
        row = M[i]
        for j in range(n):
            columns[used], values[used] = j, row[j]
            used += row[j] != 0.0
        begin[i + 1] = used
    return begin, columns[:used].copy(), values[:used].copy()


@njit(NUMBERS(VECTOR, VECTOR, VECTOR), **OPTIONS)
def without_small_distances(lower: Any, upper: Any, z: Any) -> Any:
    """Return z with 0 and bounds in place of entries that are near them."""
    most, found = SMALL_DISTANCE * np.abs(z).max(), np.empty(z.size)
    for i in range(z.size):
        inside = 0.0 if abs(z[i]) <= most else z[i]
        found[i] = lower[i] if z[i] - lower[i] <= most else upper[i] if upper[i] - z[i] <= most else inside
    return found
