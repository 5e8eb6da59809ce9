"""Block pivoting and the acceptance test of its solutions in loops over numbers,
compiled by numba.

These are `newton` and the first bound of `Measure.surely_solves` for dense LCPs with
few unknowns: for ten of them, calls of numpy take a hundred times as long as the
arithmetic. If they find no solution by a margin larger than rounding errors, the
methods themselves decide. All kernels are compiled when `kernels.compiled` loads this
file, or are loaded from a cache.

Block pivoting on mixed problems is `newton` as `auto` runs it, for few unknowns;
`measure_kernels` test its solutions. M is represented by the arrays of compressed
sparse rows: where each row begins, the columns and the values.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import register_jitable

from lcpcli.auto.attempts import NEWTON_SETTLING_FACTOR, SETTLED_CHANGES
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.linalg.matrices import TINY_TERMS
from lcpcli.methods import direct
from lcpcli.methods.newton import MAX_LEAST_INDEX_STEPS
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.verify.enclosure import are_open, open_signs, regular_change
from lcpcli.verify.final_states import HIDDEN_TERM, LONG_NUMBER, SURE_DIGITS
from lcpcli.verify.measure import CERTAIN, FEW_UNKNOWNS

OPTIONS = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc"},
}
compiled = njit(**OPTIONS)
# For functions that one kernel calls once: numba compiles in half the time.
inlined = njit(inline="always", **OPTIONS)
for function in (regular_change, are_open):
    register_jitable(nogil=True, error_model="numpy")(function)
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


# `_factorize_thin` would take 4 times as long for full matrices of 4 rows, 3.3 with 10,
# 2.6 with 20 and 1.5 with 50; for tridiagonal ones 3.4, 1.5, .7 and .2 times.
@compiled
def factorize(A: Any, rows: Any, k: int) -> bool:
    """Replace the leading k-by-k block of A by its LU factors with row interchanges;
    return whether it is nonsingular.

    Two columns are eliminated at a time, which halves the number of passes over the
    rest.
    """
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
def solve(A: Any, rows: Any, k: int, b: Any) -> None:
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


class Workspace(NamedTuple):
    """The arrays of one basic solution; the parts for its k basic variables come first.

    A, rows : the factors of M_PP, shape (n, n), and their row interchanges, shape (n,).
    P : the indices of the basic variables. z : shape (n,). b : the right-hand side, or
    z_P.
    """

    A: Any
    rows: Any
    P: Any
    z: Any
    b: Any


@inlined
def _basic_solution(M: Any, q: Any, basic: Any, work: Any) -> int:
    """Compute the z of a basis, and factors of M_PP; return the order of M_PP, or -1 if
    it is singular.
    """
    A, rows, P, z, b = work
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
    if not factorize(A, rows, k):
        return -1
    solve(A, rows, k, b)
    for a in range(k):
        z[P[a]] = b[a]
    return k


@compiled
def _repeats(M: Any, q: Any, i: int, k: int, P: Any) -> bool:
    """Return whether row i equals plus or minus one of the basic rows in the columns of
    P and in q, so that w_i = 0.
    """
    for a in range(k):
        same, opposite = q[i] == q[P[a]], q[i] == -q[P[a]]
        for c in range(k if same or opposite else 0):
            same &= M[i, P[c]] == M[P[a], P[c]]
            opposite &= M[i, P[c]] == -M[P[a], P[c]]
        if same or opposite:
            return True
    return False


# `pivot_blocks` could replace this for dense M, but takes 2 times as long with 4
# unknowns, 2.5 with 10, 3.5 with 20 and 4 with 50; for tridiagonal M 2, 2.5, 2 and .8.
@inlined
def _block_pivoting(
    M: Any,
    q: Any,
    basic: Any,
    is_start: bool,
    work: Any,
) -> tuple[int, int]:
    """Pivot on the infeasible indices, from a basis, as `newton` does with its
    safeguard; return the order of the last M_PP, -1 if there is no solution, and the
    number of steps.

    is_start : whether the basis is a warm start, which is replaced by the basis of q <
        0 if it is not close to that of a solution.
    """
    P, z, b = work.P, work.z, work.b
    n, k = q.size, 0
    steps, is_single = 0, False
    min_violations = n + 1
    patience = direct.BLOCK_PATIENCE
    single_pivots_left = direct.FEW_INDEX_STEPS
    wrong = np.empty(n, np.bool_)
    for i in range(n):
        k += basic[i] or q[i] < 0.0
    if not k:
        z[:] = 0.0
        return 0, 0
    while True:
        k = _basic_solution(M, q, basic, work)
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
        min_violations, patience, single_pivots_left, is_single = _safeguarded(
            min_violations, patience, single_pivots_left, is_single, count
        )
        if single_pivots_left < 0 or _is_hopeless(min_violations, patience, n):
            return -1, steps
        for i in range(n):
            if wrong[i] and (not is_single or i == first):
                basic[i] = not basic[i]


@compiled
def _is_capped(M: Any, q: Any, i: int, violation: float, tol: float) -> bool:
    """Return whether a violation of row i is at most tol times the lower bound on its
    cap by `measure.least_caps`: the largest violation at z = 0, scaled by the ratio of
    the geometric means of the two rows. False if M has a zero.
    """
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
def _refine_and_test(M: Any, q: Any, tol: float, k: int, work: Any) -> int:
    """Refine z by its residual, with the factors of M_PP; return CERTAIN if it solves
    the problem for all possible rounding errors, otherwise CANDIDATE.
    """
    A, rows, P, z, b = work
    n = q.size
    for a in range(k):
        total = q[P[a]]
        for c in range(k):
            total += M[P[a], P[c]] * z[P[c]]
        b[a] = total
    solve(A, rows, k, b)
    for a in range(k):
        z[P[a]] = max(z[P[a]] - b[a], 0.0)
    verdict_code = direct.CERTAIN
    for i in range(n):
        w, terms = q[i], abs(q[i])
        for j in range(n):
            term = M[i, j] * z[j]
            w += term
            terms += abs(term)
        worst = (abs(w) if z[i] > 0.0 else -w) + ROW_ROUNDING * terms
        is_small = worst <= tol * abs(q[i])
        if not (is_small or (worst <= tol * terms and _is_capped(M, q, i, worst, tol))):
            verdict_code = direct.CANDIDATE
        if terms <= TINY_TERMS:
            for j in range(n):
                if M[i, j] != 0.0 and z[j] != 0.0:
                    verdict_code = direct.CANDIDATE  # the product may have underflowed
    return verdict_code


@inlined
def _hides_terms(q: Any, largest: float, z: Any) -> bool:
    """Return whether, by the sizes of the numbers alone, rounding may hide a term of a
    row, for z >= 0: `final_states.may_hide_term` but for long numbers, which the caller
    tests.
    """
    smallest_z, largest_z, smallest_q, largest_q = np.inf, 0.0, np.inf, 0.0
    for i in range(q.size):
        if z[i] != 0.0:
            smallest_z, largest_z = min(smallest_z, z[i]), max(largest_z, z[i])
        if q[i] != 0.0:
            smallest_q = min(smallest_q, abs(q[i]))
            largest_q = max(largest_q, abs(q[i]))
    return min(largest * smallest_z, smallest_q) < HIDDEN_TERM * max(
        largest * largest_z, largest_q
    )


@inlined
def _is_sure(M: Any, q: Any, k: int, P: Any, z: Any) -> bool:
    """Return whether a solution with the basis of z is proved to exist that differs
    from z only in its last digits.
    """
    is_open = _open_signs(M, q, P[:k], z, SURE_DIGITS)
    for i in range(q.size):
        if is_open[i] and (z[i] > 0.0 or not _repeats(M, q, i, k, P)):
            return False
    return True


@njit(FOUND(MATRIX, VECTOR, BASIC_ONES, types.boolean, NUMBER, NUMBER), **OPTIONS)
def solve_one(
    M: Any, q: Any, basic: Any, is_start: bool, largest: float, tol: float
) -> Any:
    """Return the verdict code for one problem from a basis, the steps of `newton`, and
    z of shape (n,).

    largest : the largest |M_ij|.
    """
    n = q.size
    P, z = np.empty(n, np.int64), np.empty(n)
    work = Workspace(np.empty((n, n)), np.empty(n, np.int64), P, z, np.empty(n))
    k, steps = _block_pivoting(M, q, basic.copy(), is_start, work)
    if k < 0:
        return direct.NOTHING, steps, z
    verdict_code = _refine_and_test(M, q, tol, k, work) if k else direct.CERTAIN
    is_long = n > 0 and max(largest, np.abs(q).max()) > LONG_NUMBER
    is_open = n <= FEW_UNKNOWNS and (
        is_long or (_hides_terms(q, largest, z) and not _is_sure(M, q, k, P, z))
    )
    return direct.DOUBTFUL if is_open else verdict_code, steps, z


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
def solve_rows(M: Any, Q: Any, largest: Any, tol: float, Z: Any, outcomes: Any) -> None:
    """Solve the problems with the rows of Q, each with its M or all with the same;
    write their z into Z, and verdict codes and steps into outcomes.
    """
    for i in range(Q.shape[0]):
        row_of_M = min(i, M.shape[0] - 1)
        verdict_code, outcomes[i, 1], z = solve_one(
            M[row_of_M], Q[i], Q[i] < 0.0, False, largest[row_of_M], tol
        )
        is_open = verdict_code == direct.DOUBTFUL
        outcomes[i, 0] = direct.NOTHING if is_open else verdict_code
        for j in range(z.size):
            Z[i, j] = z[j]


FEW_ROWS = 48  # rows of M_BB up to which LAPACK takes longer
# Fraction of nonzero entries of M_BB above which LAPACK takes less time, if there are
# more rows.
DENSE = 0.2
CORRECTIONS = 2  # corrections of a solution by its residual
PLACES = types.Array(types.uint32, 1, "C", readonly=True)
# M in compressed sparse rows: a plain tuple, as numba converts the arrays of no named
# one to read-only arrays.
ENTRIES = types.Tuple((PLACES, PLACES, VECTOR))


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
def _factorize_thin(A: Any, rows: Any) -> bool:
    """Replace A by its LU factors with row interchanges, one column at a time, skipping
    zeros; return whether it is nonsingular.
    """
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
    """Return the basis status for z - w = t, as `Box.basis_of` does for t / 2."""
    if t <= lower:
        return LOWER
    return UPPER if t >= upper else BASIC


@inlined
def _system(entries: Any, lower: Any, upper: Any, statuses: Any, order: Any) -> Any:
    """Return whether M_BB is nonsingular, z with zeros for basic variables, and the
    system of the basis: the positions of its variables, M_BB or its factors with their
    row interchanges, and whether these are factors.
    """
    starts, columns, values = entries
    n, k, position, z = (
        statuses.size,
        0,
        np.full(statuses.size, -1),
        np.empty(statuses.size),
    )
    for i in order:
        if statuses[i] == BASIC:
            z[i] = 0.0
            position[i], k = k, k + 1
        else:
            z[i] = lower[i] if statuses[i] == LOWER else upper[i]
    A, rows, used = np.zeros((k, k)), np.empty(k, np.int64), 0
    for i in range(n):
        if position[i] >= 0:
            for at in range(starts[i], starts[i + 1]):
                if position[columns[at]] >= 0:
                    A[position[i], position[columns[at]]] = values[at]
                    used += 1
    is_small = k <= FEW_ROWS or used <= DENSE * k * k
    return not is_small or _factorize_thin(A, rows), z, (position, A, rows, is_small)


@compiled
def _correct(entries: Any, q: Any, system: Any, z: Any, w: Any) -> Any:
    """Add a correction to z that makes w_B = 0; return whether M_BB is nonsingular, and
    w.
    """
    position, A, rows, is_small = system
    b = np.empty(rows.size)
    for i in range(q.size):
        if position[i] >= 0:
            b[position[i]] = -w[i]
    if is_small:
        solve(A, rows, rows.size, b)
    else:
        try:
            b[:] = np.linalg.solve(A, b)
        except Exception:  # numba catches no other: M_BB is singular
            return False, w
    for i in range(q.size):
        if position[i] >= 0:
            z[i] += b[position[i]]
    return True, _w(entries, q, z)


@inlined
def _is_wrong(problem: Any, statuses: Any, z: Any, w: Any, i: int) -> bool:
    """Return whether a component violates the condition of its status by more than
    rounding errors.
    """
    (starts, columns, values), q, lower, upper = problem
    state = statuses[i]
    violation = -w[i] if state == LOWER else w[i]
    if state == BASIC:
        violation = max(lower[i] - z[i], z[i] - upper[i])
    if not violation > 0.0 or lower[i] == upper[i]:
        return bool(violation != violation)
    terms, largest = abs(q[i]), 0.0
    for at in range(starts[i], starts[i + 1]):
        terms += abs(values[at] * z[columns[at]])
        largest = max(largest, abs(values[at]))
    scale = largest if state == BASIC else 1.0
    return bool(violation * scale > ROW_ROUNDING * terms)


@njit(types.Tuple((COUNT, NUMBERS))(ENTRIES, *(VECTOR,) * 4), **OPTIONS)
def pivot_blocks(entries: Any, q: Any, lower: Any, upper: Any, t: Any) -> Any:
    """Pivot on the infeasible indices, from the basis of t = z - w, as `auto` runs
    `newton`; return the number of steps and z of the solution. If there is none, return
    minus the number of basic solutions, and an empty z.
    """
    begin, columns, values = entries
    problem = entries, q, lower, upper
    # Columns with few entries come first, which keeps factors sparse.
    order = np.argsort(np.bincount(columns, minlength=q.size), kind="mergesort")
    diagonal = np.zeros(q.size)
    n, steps, patience = q.size, 0, direct.BLOCK_PATIENCE
    max_changes = np.inf
    is_single, is_hasty = False, False
    statuses = np.empty(n, np.int8)
    next_states = np.empty(n, np.int8)
    wrong = np.zeros(n, np.bool_)
    single_pivots_left = (
        direct.FEW_INDEX_STEPS if n <= direct.MAX_PIVOTED else MAX_LEAST_INDEX_STEPS
    )
    for i in range(n):
        for at in range(begin[i], begin[i + 1]):
            if columns[at] == i:
                diagonal[i] = values[at]
        is_hasty |= diagonal[i] == 0.0
        single_pivots_left = single_pivots_left if diagonal[i] > 0.0 else 0
        statuses[i] = _state(t[i], lower[i], upper[i])
        next_states[i] = _state(0.0, lower[i], upper[i])
    min_violations = n + 1
    while True:
        is_regular, z, system = _system(entries, lower, upper, statuses, order)
        w = _w(entries, q, z)
        if is_regular:
            is_regular, w = _correct(entries, q, system, z, w)
        steps += 1
        if not is_regular:
            return 1 - steps, np.zeros(0)
        count, changes, first = 0, 0, n
        for i in range(n):
            wrong[i] = _is_wrong(problem, statuses, z, w, i)
            count, first = count + wrong[i], min(first, i) if wrong[i] else first
            next_state = statuses[i]
            if wrong[i] and next_state != BASIC:
                next_state = BASIC
            elif wrong[i]:
                next_state = UPPER if z[i] > upper[i] else LOWER
            changes += next_state != next_states[i]
            next_states[i] = next_state
        if not count:
            for _ in range(CORRECTIONS):
                _, w = _correct(entries, q, system, z, w)
            return steps, np.minimum(np.maximum(z, lower), upper)
        if is_hasty and changes > max_changes:
            return -steps, np.zeros(0)
        max_changes = max(NEWTON_SETTLING_FACTOR * changes, float(SETTLED_CHANGES))
        min_violations, patience, single_pivots_left, is_single = _safeguarded(
            min_violations, patience, single_pivots_left, is_single, count
        )
        if single_pivots_left < 0 or (
            n <= direct.MAX_PIVOTED and _is_hopeless(min_violations, patience, n)
        ):
            return -steps, np.zeros(0)
        for i in range(n):
            if wrong[i] and (not is_single or i == first):
                statuses[i] = next_states[i]
