"""Block pivoting and the judgement of its answers in loops over numbers, compiled by
numba.

These are `newton` and the first bound of `Measure.surely_solves` once more, for dense
LCPs of few unknowns: for ten of them, calls of numpy take a hundred times as long as
the arithmetic. Where they find no solution beyond doubt, the methods themselves decide.
All are compiled when `kernels.compiled` loads this file, or are in a cache.

Block pivoting on mixed problems is `newton` as `auto` runs it, for few unknowns;
`measure_kernels` judge what it finds. M is given by the entries of its rows: where each
row begins, the columns and the values.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import register_jitable

from lcpcli.auto.attempts import NEWTON_SETTLING_FACTOR, SETTLED_CHANGES
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.matrices import TINY_TERMS
from lcpcli.methods import direct
from lcpcli.methods.newton import MAX_LEAST_INDEX_STEPS
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.verify.enclosure import open_signs, regular_change
from lcpcli.verify.final_states import HIDDEN_TERM, LONG_NUMBER, SURE_DIGITS
from lcpcli.verify.measure import CERTAIN, FEW_UNKNOWNS

OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc"},
}
compiled = njit(**OPTIONS)
# What one kernel calls once: numba takes half as long.
inlined = njit(inline="always", **OPTIONS)
register_jitable(nogil=True, error_model="numpy")(regular_change)
_safeguarded, _is_hopeless, _open_signs = map(
    compiled, (direct.safeguarded, direct.is_hopeless, open_signs)
)
NUMBER, COUNT = types.float64, types.int64
VECTOR, MATRIX, MATRICES = (
    types.Array(NUMBER, d, "C", readonly=True) for d in (1, 2, 3)
)
NUMBERS = types.Array(NUMBER, 1, "C")
BASIC_ONES = types.Array(types.boolean, 1, "C", readonly=True)
FOUND = types.Tuple((COUNT, COUNT, NUMBERS))


# `_factorize_thin` takes 4 times as long for full matrices of 4 rows, 3.3 with 10, 2.6
# with 20 and 1.5 with 50; for tridiagonal ones 3.4, 1.5, .7 and .2 times.
@compiled
def _factorize(A: Any, rows: Any, k: int) -> bool:
    """Replace the leading k-by-k block of A by its LU factors with row exchanges;
    return whether it is regular.

    Two columns are eliminated at a time, as that halves the passes over the rest."""
    for first in range(0, k, 2):
        last = min(first + 2, k)
        for j in range(first, last):
            at = j
            for i in range(j + 1, k):
                if abs(A[i, j]) > abs(A[at, j]):
                    at = i
            if not abs(A[at, j]) > 0.0:
                return False
            rows[j] = at
            if at != j:
                for c in range(k):
                    A[j, c], A[at, c] = A[at, c], A[j, c]
            for i in range(j + 1, k):
                A[i, j] /= A[j, j]
                for c in range(j + 1, last):
                    A[i, c] -= A[i, j] * A[j, c]
        pivots, others = A[first], A[last - 1]
        for c in range(last, k):
            others[c] -= others[first] * pivots[c]
        for i in range(last, k):
            row, factor, other = A[i], A[i, first], A[i, last - 1]
            for c in range(last, k):
                row[c] -= factor * pivots[c] + other * others[c]
    return True


@compiled
def _solve(A: Any, rows: Any, k: int, b: Any) -> None:
    """Replace b by the solution of the system with these factors."""
    for j in range(k):
        at = rows[j]
        b[j], b[at] = b[at], b[j]
    for i in range(1, k):
        total = b[i]
        for c in range(i):
            total -= A[i, c] * b[c]
        b[i] = total
    for i in range(k - 1, -1, -1):
        total = b[i]
        for c in range(i + 1, k):
            total -= A[i, c] * b[c]
        b[i] = total / A[i, i]


@inlined
def _basic_solution(
    M: Any, q: Any, basic: Any, A: Any, rows: Any, P: Any, z: Any, b: Any
) -> int:
    """Write the z of a basis into z, and factors of M_PP into A; return the order of
    M_PP, -1 if it is singular."""
    k = 0
    for i in range(q.size):
        z[i] = 0.0
        if basic[i]:
            P[k] = i
            k += 1
    for a in range(k):
        b[a] = -q[P[a]]
        for c in range(k):
            A[a, c] = M[P[a], P[c]]
    if not _factorize(A, rows, k):
        return -1
    _solve(A, rows, k, b)
    for a in range(k):
        z[P[a]] = b[a]
    return k


@compiled
def _repeats(M: Any, q: Any, i: int, k: int, P: Any) -> bool:
    """Return whether row i is one of the basic rows but for the sign, as far as z_P
    goes, so that w_i = 0."""
    for a in range(k):
        same, opposite = q[i] == q[P[a]], q[i] == -q[P[a]]
        for c in range(k if same or opposite else 0):
            same &= M[i, P[c]] == M[P[a], P[c]]
            opposite &= M[i, P[c]] == -M[P[a], P[c]]
        if same or opposite:
            return True
    return False


# For dense M `pivot_blocks` would do as well, but takes 2 times as long with 4
# unknowns, 2.5 with 10, 3.5 with 20 and 4 with 50; for tridiagonal M 2, 2.5, 2 and .8.
@inlined
def _block_pivoting(
    M: Any,
    q: Any,
    basic: Any,
    is_start: bool,
    A: Any,
    rows: Any,
    P: Any,
    z: Any,
    b: Any,
) -> tuple[int, int]:
    """Exchange wrong signs, from a basis, as `newton` does with its safeguard; return
    the order of the last M_PP, -1 if there is no solution, and the number of steps.

    is_start : whether the basis is a start that is given up for q < 0 if it is not near
        a solution's."""
    n, k, steps, single = q.size, 0, 0, False
    fewest, waiting, left = n + 1, direct.BLOCK_PATIENCE, direct.FEW_INDEX_STEPS
    wrong = np.empty(n, np.bool_)
    for i in range(n):
        k += basic[i] or q[i] < 0.0
    if not k:
        z[:] = 0.0
        return 0, 0
    while True:
        k = _basic_solution(M, q, basic, A, rows, P, z, b)
        steps += 1
        if k < 0 and not is_start:
            return k, steps
        count, first = 0, n
        for i in range(n):
            value = z[i]
            if not basic[i]:
                value = q[i]
                for c in range(k):
                    value += M[i, P[c]] * b[c]
            wrong[i] = not value >= 0.0 and (basic[i] or not _repeats(M, q, i, k, P))
            if wrong[i]:
                count += 1
                first = min(first, i)
        if is_start and (k < 0 or count > direct.MAX_WRONG * n):
            for i in range(n):
                basic[i] = q[i] < 0.0
            is_start = False
            continue
        is_start = False
        if not count:
            return k, steps
        fewest, waiting, left, single = _safeguarded(
            fewest, waiting, left, single, count
        )
        if left < 0 or _is_hopeless(fewest, waiting, n):
            return -1, steps
        for i in range(n):
            if wrong[i] and (not single or i == first):
                basic[i] = not basic[i]


