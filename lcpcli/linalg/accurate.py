"""Residuals of linear systems as if in doubled precision: exact sums, rounded once."""

from __future__ import annotations

import math
from itertools import chain, pairwise

import numpy as np

from lcpcli.interrupts import check
from lcpcli.linalg.matrices import is_sparse
from lcpcli.typing import Matrix, Vector

SPLITTER = 2.0**27 + 1  # Dekker's, for a mantissa of 53 bits


def accurate_residual(A: Matrix, x: Vector, b: Vector) -> Vector:
    """b - A x for A of shape (m, n), dense or in compressed sparse rows, rounded once (barring under- and overflow).

    Every product is split into its rounded value and its error (Dekker 1971), and math.fsum adds them up exactly.
    """
    if is_sparse(A):
        terms, errors = _products(A.data, x[A.indices])
        rows = [slice(start, stop) for start, stop in pairwise(A.indptr.tolist())]
        sums = [
            math.fsum(chain((value,), terms[row], errors[row])) for value, row in zip(b.tolist(), rows, strict=True)
        ]
    else:
        sums = [math.fsum(chain((value,), *_products(row, x))) for value, row in zip(b.tolist(), A, strict=True)]
    return np.array(sums)


def _products(a: Vector, x: Vector) -> tuple[list[float], list[float]]:
    """Two lists that add up to -a_i x_i, entry by entry, without error."""
    check()
    terms = a * x
    a_high, a_low = _split(a)
    x_high, x_low = _split(x)
    errors = a_low * x_low - (((terms - a_high * x_high) - a_low * x_high) - a_high * x_low)
    return (-terms).tolist(), (-errors).tolist()


def _split(v: Vector) -> tuple[Vector, Vector]:
    """v as the sum of two vectors of 26 bits each."""
    large = SPLITTER * v
    high = large - (large - v)
    return high, v - high
