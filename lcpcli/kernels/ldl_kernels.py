"""LDL' factors of sparse symmetric quasidefinite matrices with one pattern, compiled by numba.

Rows of L are computed one after another, each by a triangular system: T. A. Davis, Algorithm 849: A concise sparse
Cholesky factorization package, ACM Trans. Math. Software 31 (2005) 587-591. The pattern of L, by the elimination tree
(J. W. H. Liu, The role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11 (1990) 134-172), is
found once, with the place of each entry; then no factorization searches or permutes. No pivots are exchanged, as a
quasidefinite matrix has such factors in every order: R. J. Vanderbei, Symmetric quasidefinite matrices, SIAM J. Optim.
5 (1995) 100-113.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

INNER = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "error_model": "numpy"}  # as only kernels call them
compiled = njit(_nrt=True, **INNER)
# Functions that neither make nor keep arrays need not count references to those that they are given: each count is an
# atomic operation, which takes longer than a step of arithmetic.
borrowing = njit(_nrt=False, **INNER)
arithmetic = njit(fastmath={"reassoc", "contract", "arcp", "nsz"}, _nrt=False, **INNER)  # with sums in any order
INDEX = np.uint32  # numba wraps a signed index around where it is negative, which takes half of the time of a loop
SMALLEST_PIVOT, REPLACED_PIVOT = 1e-13, 1e-7  # of a matrix with entries of about 1: a smaller one, and what it becomes
NONE = -1


class Pattern(NamedTuple):
    """The pattern of L, without its diagonal of ones: by columns, and by rows, whose entries are those of columns.

    begin, rows : where each column begins, and its rows, ascending. row_begin, columns, places : where each row
    begins, its columns, ascending, and the places of its entries in the columns.
    """

    begin: Any
    rows: Any
    row_begin: Any
    columns: Any
    places: Any


class Factors(NamedTuple):
    """A symmetric matrix K in its order of elimination, and its factors.

    begin, rows, values : its strict upper triangle by columns. signs : of its pivots. diagonal : its diagonal.
    pattern, L, inverse : the pattern and the values of L, and 1 / D. work : zeros.
    """

    begin: Any
    rows: Any
    values: Any
    signs: Any
    diagonal: Any
    pattern: Pattern
    L: Any
    inverse: Any
    work: Any


@compiled
def _tree(n: int, begin: Any, rows: Any) -> Any:
    """Return the elimination tree of a strict upper triangle by columns, and the numbers of entries of the columns and
    of the rows of L."""
    parent, mark = np.full(n, NONE, np.int64), np.full(n, NONE, np.int64)
    in_column, in_row = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for k in range(n):
        mark[k] = k
        for p in range(begin[k], begin[k + 1]):
            i = np.int64(rows[p])
            while mark[i] != k:
                if parent[i] == NONE:
                    parent[i] = k
                mark[i] = k
                in_column[i] += 1
                in_row[k] += 1
                i = parent[i]
    return parent, in_column, in_row


@compiled
def _beginnings(counts: Any) -> Any:
    begin = np.zeros(counts.size + 1, INDEX)
    for i in range(counts.size):
        begin[i + 1] = begin[i] + counts[i]
    return begin


@compiled
def pattern_of(n: int, begin: Any, rows: Any, most: float) -> tuple[Pattern, float]:
    """Return the pattern of L for the strict upper triangle of a matrix by columns, empty if a factorization takes more
    than `most` operations, and the number of these."""
    parent, in_column, in_row = _tree(n, begin, rows)
    operations = 0.0
    for i in range(n):
        operations += in_column[i] * (in_column[i] + 2.0)
    size = np.sum(in_column) if operations <= most else 0
    L_begin, row_begin = _beginnings(in_column), _beginnings(in_row)
    L_rows, columns, places = np.empty(size, INDEX), np.empty(size, INDEX), np.empty(size, INDEX)
    if size == 0:
        return Pattern(L_begin, L_rows, row_begin, columns, places), operations
    end, mark = L_begin[:n].copy(), np.full(n, NONE, np.int64)
    for k in range(n):
        mark[k] = k
        for p in range(begin[k], begin[k + 1]):
            i = np.int64(rows[p])
            while mark[i] != k:
                L_rows[end[i]] = k
                end[i] += 1
                mark[i] = k
                i = parent[i]
    end = row_begin[:n].copy()
    for j in range(n):
        for p in range(L_begin[j], L_begin[j + 1]):
            at = end[L_rows[p]]
            columns[at], places[at] = j, p
            end[L_rows[p]] = at + 1
    return Pattern(L_begin, L_rows, row_begin, columns, places), operations


@arithmetic
def factorize(K: Factors) -> int:
    """Compute the factors; return how many pivots were too small or had the wrong sign, and were replaced."""
    begin, rows, values, x, inverse = K.begin, K.rows, K.values, K.work, K.inverse
    L, L_begin, L_rows, row_begin, columns, places = K.L, K.pattern.begin, K.pattern.rows, *K.pattern[2:]
    replaced = 0
    for k in range(inverse.size):
        for p in range(begin[k], begin[k + 1]):
            x[rows[p]] = values[p]
        d = K.diagonal[k]
        for t in range(row_begin[k], row_begin[k + 1]):
            j, end = columns[t], places[t]
            y = x[j]
            x[j] = 0.0
            for p in range(L_begin[j], end):
                x[L_rows[p]] -= L[p] * y
            entry = y * inverse[j]
            d -= entry * y
            L[end] = entry
        if not d * K.signs[k] > SMALLEST_PIVOT:
            replaced += 1
            d = K.signs[k] * REPLACED_PIVOT
        inverse[k] = 1.0 / d
    return replaced


@arithmetic
def solve(K: Factors, b: Any) -> None:
    """Replace b by the solution of K x = b."""
    L, inverse, begin, rows = K.L, K.inverse, K.pattern.begin, K.pattern.rows
    n = inverse.size
    for j in range(n):
        y = b[j]
        for p in range(begin[j], begin[j + 1]):
            b[rows[p]] -= L[p] * y
    for k in range(n):
        j = np.uint64(n - 1 - k)
        total = b[j] * inverse[j]
        for p in range(begin[j], begin[j + np.uint64(1)]):
            total -= L[p] * b[rows[p]]
        b[j] = total