@compiled
def _is_capped(M: Any, q: Any, i: int, violation: float, tol: float) -> bool:
    """Return whether a violation of row i is at most tol times what
    `measure.least_caps` returns."""
    largest = q.argmin()
    logarithm = 0.0
    for k in range(q.size):
        for j in range(q.size):
            if M[k, j] == 0.0:
                return False
    for j in range(q.size):
        logarithm += np.log2(abs(M[i, j] / M[largest, j]))
    cap = CERTAIN * -q[largest] * 2.0 ** (logarithm / q.size)
    return bool(violation <= tol * cap)


@inlined
def _judged(
    M: Any, q: Any, tol: float, k: int, A: Any, rows: Any, P: Any, z: Any, b: Any
) -> int:
    """Refine z by its residual, with the factors of M_PP; return what it is, as the
    kernel does."""
    n = q.size
    for a in range(k):
        total = q[P[a]]
        for c in range(k):
            total += M[P[a], P[c]] * z[P[c]]
        b[a] = total
    _solve(A, rows, k, b)
    for a in range(k):
        z[P[a]] = max(z[P[a]] - b[a], 0.0)
    found = direct.CERTAIN
    for i in range(n):
        w, terms = q[i], abs(q[i])
        for j in range(n):
            term = M[i, j] * z[j]
            w += term
            terms += abs(term)
        worst = (abs(w) if z[i] > 0.0 else -w) + ROW_ROUNDING * terms
        is_small = worst <= tol * abs(q[i])
        if not (is_small or (worst <= tol * terms and _is_capped(M, q, i, worst, tol))):
            found = direct.CANDIDATE
        if terms <= TINY_TERMS:
            for j in range(n):
                if M[i, j] != 0.0 and z[j] != 0.0:
                    found = direct.CANDIDATE  # the product may have underflowed
    return found


