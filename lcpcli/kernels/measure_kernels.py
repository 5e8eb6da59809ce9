"""The judgement of points by the whole measure, compiled by numba.

These are `reference_point.reference`, `Measure.surely_solves` and `linalg.units.units` once more, for dense M and
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
from lcpcli.model.box import NO_BOUND
from lcpcli.model.reference_point import CANCELLATION
from lcpcli.verify.measure import DROWNED, FINEST, ROUNDING

SMALL_DISTANCE = 1e-13  # from a bound or from 0, relative to the largest |z_i|: it may be rounding of 0
OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}
compiled = njit(**OPTIONS)
NUMBER, COUNT = types.float64, types.int64
VECTOR, MATRIX = (types.Array(NUMBER, d, "C", readonly=True) for d in (1, 2))
NUMBERS, PARTS = types.Array(NUMBER, 1, "C"), types.Array(COUNT, 1, "C")
UNITS = types.Tuple((NUMBERS, NUMBERS, PARTS, PARTS, COUNT))


@compiled
def _root(parents: Any, i: int) -> int:
    """Return the number that stands for the component of a node, and shorten the way to it."""
    while parents[i] != i:
        parents[i] = parents[parents[i]]
        i = parents[i]
    return i


@compiled
def _components(n: int, of_row: Any, of_column: Any) -> Any:
    """Return the components of rows and columns in the order of their first rows, those without rows at the end, and
    their number."""
    parents, numbers, parts, count = np.arange(2 * n), np.full(2 * n, -1), np.empty(2 * n, np.int64), 0
    for at in range(of_row.size):
        a, b = _root(parents, of_row[at]), _root(parents, n + of_column[at])
        parents[max(a, b)] = min(a, b)
    for i in range(2 * n):
        root = _root(parents, i)
        if numbers[root] < 0:
            numbers[root], count = count, count + 1
        parts[i] = numbers[root]
    return parts[:n].copy(), parts[n:].copy(), count


@compiled
def _least_squares(e: Any, counts: Any, of_row: Any, of_column: Any) -> Any:
    """Return rho and then gamma as `linalg.units` has them, from the sums of exponents and the numbers of entries of
    rows and then of columns, and the places in these of the entries."""
    x, image, residual, step = np.zeros(e.size), np.empty(e.size), -e, -e / counts
    direction, size = step.copy(), residual.dot(step)
    for _ in range(MOST_CG_STEPS):
        if not np.abs(step).max() > SETTLED_ERROR:
            break
        for i in range(e.size):
            image[i] = counts[i] * direction[i]
        for at in range(of_row.size):
            i, j = of_row[at], of_column[at]
            image[i] += direction[j]
            image[j] += direction[i]
        length, before, size = size / direction.dot(image), size, 0.0
        for i in range(e.size):
            x[i] += length * direction[i]
            residual[i] -= length * image[i]
            step[i] = residual[i] / counts[i]
            size += residual[i] * step[i]
        for i in range(e.size):
            direction[i] = step[i] + size / before * direction[i]
    return x


@compiled
def _units_of(M: Any) -> Any:
    """Return the same as `linalg.units.units` for a dense M of moderate numbers."""
    n, entries = M.shape[0], 0
    of_row, of_column = np.empty(n * n, np.int64), np.empty(n * n, np.int64)
    e, counts = np.zeros((2, n)), np.zeros((2, n))
    for i in range(n):
        row = M[i]
        for j in range(n):
            if row[j] != 0.0:
                exponent = float(math.frexp(row[j])[1])
                e[0, i] += exponent
                e[1, j] += exponent
                counts[0, i] += 1.0
                counts[1, j] += 1.0
                of_row[entries], of_column[entries] = i, j
                entries += 1
    of_row, of_column = of_row[:entries], of_column[:entries]
    x = _least_squares(e.ravel(), np.maximum(counts, 1.0).ravel(), of_row, n + of_column)
    rows, columns, count = _components(n, of_row, of_column)
    return x[:n].copy(), x[n:].copy(), rows, columns, count


@njit(UNITS(MATRIX), **OPTIONS)
def units_of(M: Any) -> Any:
    """Return `_units_of` a matrix."""
    return _units_of(M)


@compiled
def _rows(M: Any, q: Any, z: Any, columns: Any) -> Any:
    """Return M z + q and |M| |z| + |q|, and whether no product may have underflowed; columns : memory for indices."""
    n, used, is_sure = q.size, 0, True
    w, terms = q.copy(), np.abs(q)
    for j in range(n):
        if z[j] != 0.0:
            columns[used] = j
            used += 1
    for i in range(n):
        value, total = w[i], terms[i]
        for at in range(used):
            term = M[i, columns[at]] * z[columns[at]]
            value += term
            total += abs(term)
        w[i], terms[i] = value, total
        if total <= TINY_TERMS:
            for at in range(used):
                is_sure &= M[i, columns[at]] == 0.0
    return w, terms, is_sure


@compiled
def _excess(z: float, w: float, lower: float, upper: float) -> float:
    """Return by how much w has the wrong sign for an admissible z."""
    return max(w if z > lower else -np.inf, -w if z < upper else -np.inf)


@compiled
def _largest_gap(z: Any, w: Any, lower: Any, upper: Any) -> float:
    """Return the natural residual of a point."""
    largest = 0.0
    for i in range(z.size):
        largest = max(largest, abs(max(z[i] - upper[i], min(z[i] - lower[i], w[i]))))
    return largest


@compiled
def _reference(M: Any, q: Any, lower: Any, upper: Any) -> Any:
    """Return what `reference_point.reference` returns, but with 0 in place of None, and whether the error of a row is
    so large that it sums the row exactly."""
    n = q.size
    near, corner, columns = np.empty(n), np.empty(n), np.empty(n, np.int64)
    for i in range(n):
        near[i] = min(max(0.0, lower[i]), upper[i])
        corner[i] = lower[i] if lower[i] > -np.inf else upper[i] if upper[i] < np.inf else 0.0
    if not near.any() and not corner.any():
        return near, q.copy(), np.zeros(n), np.zeros(n, np.bool_)
    z, (w, terms, _) = near, _rows(M, q, near, columns)
    if (near != corner).any():
        other, other_terms, _ = _rows(M, q, corner, columns)
        if _largest_gap(corner, other, lower, upper) < _largest_gap(near, w, lower, upper):
            z, w, terms = corner, other, other_terms
    if not z.any():
        return z, q.copy(), np.zeros(n), np.zeros(n, np.bool_)
    return z, w, ROW_ROUNDING * terms, terms > CANCELLATION * np.abs(w)


@njit(types.Tuple((types.boolean, NUMBERS, NUMBERS))(MATRIX, VECTOR, VECTOR, VECTOR), **OPTIONS)
def reference_of(M: Any, q: Any, lower: Any, upper: Any) -> Any:
    """Return whether the reference point of a mixed problem seems to solve it, the point z, and z - (M z + q), without
    entries if a bound is far."""
    z, w, _, _ = _reference(M, q, lower, upper)
    t = z - w
    solves = True
    for i in range(z.size):
        for bound in (abs(lower[i]), abs(upper[i])):
            if NO_BOUND <= bound < np.inf:
                return False, z, t[:0]
        solves &= z[i] == min(max(t[i], lower[i]), upper[i])
    return solves, z, t


@compiled
def _solves(M: Any, q: Any, lower: Any, upper: Any, tol: float, z: Any) -> bool:
    """Return whether an admissible z solves the problem, whatever the rounding errors in w are."""
    n, is_closed, columns = q.size, True, np.empty(q.size, np.int64)
    reference, q_ref, q_error, is_rough = _reference(M, q, lower, upper)
    is_moved, is_reference = reference.any(), not (z != reference).any()
    w, given, is_sure = _rows(M, q, z, columns)
    terms, error = given.copy(), ROW_ROUNDING * given
    if is_moved:
        far_w, far, is_far_sure = _rows(M, q_ref, z - reference, columns)
        is_sure &= is_far_sure
        for i in range(n):
            far_error = ROW_ROUNDING * far[i] + q_error[i]
            if far_error < error[i]:
                w[i], error[i] = far_w[i], far_error
            terms[i] = min(given[i], max(far[i], FINEST * given[i]))
    least, worst = np.abs(q_ref), np.empty(n)
    for i in range(n):
        if is_rough[i]:
            least[i] = max(least[i] - q_error[i], 0.0)
        if is_reference:
            is_sure &= _excess(z[i], q_ref[i], lower[i], upper[i]) + q_error[i] <= 0.0
            continue
        worst[i] = _excess(z[i], w[i], lower[i], upper[i]) + error[i]
        is_closed &= worst[i] <= tol * min(least[i], terms[i])
        is_sure &= worst[i] <= max(tol * terms[i], ROUNDING * given[i])
    if not is_sure or is_reference or is_closed:
        return bool(is_sure)
    sizes, rho, parts = _sizes(M, lower, upper, z, reference, q_ref, least, is_rough)
    for i in range(n):
        size = sizes[parts[i]]
        cap = max(2.0 ** (size - rho[i]), least[i])
        if not worst[i] <= max(tol * min(terms[i], cap), ROUNDING * min(given[i], DROWNED * cap)):
            return False
    return True


@compiled
def _sizes(M: Any, lower: Any, upper: Any, z: Any, reference: Any, q_ref: Any, least: Any, is_rough: Any) -> Any:
    """Return log2 of k for each component of M, as `Measure.component_sizes` has them, but NaN where q_ref is too
    rough; the units of the rows and their components. least : bounds on |q_ref|, from below."""
    rho, gamma, parts, column_parts, count = _units_of(M)
    sizes, of_reference, rough = np.full(count, -np.inf), np.full(count, -np.inf), np.zeros(count, np.bool_)
    for i in range(z.size):
        part = parts[i]
        rough[part] |= is_rough[i] and least[i] == 0.0
        if least[i] > 0.0:
            size = np.log2(least[i]) + rho[i]
            of_reference[part] = max(of_reference[part], size)
            if _excess(reference[i], q_ref[i], lower[i], upper[i]) > 0.0:
                sizes[part] = max(sizes[part], size)
        if z[i] != reference[i] and lower[i] < upper[i] and (z[i] == lower[i] or z[i] == upper[i]):
            part = column_parts[i]
            sizes[part] = max(sizes[part], np.log2(abs(z[i] - reference[i])) - gamma[i])
    for part in range(count):
        if sizes[part] == -np.inf:
            sizes[part] = np.nan if rough[part] else of_reference[part] if of_reference[part] > -np.inf else np.inf
    return sizes, rho, parts


@njit(NUMBERS(VECTOR, VECTOR, VECTOR), **OPTIONS)
def without_small_distances(lower: Any, upper: Any, z: Any) -> Any:
    """Return z with 0 and bounds in place of entries that are near them."""
    most, found = SMALL_DISTANCE * np.abs(z).max(), np.empty(z.size)
    for i in range(z.size):
        inside = 0.0 if abs(z[i]) <= most else z[i]
        found[i] = lower[i] if z[i] - lower[i] <= most else upper[i] if upper[i] - z[i] <= most else inside
    return found


@njit(types.boolean(MATRIX, VECTOR, VECTOR, VECTOR, NUMBER, VECTOR), **OPTIONS)
def surely_solves(M: Any, q: Any, lower: Any, upper: Any, tol: float, z: Any) -> bool:
    """Return `_solves` of a point."""
    return bool(_solves(M, q, lower, upper, tol, z))
