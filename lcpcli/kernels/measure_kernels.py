"""The acceptance test of a point by the complete measure, and the scaling factors of M,
compiled by numba.

These are `box.reference`, `Measure.surely_solves` and `linalg.units.units`, for
moderate numbers and M in compressed sparse rows with sorted columns: begin, columns,
values. If they do not decide with a margin larger than rounding errors, the methods
themselves decide. As numba's cache detects changes only in this file, it uses no
kernels of other files.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, types

from lcpcli.linalg.doubles import ROUNDING, ROW_ROUNDING, SMALL_DISTANCE
from lcpcli.linalg.matrices import TINY_TERMS
from lcpcli.linalg.units import CONVERGED_ERROR, FEW_CG_STEPS, TINY
from lcpcli.model.box import CANCELLATION, NO_BOUND
from lcpcli.verify.measure import DROWNED, FINEST

OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}
compiled = njit(**OPTIONS)
# Indices are unsigned, as numba tests the sign of each signed index.
INDICES = types.Array(types.uint32, 1, "C", readonly=True)
VECTOR, MATRIX = (types.Array(types.float64, d, "C", readonly=True) for d in (1, 2))
NUMBERS, PARTS, PLACES = (
    types.Array(each, 1, "C") for each in (types.float64, types.int64, types.uint32)
)
# M in compressed sparse rows: a plain tuple, as numba converts the arrays of no named
# one to read-only arrays.
ENTRIES = types.Tuple((INDICES, INDICES, VECTOR))
SOLVES, FAILS, UNDECIDED = 1, -1, 0


@compiled
def _rows(entries: Any, q: Any, z: Any) -> Any:
    """Return M z + q and |M| |z| + |q|, and whether all of them are finite and no
    product may have underflowed."""
    begin, columns, values = entries
    n, is_sure = q.size, True
    w, terms = q.copy(), np.abs(q)
    for i in range(n):
        value, total = w[i], terms[i]
        for at in range(begin[i], begin[i + 1]):
            term = values[at] * z[columns[at]]
            value += term
            total += abs(term)
        w[i], terms[i] = value, total
        is_sure &= total < np.inf
        if total <= TINY_TERMS:
            for at in range(begin[i], begin[i + 1]):
                is_sure &= values[at] == 0.0 or z[columns[at]] == 0.0
    return w, terms, is_sure


@compiled
def _excess(z: float, w: float, lower: float, upper: float) -> float:
    """Return by how much w violates its sign condition for a z within its bounds."""
    return max(w if z > lower else -np.inf, -w if z < upper else -np.inf)


@compiled
def _largest_gap(z: Any, w: Any, lower: Any, upper: Any) -> float:
    """Return the natural residual of a point."""
    largest = 0.0
    for i in range(z.size):
        largest = max(largest, abs(max(z[i] - upper[i], min(z[i] - lower[i], w[i]))))
    return largest


@compiled
def _reference(entries: Any, q: Any, lower: Any, upper: Any) -> Any:
    """Return the reference point and its M z + q and |M| |z| + |q|, and whether these
    are finite and free of underflow.
    """
    n = q.size
    nearest, corner = np.empty(n), np.empty(n)
    for i in range(n):
        nearest[i] = min(max(0.0, lower[i]), upper[i])
        corner[i] = 0.0
        if lower[i] > -np.inf:
            corner[i] = lower[i]
        elif upper[i] < np.inf:
            corner[i] = upper[i]
    w, terms = q.copy(), np.abs(q)
    is_sure = True
    if nearest.any():
        w, terms, is_sure = _rows(entries, q, nearest)
    if (nearest != corner).any():
        other, other_terms, other_is_sure = _rows(entries, q, corner)
        is_sure &= other_is_sure
        if _largest_gap(corner, other, lower, upper) < _largest_gap(
            nearest, w, lower, upper
        ):
            return corner, other, other_terms, is_sure
    return nearest, w, terms, is_sure


class Reference(NamedTuple):
    """The reference point z, its q_ref = M z + q, lower bounds on |q_ref|, and the rows
    in which it is too inaccurate."""

    z: Any
    q_ref: Any
    min_q_ref: Any
    is_rough: Any


@compiled
def _sizes(units: Any, lower: Any, upper: Any, z: Any, at: Any) -> Any:
    """Return log2 of k for each connected component of M, as
    `Measure.component_sizes` does: k is the largest scaled violation at the reference
    point or distance of a z_i at a bound from it; NaN if q_ref is too inaccurate.

    at : the `Reference`.
    """
    reference, q_ref, min_q_ref, is_rough = at
    n, (rho, gamma, parts, count) = z.size, units
    sizes = np.full(count, -np.inf)
    of_reference = np.full(count, -np.inf)
    rough = np.zeros(count, np.bool_)
    for i in range(n):
        part = parts[i]
        rough[part] |= is_rough[i] and min_q_ref[i] == 0.0
        if min_q_ref[i] > 0.0:
            size = np.log2(min_q_ref[i]) + rho[i]
            of_reference[part] = max(of_reference[part], size)
            if _excess(reference[i], q_ref[i], lower[i], upper[i]) > 0.0:
                sizes[part] = max(sizes[part], size)
        if (
            z[i] != reference[i]
            and lower[i] < upper[i]
            and (z[i] == lower[i] or z[i] == upper[i])
        ):
            part = parts[n + i]
            sizes[part] = max(sizes[part], np.log2(abs(z[i] - reference[i])) - gamma[i])
    for part in range(count):
        if sizes[part] == -np.inf:
            sizes[part] = np.inf
            if rough[part]:
                sizes[part] = np.nan
            elif of_reference[part] > -np.inf:
                sizes[part] = of_reference[part]
    return sizes


@compiled
def _root(parents: Any, i: int) -> int:
    """Return the root of the component of a node, and shorten the path to it
    (union-find).
    """
    while parents[i] != i:
        parents[i] = parents[parents[i]]
        i = parents[i]
    return i


@compiled
def _components(entries: Any) -> Any:
    """Return the components of the rows and, after them, of the columns, shape (2 n,),
    and their number."""
    begin, columns, values = entries
    n = begin.size - 1
    parents = np.arange(2 * n)
    numbers = np.full(2 * n, -1)
    parts = np.empty(2 * n, np.int64)
    count = 0
    for i in range(n):
        a = _root(parents, i)
        for at in range(begin[i], begin[i + 1]):
            b = _root(parents, n + columns[at])
            if a != b and values[at] != 0.0:
                parents[max(a, b)] = min(a, b)
                a = min(a, b)
    for i in range(2 * n):
        root = _root(parents, i)
        if numbers[root] < 0:
            numbers[root], count = count, count + 1
        parts[i] = numbers[root]
    return parts, count


@njit(types.Tuple((NUMBERS, NUMBERS, PARTS, types.int64))(ENTRIES), **OPTIONS)
def units_of(entries: Any) -> Any:
    """Return log2 of R and of C, the components of rows and columns, shape (2 n,), and
    their number, as `units.units` does up to a constant for each component; 0
    components if conjugate gradients do not converge, or if entries may be so small
    that they take no part.
    """
    begin, columns, values = entries
    n = begin.size - 1
    sums, counts = np.zeros(2 * n), np.zeros(2 * n)
    used = values != 0.0
    smallest_entry, largest_entry = np.inf, 0.0
    for value in values:
        largest_entry = max(largest_entry, abs(value))
        if value != 0.0:
            smallest_entry = min(smallest_entry, abs(value))
    for i in range(n):
        for at in range(begin[i], begin[i + 1]):
            logarithm = np.log2(abs(values[at])) if used[at] else 0.0
            for node in (i, n + columns[at]):
                sums[node] += logarithm
                counts[node] += used[at]
    x = np.zeros(2 * n)
    residual = -sums
    step = np.empty(2 * n)
    direction = np.zeros(2 * n)
    image = np.empty(2 * n)
    before, goal = 0.0, CONVERGED_ERROR
    has_converged = False
    for k in range(FEW_CG_STEPS):
        largest = size = total = 0.0
        for v in range(2 * n):
            step[v] = residual[v] / max(counts[v], 1.0)
            largest = max(largest, abs(step[v]))
            size += residual[v] * step[v]
        goal = goal if k else CONVERGED_ERROR * max(largest, 1.0)
        has_converged = not largest > goal
        if has_converged:
            break
        for v in range(2 * n):
            direction[v] = step[v] + (size / before if k else 0.0) * direction[v]
            image[v] = counts[v] * direction[v]
        for i in range(n):
            for at in range(begin[i], begin[i + 1]):
                j = n + columns[at]
                image[i] += used[at] * direction[j]
                image[j] += used[at] * direction[i]
        for v in range(2 * n):
            total += direction[v] * image[v]
        before = size
        for v in range(2 * n):
            x[v] += size / total * direction[v]
            residual[v] -= size / total * image[v]
    has_converged &= smallest_entry >= TINY * largest_entry
    parts, count = _components(entries)
    return x[:n].copy(), x[n:].copy(), parts, count if has_converged else 0


@njit(
    types.Tuple((types.boolean, NUMBERS, NUMBERS))(ENTRIES, *(VECTOR,) * 3), **OPTIONS
)
def reference_of(entries: Any, q: Any, lower: Any, upper: Any) -> Any:
    """Return whether the reference point z of a mixed problem seems to solve it, z, and
    z - w, which is empty if a bound is far from 0.
    """
    z, w, _, _ = _reference(entries, q, lower, upper)
    t, solves = z - w, True
    for i in range(z.size):
        for bound in (abs(lower[i]), abs(upper[i])):
            if NO_BOUND <= bound < np.inf:
                return False, z, t[:0]
        solves &= z[i] == min(max(t[i], lower[i]), upper[i])
    return solves, z, t


@compiled
def _with_reference(
    w: Any, full_terms: Any, far_w: Any, far_terms: Any, q_ref: Any, at_reference: Any
) -> Any:
    """Return the terms of the rows and bounds on the rounding errors of w; and lower
    bounds on |q_ref|, bounds on its rounding errors, and the rows in which it is too
    inaccurate. Entries of w are replaced by those of far_w that are more accurate.

    far_w, far_terms : M (z - z_ref) + q_ref and |M| |z - z_ref| + |q_ref|.
    at_reference : |M| |z_ref| + |q|.
    """
    n = w.size
    terms = np.empty(n)
    error = ROW_ROUNDING * full_terms
    min_q_ref = np.abs(q_ref)
    q_error = ROW_ROUNDING * at_reference
    is_rough = np.zeros(n, np.bool_)
    for i in range(n):
        far_error = ROW_ROUNDING * far_terms[i] + q_error[i]
        if far_error < error[i]:
            w[i], error[i] = far_w[i], far_error
        terms[i] = min(full_terms[i], max(far_terms[i], FINEST * full_terms[i]))
        # The numpy version sums such rows exactly; here they are not decided.
        is_rough[i] = at_reference[i] > CANCELLATION * min_q_ref[i]
        if is_rough[i]:
            min_q_ref[i] = max(min_q_ref[i] - q_error[i], 0.0)
    return terms, error, min_q_ref, q_error, is_rough


@compiled
def _are_within_caps(
    violations: Any, rows: Any, sizes: Any, units: Any, tol: float
) -> Any:
    """Return whether no violation exceeds the tolerance for its terms or its cap.

    rows : the terms, those without the reference point, and lower bounds on |q_ref|.
    sizes : log2 of k for each connected component of M, as `_sizes` returns it.
    """
    terms, full_terms, min_q_ref = rows
    rho, parts = units[0], units[2]
    are_within = True
    for i in range(violations.size):
        cap = max(2.0 ** (sizes[parts[i]] - rho[i]), min_q_ref[i])
        are_within &= violations[i] <= max(
            tol * min(terms[i], cap), ROUNDING * min(full_terms[i], DROWNED * cap)
        )
    return are_within


@compiled
def _acceptance_test(
    entries: Any, q: Any, lower: Any, upper: Any, tol: float, z: Any
) -> Any:
    """Return whether z solves the problem, as a code; whether it is decided without
    doubt which rows fail; what is known of the rows; and the scaling factors of M,
    empty where they were not needed.
    """
    n, units = q.size, (np.empty(0), np.empty(0), np.empty(0, np.int64), 0)
    reference, q_ref, at_reference, is_sure = _reference(entries, q, lower, upper)
    w, full_terms, is_sure_too = _rows(entries, q, z)
    terms = full_terms.copy()
    error = ROW_ROUNDING * full_terms
    min_q_ref = np.abs(q_ref)
    q_error = np.zeros(n)
    is_rough = np.zeros(n, np.bool_)
    is_sure &= is_sure_too
    if reference.any():
        far_w, far_terms, is_sure_too = _rows(entries, q_ref, z - reference)
        is_sure &= is_sure_too
        terms, error, min_q_ref, q_error, is_rough = _with_reference(
            w, full_terms, far_w, far_terms, q_ref, at_reference
        )
    is_closed = is_solution = is_small = True
    fails, worst = False, np.empty(n)
    is_reference = not (z != reference).any()
    for i in range(n):
        excess = _excess(z[i], w[i], lower[i], upper[i])
        allowed = max(tol * terms[i], ROUNDING * full_terms[i])
        is_solution &= _excess(z[i], q_ref[i], lower[i], upper[i]) + q_error[i] <= 0.0
        worst[i] = excess + error[i]
        is_closed &= worst[i] <= tol * min(min_q_ref[i], terms[i])
        is_small &= worst[i] <= allowed
        fails |= excess - error[i] > allowed
    answer, is_known = UNDECIDED, is_sure and not is_rough.any()
    if is_sure and is_reference:
        answer = SOLVES if is_solution and is_small else answer
    elif is_sure and not is_small:
        answer = FAILS if fails and is_known else UNDECIDED
    elif is_sure and is_closed:
        answer = SOLVES
    elif is_sure:
        units = units_of(entries)
        at = Reference(reference, q_ref, min_q_ref, is_rough)
        sizes = _sizes(units, lower, upper, z, at)
        rows = terms, full_terms, min_q_ref
        if units[3] and _are_within_caps(worst, rows, sizes, units, tol):
            answer = SOLVES
    return answer, is_known, (w, terms, full_terms, error), units


@njit(types.boolean(ENTRIES, *(VECTOR,) * 3, types.float64, VECTOR), **OPTIONS)
def surely_solves(
    entries: Any, q: Any, lower: Any, upper: Any, tol: float, z: Any
) -> bool:
    """Return whether a z within its bounds solves the problem for all possible rounding
    errors in w.
    """
    return bool(_acceptance_test(entries, q, lower, upper, tol, z)[0] == SOLVES)


@njit((ENTRIES, *(VECTOR,) * 3, types.float64, VECTOR), **OPTIONS)
def acceptance_test(
    entries: Any, q: Any, lower: Any, upper: Any, tol: float, z: Any
) -> Any:
    """Return SOLVES or FAILS if that holds for all possible rounding errors in w of a z
    within its bounds, otherwise UNDECIDED; `measure.Rows`, shape (4, n), if they are
    known and z is not proved to solve the problem; and the result of `units_of`, with 0
    components if it was not needed.
    """
    answer, is_known, values_of_rows, units = _acceptance_test(
        entries, q, lower, upper, tol, z
    )
    rows = np.empty((4 if is_known and answer != SOLVES else 0, z.size))
    for k in range(len(rows)):
        rows[k] = values_of_rows[k]
    return answer, rows, units


@njit(types.Tuple((PLACES, PLACES, NUMBERS))(MATRIX), **OPTIONS)
def compressed(M: Any) -> Any:
    """Return a dense M in compressed sparse rows."""
    n, used = M.shape[0], 0
    begin = np.zeros(n + 1, np.uint32)
    columns = np.empty(n * n, np.uint32)
    values = np.empty(n * n)
    for i in range(n):
        row = M[i]
        for j in range(n):
            columns[used], values[used] = j, row[j]
            used += row[j] != 0.0
        begin[i + 1] = used
    return begin, columns[:used].copy(), values[:used].copy()


@njit(NUMBERS(VECTOR, VECTOR, VECTOR), **OPTIONS)
def on_bounds(lower: Any, upper: Any, z: Any) -> Any:
    """Return z with entries that differ from 0 or a bound by rounding errors replaced
    by that.
    """
    max_distance, moved = SMALL_DISTANCE * np.abs(z).max(), np.empty(z.size)
    for i in range(z.size):
        moved[i] = z[i]
        if z[i] - lower[i] <= max_distance:
            moved[i] = lower[i]
        elif upper[i] - z[i] <= max_distance:
            moved[i] = upper[i]
        elif abs(z[i]) <= max_distance:
            moved[i] = 0.0
    return moved


@njit(types.Tuple((NUMBERS, NUMBERS, PARTS, types.int64))(MATRIX), **OPTIONS)
def dense_units_of(M: Any) -> Any:
    """Return what `units_of` returns for a dense M."""
    return units_of(compressed(M))
