"""Residuals as if in more than twice the precision.

Every product is split into its rounded value and its error (T. J. Dekker, A floating-point technique for extending the
available precision, Numerische Mathematik 18 (1971) 224-242), and math.fsum adds them up exactly. For many rows at once
the sums are distilled: T. Ogita, S. M. Rump and S. Oishi, Accurate sum and dot product, SIAM Journal on Scientific
Computing 26 (2005) 1955-1988.
"""

from __future__ import annotations

import math
from itertools import chain, pairwise

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.matrices import is_sparse, row_parts
from lcpcli.typing import Matrix, Vector

SPLITTER = 2.0**27 + 1  # Dekker's, for a mantissa of 53 bits
FEWEST_ROWS = 200  # of a sparse matrix, from which they are added up together
MOST_PADDED = 4  # times the entries of a block of rows: those of a table of them
CANCELLED = 2.0**-80  # of the terms: sums that are smaller need more than three times the precision


def accurate_residual(A: Matrix, x: Vector, b: Vector) -> Vector:
    """Return b - A x for A dense or in compressed sparse rows, rounded once (except for over- and underflow)."""
    if not is_sparse(A):
        return np.array([_sum(value, *_products(row, x)) for value, row in zip(b.tolist(), A, strict=True)])
    w = np.empty(b.size)
    for part in row_parts(b.size):
        rows = A if w.size <= part.stop - part.start else A[part]
        longest = int(np.diff(rows.indptr).max())
        together = rows.shape[0] >= FEWEST_ROWS and longest * rows.shape[0] <= MOST_PADDED * rows.nnz
        w[part] = (_distilled if together else _summed)(rows, x, b[part])
    return w


def _summed(A: Matrix, x: Vector, b: Vector) -> Vector:
    terms, errors = _products(A.data, x[A.indices])
    rows = [slice(start, stop) for start, stop in pairwise(A.indptr.tolist())]
    return np.array([_sum(value, terms[row], errors[row]) for value, row in zip(b.tolist(), rows, strict=True)])


def _distilled(A: Matrix, x: Vector, b: Vector) -> Vector:
    """Return the residuals of all rows of a sparse A, whose lengths are similar, at once."""
    lengths = np.diff(A.indptr)
    entries = np.arange(lengths.max())[:, np.newaxis]
    places = np.minimum(A.indptr[:-1] + entries, A.nnz - 1)
    used = np.where(entries < lengths, A.data[places], 0.0)
    terms = np.concatenate((b[np.newaxis], *_split_products(used, x[A.indices[places]])))
    sizes = np.abs(terms).sum(axis=0)
    for _ in range(2):
        for low, high in pairwise(terms):  # to their rounded sum, and its error
            total = low + high
            part = total - low
            np.add(low - (total - part), high - part, out=low)
            high[:] = total
    rest = terms[:-1].sum(axis=0)
    w: Vector = terms[-1] + rest
    unsure = ((np.abs(w) <= CANCELLED * sizes) & terms[:-1].any(axis=0)).nonzero()[0]
    if unsure.size:
        w[unsure] = _summed(A[unsure], x, b[unsure])
    return w


def _sum(value: float, terms: list[float], errors: list[float]) -> float:
    return math.fsum(chain((value,), terms, errors))


def _products(a: Vector, x: Vector) -> tuple[list[float], list[float]]:
    """Return two lists whose i-th entries add up to exactly -a_i x_i."""
    check()
    terms, errors = _split_products(a, x)
    return terms.tolist(), errors.tolist()


def _split_products(a: Vector, x: Vector) -> tuple[Vector, Vector]:
    """Return two arrays whose entries add up to exactly those of -a x."""
    terms = a * x
    a_high, a_low = _split(a)
    x_high, x_low = _split(x)
    errors = a_low * x_low - (((terms - a_high * x_high) - a_low * x_high) - a_high * x_low)
    return -terms, -errors


def _split(v: Vector) -> tuple[Vector, Vector]:
    """Return v as the sum of two vectors of 26 bits each."""
    large = SPLITTER * v
    high = large - (large - v)
    return high, v - high
