"""The problem that the compiled interior point method works on: without fixed variables, in scaled units, and in the
order of elimination, so that no later step permutes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from lcpcli.kernels.ldl_kernels import INDEX, Factors, arithmetic, borrowing, compiled, pattern_of
from lcpcli.kernels.ordering_kernels import elimination_order

RUIZ_ROUNDS, RUIZ_CLOSE, RUIZ_FARTHEST = 12, 0.1, 1e8  # as in `interior_scaling`
ROUNDING_OF_0 = 1e-15  # of the largest number of q and the bounds, in scaled units: a q_i that counts as 0
FAR = 1e20  # a bound of this size counts as none; z is admissible for the bound as it is


class Scaled(NamedTuple):
    """A problem whose numbers are about 1.

    begin, columns, values, q, lower, upper : M in compressed rows, q and the bounds. signs : S with S M symmetric.
    z_ref, q_ref : the admissible point that is nearest to 0, and M z_ref + q.
    variables, units : z[variables] = units z' for the z' of this problem.
    """

    begin: Any
    columns: Any
    values: Any
    q: Any
    lower: Any
    upper: Any
    signs: Any
    z_ref: Any
    q_ref: Any
    variables: Any
    units: Any


@compiled
def without_fixed(begin: Any, columns: Any, values: Any, q: Any, lower: Any, upper: Any, z: Any) -> Any:
    """Return the variables that are not fixed, M in their rows and columns without zeros, and q for the others at their
    values, which are written into z."""
    n, place, kept = q.size, np.full(q.size, -1, np.int64), 0
    variables = np.empty(n, np.int64)
    for i in range(n):
        if lower[i] < upper[i]:
            place[i] = kept
            variables[kept] = i
            kept += 1
        else:
            z[i] = lower[i]
    M_begin, M_columns, M_values = np.zeros(kept + 1, INDEX), np.empty(values.size, INDEX), np.empty(values.size)
    own_q, end = np.empty(kept), 0
    for k in range(kept):
        i = variables[k]
        own_q[k] = q[i]
        for p in range(begin[i], begin[i + 1]):
            j = columns[p]
            if place[j] < 0:
                own_q[k] += values[p] * z[j]
            elif values[p] != 0.0:
                M_columns[end], M_values[end] = place[j], values[p]
                end += 1
        M_begin[k + 1] = end
    return variables[:kept], M_begin, M_columns[:end], M_values[:end], own_q


@compiled
def mirrored(n: int, begin: Any, columns: Any, values: Any) -> Any:
    """Return the M_ji in the places of the M_ij, and whether M, in sorted rows, has a symmetric pattern."""
    at, mirror = begin[:n].copy(), np.empty(values.size)
    for i in range(n):
        for p in range(begin[i], begin[i + 1]):
            j = columns[p]
            if at[j] == begin[j + 1] or columns[at[j]] != i:
                return mirror, False
            mirror[at[j]] = values[p]
            at[j] += 1
    return mirror, True


@compiled
def signs_of(n: int, begin: Any, columns: Any, values: Any, mirror: Any) -> Any:
    """Return S of entries 1 and -1 with S M symmetric, as `linalg.patterns.signs` does, and whether there is one."""
    signs, stack = np.zeros(n), np.empty(n, np.int64)
    for root in range(n):
        if signs[root] != 0.0:
            continue
        signs[root], stack[0], top = 1.0, root, 1
        while top > 0:
            top -= 1
            i = stack[top]
            for p in range(begin[i], begin[i + 1]):
                j = columns[p]
                sign = signs[i] if values[p] == mirror[p] else -signs[i]
                if abs(values[p]) != abs(mirror[p]) or signs[j] == -sign:
                    return signs, False
                if signs[j] == 0.0:
                    signs[j], stack[top] = sign, j
                    top += 1
    return signs, True


@arithmetic
def ruiz(begin: Any, columns: Any, values: Any, d: Any, sizes: Any) -> None:
    """Write D, powers of two, with largest entries of about 1 in the rows and columns of D M D, for symmetric |M|: D.
    Ruiz, A scaling algorithm to equilibrate both rows and columns norms in matrices, RAL-TR-2001-034. sizes : work."""
    n = d.size
    d[:] = 1.0
    for _ in range(RUIZ_ROUNDS):
        farthest = 0.0
        for i in range(n):
            largest = 0.0
            for p in range(begin[i], begin[i + 1]):
                largest = max(largest, abs(values[p]) * d[columns[p]])
            sizes[i] = largest * d[i] if largest > 0.0 else 1.0
            farthest = max(farthest, abs(sizes[i] - 1.0))
        for i in range(n):
            d[i] = min(max(d[i] / np.sqrt(sizes[i]), 1.0 / RUIZ_FARTHEST), RUIZ_FARTHEST)
        if farthest < RUIZ_CLOSE:
            break
    for i in range(n):
        d[i] = 2.0 ** np.rint(np.log2(d[i]))


@borrowing
def _largest_number(q: Any, lower: Any, upper: Any, variables: Any, d: Any) -> float:
    """Return the power of two nearest to the largest number of D q and of the bounds over D; 1 if all are 0."""
    largest = 0.0
    for k in range(q.size):
        i = variables[k]
        largest = max(largest, abs(q[k]) * d[k])
        for bound in (lower[i], upper[i]):
            if abs(bound) < FAR:
                largest = max(largest, abs(bound) / d[k])
    return 2.0 ** np.rint(np.log2(largest)) if largest > 0.0 else 1.0


@compiled
def _permuted(order: Any, M: Any, mirror: Any, signs: Any, d: Any) -> Any:
    """Return D M D in an order of elimination, by rows, its diagonal, and the strict upper triangle of S D M D by
    columns."""
    begin, columns, values = M
    n, at, above = order.size, 0, 0
    place, diagonal = np.empty(n, np.int64), np.zeros(n)
    for k in range(n):
        place[order[k]] = k
    M_begin, M_columns, M_values = np.zeros(n + 1, INDEX), np.empty(values.size, INDEX), np.empty(values.size)
    K_begin, K_rows, K_values = np.zeros(n + 1, INDEX), np.empty(values.size, INDEX), np.empty(values.size)
    for k in range(n):
        i = order[k]
        for p in range(begin[i], begin[i + 1]):
            j = columns[p]
            own, factor = place[j], d[i] * d[j]
            M_columns[at], M_values[at] = own, values[p] * factor
            at += 1
            if own == k:
                diagonal[k] = values[p] * factor
            elif own < k:
                K_rows[above], K_values[above] = own, signs[j] * mirror[p] * factor
                above += 1
        M_begin[k + 1], K_begin[k + 1] = at, above
    return (M_begin, M_columns, M_values), diagonal, (K_begin, K_rows, K_values)


@compiled
def scaled(
    variables: Any, M: Any, mirror: Any, q: Any, lower: Any, upper: Any, signs: Any, most: float
) -> tuple[Scaled, Factors, Any, float]:
    """Return the problem in scaled units and in an order of elimination, a place for the factors of S (M + D), which is
    empty if they take more than `most` operations, the diagonal of M, and the number of these operations.

    variables, M, q : as from `without_fixed`. mirror, signs : of this M. lower, upper : of all variables.
    """
    n, d, order = q.size, np.empty(q.size), elimination_order(q.size, M[0], M[1])
    ruiz(*M, d, np.empty(n))
    largest = _largest_number(q, lower, upper, variables, d)
    (begin, columns, values), diagonal, (K_begin, K_rows, K_values) = _permuted(order, M, mirror, signs, d)
    own_q, low, high, own_signs = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    z_ref, q_ref, own, units = np.empty(n), np.empty(n), np.empty(n, np.int64), np.empty(n)
    for k in range(n):
        i = order[k]
        own[k], units[k], own_signs[k] = variables[i], d[i] * largest, signs[i]
        own_q[k] = q[i] * d[i] / largest
        if abs(own_q[k]) <= ROUNDING_OF_0:
            own_q[k] = 0.0
        low[k] = lower[own[k]] / units[k] if lower[own[k]] > -FAR else -np.inf
        high[k] = upper[own[k]] / units[k] if upper[own[k]] < FAR else np.inf
        z_ref[k] = min(max(0.0, low[k]), high[k])
    problem = Scaled(begin, columns, values, own_q, low, high, own_signs, z_ref, q_ref, own, units)
    times(problem, z_ref, q_ref)
    for k in range(n):
        q_ref[k] += own_q[k]
    pattern, operations = pattern_of(n, K_begin, K_rows, most)
    L = np.empty(pattern.rows.size)
    factors = Factors(K_begin, K_rows, K_values, own_signs, np.empty(n), pattern, L, np.empty(n), np.zeros(n))
    return problem, factors, diagonal, operations


@arithmetic
def times(problem: Scaled, z: Any, product: Any) -> None:
    """Write M z into `product`."""
    begin, columns, values = problem.begin, problem.columns, problem.values
    for i in range(product.size):
        total = 0.0
        for p in range(begin[i], begin[i + 1]):
            total += values[p] * z[columns[p]]
        product[i] = total
