"""Block principal pivoting on mixed problems, compiled by numba.

It is `newton` once more, as `auto` runs it, for few unknowns; `measure_kernels` judge what it finds. M is given by the
entries of its rows: where each row begins, the columns and the values. As numba's cache knows of changes in this file
alone, it uses no kernels of others.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types

from lcpcli.auto.attempts import NEWTON_SETTLING_FACTOR, SETTLED_CHANGES
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.methods.direct import BLOCK_PATIENCE, FEW_INDEX_STEPS, HASTY_PATIENCE, MANY_WRONG, MOST_PIVOTED
from lcpcli.methods.newton import LEAST_INDEX_STEPS
from lcpcli.model.box import BASIC, LOWER, UPPER

FEW_ROWS = 48  # of M_BB, up to which LAPACK does not pay
DENSE = 0.2  # of M_BB: from this share of entries other than 0 on it does, if there are more
CORRECTIONS = 2  # of a solution
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "reassoc"}}
compiled = njit(**OPTIONS)
NUMBER, COUNT = types.float64, types.int64
VECTOR, PLACES = (types.Array(each, 1, "C", readonly=True) for each in (NUMBER, types.uint32))
NUMBERS, INDICES, STATES = (types.Array(each, 1, "C") for each in (NUMBER, COUNT, types.int8))


@compiled
def _w(entries: Any, q: Any, z: Any) -> Any:
    """Return M z + q."""
    (starts, columns, values), w = entries, q.copy()
    for i in range(q.size):
        total = 0.0
        for at in range(starts[i], starts[i + 1]):
            total += values[at] * z[columns[at]]
        w[i] += total
    return w


@compiled
def _factorize(A: Any, rows: Any) -> bool:
    """Replace A by its LU factors with row exchanges, passing over entries 0; return whether it is regular."""
    k = A.shape[0]
    others = np.empty(k, np.int64)
    for j in range(k):
        at, used, largest = j, 0, abs(A[j, j])
        for i in range(j + 1, k):
            size = abs(A[i, j])
            if size != 0.0:
                others[used], used = i, used + 1
                if size > largest:
                    at, largest = i, size
        if not largest > 0.0:
            return False
        rows[j] = at
        pivots = A[j]
        if at != j:
            for c in range(k):
                pivots[c], A[at, c] = A[at, c], pivots[c]
        for i in others[:used]:
            if A[i, j] != 0.0:
                row, factor = A[i], A[i, j] / pivots[j]
                row[j] = factor
                for c in range(j + 1, k):
                    row[c] -= factor * pivots[c]
    return True


@compiled
def _solve(A: Any, rows: Any, b: Any) -> None:
    """Replace b by the solution of the system with these factors."""
    k = A.shape[0]
    for j in range(k):
        b[j], b[rows[j]] = b[rows[j]], b[j]
    for i in range(k):
        total = b[i]
        for c in range(i):
            total -= A[i, c] * b[c]
        b[i] = total
    for i in range(k - 1, -1, -1):
        total = b[i]
        for c in range(i + 1, k):
            total -= A[i, c] * b[c]
        b[i] = total / A[i, i]


@compiled
def _state(t: float, lower: float, upper: float) -> int:
    """Return the state that z - w = t stands for, as `Box.basis_of` does for t / 2."""
    return LOWER if t <= lower else UPPER if t >= upper else BASIC


@compiled
def _order(entries: Any, n: int) -> Any:
    """Return the variables by the numbers of entries of their columns, which keeps factors sparse."""
    starts, columns, _ = entries
    counts, order, used = np.zeros(n, np.int64), np.empty(n, np.int64), 0
    for at in range(starts[n]):
        counts[columns[at]] += 1
    for count in range(n + 1):
        for j in range(n):
            if counts[j] == count:
                order[used], used = j, used + 1
        if used == n:
            break
    return order


@compiled
def _system(entries: Any, lower: Any, upper: Any, states: Any, order: Any) -> Any:
    """Return whether M_BB is regular, z with zeros in place of basic variables, and the system of the basis: the places
    of its variables, M_BB or its factors with their row exchanges, and whether these are factors."""
    starts, columns, values = entries
    n, k, place, z = states.size, 0, np.full(states.size, -1), np.empty(states.size)
    for i in order:
        z[i] = 0.0 if states[i] == BASIC else lower[i] if states[i] == LOWER else upper[i]
        if states[i] == BASIC:
            place[i], k = k, k + 1
    A, rows, used = np.zeros((k, k)), np.empty(k, np.int64), 0
    for i in range(n):
        if place[i] >= 0:
            for at in range(starts[i], starts[i + 1]):
                if place[columns[at]] >= 0:
                    A[place[i], place[columns[at]]] = values[at]
                    used += 1
    is_small = k <= FEW_ROWS or used <= DENSE * k * k
    return not is_small or _factorize(A, rows), z, (place, A, rows, is_small)


@compiled
def _correct(entries: Any, q: Any, system: Any, z: Any, w: Any) -> Any:
    """Add to z what makes w_B = 0; return whether M_BB is regular, and w."""
    place, A, rows, is_small = system
    b = np.empty(rows.size)
    for i in range(q.size):
        if place[i] >= 0:
            b[place[i]] = -w[i]
    if is_small:
        _solve(A, rows, b)
    else:
        try:
            b[:] = np.linalg.solve(A, b)
        except Exception:  # numba catches no other: M_BB is singular
            return False, w
    for i in range(q.size):
        if place[i] >= 0:
            z[i] += b[place[i]]
    return True, _w(entries, q, z)


@compiled
def _is_wrong(entries: Any, q: Any, lower: float, upper: float, state: int, z: Any, w: float, i: int) -> bool:
    """Return whether a component violates the condition of its state by more than rounding."""
    starts, columns, values = entries
    violation = max(lower - z[i], z[i] - upper) if state == BASIC else -w if state == LOWER else w
    if not violation > 0.0 or lower == upper:
        return violation != violation
    terms, largest = abs(q[i]), 0.0
    for at in range(starts[i], starts[i + 1]):
        terms += abs(values[at] * z[columns[at]])
        largest = max(largest, abs(values[at]))
    return bool(violation * (largest if state == BASIC else 1.0) > ROW_ROUNDING * terms)


@njit(types.Tuple((COUNT, NUMBERS))(PLACES, PLACES, *(VECTOR,) * 5), **OPTIONS)
def pivot_blocks(begin: Any, columns: Any, values: Any, q: Any, lower: Any, upper: Any, t: Any) -> Any:
    """Exchange wrong signs, from the states of t = z - w, as `auto` lets `newton` do; return the number of steps and z
    of the solution; if there is none, minus the number of basic solutions, and 0."""
    entries = begin, columns, values
    order, diagonal = _order(entries, q.size), np.zeros(q.size)
    n, steps, waiting, most, is_single = q.size, 0, BLOCK_PATIENCE, np.inf, False
    states, last, wrong = np.empty(n, np.int8), np.empty(n, np.int8), np.zeros(n, np.bool_)
    is_hasty, left = False, FEW_INDEX_STEPS if n <= MOST_PIVOTED else LEAST_INDEX_STEPS
    for i in range(n):
        for at in range(begin[i], begin[i + 1]):
            if columns[at] == i:
                diagonal[i] = values[at]
        is_hasty |= diagonal[i] == 0.0
        left = left if diagonal[i] > 0.0 else 0
        states[i], last[i] = _state(t[i], lower[i], upper[i]), _state(0.0, lower[i], upper[i])
    fewest = n + 1
    while True:
        is_regular, z, system = _system(entries, lower, upper, states, order)
        w = _w(entries, q, z)
        if is_regular:
            is_regular, w = _correct(entries, q, system, z, w)
        steps += 1
        if not is_regular:
            return 1 - steps, np.zeros(0)
        count, changes, first = 0, 0, n
        for i in range(n):
            wrong[i] = _is_wrong(entries, q, lower[i], upper[i], states[i], z, w[i], i)
            count, first = count + wrong[i], min(first, i) if wrong[i] else first
            now = states[i]
            if wrong[i]:
                now = BASIC if now != BASIC else UPPER if z[i] > upper[i] else LOWER
            changes, last[i] = changes + (now != last[i]), now
        if not count:
            for _ in range(CORRECTIONS):
                _, w = _correct(entries, q, system, z, w)
            return steps, np.minimum(np.maximum(z, lower), upper)
        if is_hasty and changes > most:
            return -steps, np.zeros(0)
        most = max(NEWTON_SETTLING_FACTOR * changes, float(SETTLED_CHANGES))
        is_single = is_single and not count < fewest
        if count < fewest:
            fewest, waiting = count, BLOCK_PATIENCE
        else:
            waiting -= 1
            if waiting < 1:
                waiting, left, is_single = 1, left - 1, True
                if left < 0:
                    return -steps, np.zeros(0)
            if n <= MOST_PIVOTED and waiting <= BLOCK_PATIENCE - HASTY_PATIENCE and fewest > MANY_WRONG * n:
                return -steps, np.zeros(0)
        for i in range(n):
            if wrong[i] and (not is_single or i == first):
                states[i] = last[i]