@inlined
def _hides_terms(q: Any, largest: float, z: Any) -> bool:
    """Return what `final_states.is_doubtful` asks first, of numbers that are not
    long."""
    least_z, largest_z, least_q, largest_q = np.inf, 0.0, np.inf, 0.0
    for i in range(q.size):
        if z[i] != 0.0:
            least_z, largest_z = min(least_z, z[i]), max(largest_z, z[i])
        if q[i] != 0.0:
            least_q, largest_q = min(least_q, abs(q[i])), max(largest_q, abs(q[i]))
    return min(largest * least_z, least_q) < HIDDEN_TERM * max(
        largest * largest_z, largest_q
    )


@inlined
def _is_sure(M: Any, q: Any, k: int, P: Any, z: Any) -> bool:
    """Return whether a solution with the states of z surely differs from it by its last
    digits alone."""
    is_open = _open_signs(M, q, P[:k], z, SURE_DIGITS)
    for i in range(q.size):
        if is_open[i] and (z[i] > 0.0 or not _repeats(M, q, i, k, P)):
            return False
    return True


@njit(FOUND(MATRIX, VECTOR, BASIC_ONES, types.boolean, NUMBER, NUMBER), **OPTIONS)
def solve_one(
    M: Any, q: Any, basic: Any, is_start: bool, largest: float, tol: float
) -> Any:
    """Return what was found for one problem from a basis, the steps of `newton`, and z
    of shape (n,)."""
    n = q.size
    A, rows, P, z, b = (
        np.empty((n, n)),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n),
        np.empty(n),
    )
    k, steps = _block_pivoting(M, q, basic.copy(), is_start, A, rows, P, z, b)
    if k < 0:
        return direct.NOTHING, steps, z
    found = _judged(M, q, tol, k, A, rows, P, z, b) if k else direct.CERTAIN
    is_long = n > 0 and max(largest, np.abs(q).max()) > LONG_NUMBER
    is_open = n <= FEW_UNKNOWNS and (
        is_long or (_hides_terms(q, largest, z) and not _is_sure(M, q, k, P, z))
    )
    return direct.NOTHING if is_open else found, steps, z


@njit(
    types.void(
        MATRICES,
        MATRIX,
        VECTOR,
        NUMBER,
        types.Array(NUMBER, 2, "C"),
        types.Array(COUNT, 2, "C"),
    ),
    **OPTIONS,
)
def solve_rows(M: Any, Q: Any, largest: Any, tol: float, Z: Any, found: Any) -> None:
    """Solve the problems with the rows of Q, each with its M or all with one; write
    their z and the rest into rows."""
    for i in range(Q.shape[0]):
        own = min(i, M.shape[0] - 1)
        found[i, 0], found[i, 1], z = solve_one(
            M[own], Q[i], Q[i] < 0.0, False, largest[own], tol
        )
        for j in range(z.size):
            Z[i, j] = z[j]


FEW_ROWS = 48  # of M_BB, up to which LAPACK does not pay
# Of M_BB: from this share of entries other than 0 on it does, if there are more.
DENSE = 0.2
CORRECTIONS = 2  # of a solution
PLACES = types.Array(types.uint32, 1, "C", readonly=True)


@compiled
def _w(entries: Any, q: Any, z: Any) -> Any:
    (starts, columns, values), w = entries, q.copy()
    for i in range(q.size):
        total = 0.0
        for at in range(starts[i], starts[i + 1]):
            total += values[at] * z[columns[at]]
        w[i] += total
    return w


@compiled
def _factorize_thin(A: Any, rows: Any) -> bool:
    """Replace A by its LU factors with row exchanges, passing over entries 0, one
    column at a time, so that entries that cancel are 0; return whether it is
    regular."""
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
def _state(t: float, lower: float, upper: float) -> int:
    """Return the state that z - w = t stands for, as `Box.basis_of` does for t / 2."""
    return LOWER if t <= lower else UPPER if t >= upper else BASIC


@inlined
def _system(entries: Any, lower: Any, upper: Any, states: Any, order: Any) -> Any:
    """Return whether M_BB is regular, z with zeros in place of basic variables, and the
    system of the basis: the places of its variables, M_BB or its factors with their row
    exchanges, and whether these are factors."""
    starts, columns, values = entries
    n, k, place, z = states.size, 0, np.full(states.size, -1), np.empty(states.size)
    for i in order:
        z[i] = (
            0.0 if states[i] == BASIC else lower[i] if states[i] == LOWER else upper[i]
        )
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
    return not is_small or _factorize_thin(A, rows), z, (place, A, rows, is_small)


@compiled
def _correct(entries: Any, q: Any, system: Any, z: Any, w: Any) -> Any:
    """Add to z what makes w_B = 0; return whether M_BB is regular, and w."""
    place, A, rows, is_small = system
    b = np.empty(rows.size)
    for i in range(q.size):
        if place[i] >= 0:
            b[place[i]] = -w[i]
    if is_small:
        _solve(A, rows, rows.size, b)
    else:
        try:
            b[:] = np.linalg.solve(A, b)
        except Exception:  # numba catches no other: M_BB is singular
            return False, w
    for i in range(q.size):
        if place[i] >= 0:
            z[i] += b[place[i]]
    return True, _w(entries, q, z)


@inlined
def _is_wrong(
    entries: Any,
    q: Any,
    lower: float,
    upper: float,
    state: int,
    z: Any,
    w: float,
    i: int,
) -> bool:
    """Return whether a component violates the condition of its state by more than
    rounding."""
    starts, columns, values = entries
    violation = (
        max(lower - z[i], z[i] - upper)
        if state == BASIC
        else -w
        if state == LOWER
        else w
    )
    if not violation > 0.0 or lower == upper:
        return violation != violation
    terms, largest = abs(q[i]), 0.0
    for at in range(starts[i], starts[i + 1]):
        terms += abs(values[at] * z[columns[at]])
        largest = max(largest, abs(values[at]))
    return bool(violation * (largest if state == BASIC else 1.0) > ROW_ROUNDING * terms)


@njit(types.Tuple((COUNT, NUMBERS))(PLACES, PLACES, *(VECTOR,) * 5), **OPTIONS)
def pivot_blocks(
    begin: Any, columns: Any, values: Any, q: Any, lower: Any, upper: Any, t: Any
) -> Any:
    """Exchange wrong signs, from the states of t = z - w, as `auto` lets `newton` do;
    return the number of steps and z of the solution; if there is none, minus the number
    of basic solutions, and 0."""
    entries = begin, columns, values
    # Which keeps factors sparse.
    order = np.argsort(np.bincount(columns, minlength=q.size), kind="mergesort")
    diagonal = np.zeros(q.size)
    n, steps, waiting, most, is_single = q.size, 0, direct.BLOCK_PATIENCE, np.inf, False
    states, last, wrong = (
        np.empty(n, np.int8),
        np.empty(n, np.int8),
        np.zeros(n, np.bool_),
    )
    is_hasty, left = (
        False,
        direct.FEW_INDEX_STEPS if n <= direct.MAX_PIVOTED else MAX_LEAST_INDEX_STEPS,
    )
    for i in range(n):
        for at in range(begin[i], begin[i + 1]):
            if columns[at] == i:
                diagonal[i] = values[at]
        is_hasty |= diagonal[i] == 0.0
        left = left if diagonal[i] > 0.0 else 0
        states[i], last[i] = (
            _state(t[i], lower[i], upper[i]),
            _state(0.0, lower[i], upper[i]),
        )
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
        fewest, waiting, left, is_single = _safeguarded(
            fewest, waiting, left, is_single, count
        )
        if left < 0 or (n <= direct.MAX_PIVOTED and _is_hopeless(fewest, waiting, n)):
            return -steps, np.zeros(0)
        for i in range(n):
            if wrong[i] and (not is_single or i == first):
                states[i] = last[i]
