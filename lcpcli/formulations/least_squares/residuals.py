"""Residuals b - A x in about twice double precision, for whole matrices at once.

The rounding errors of products and sums are themselves floating-point numbers, which
are computed and added up: T. Ogita, S. M. Rump and S. Oishi, Accurate sum and dot
product, SIAM Journal on Scientific Computing 26 (2005) 1955-1988. Here the terms of a
row are added in pairs.
"""

from __future__ import annotations

import numpy as np

from lcpcli.linalg.double_double import two_sum
from lcpcli.linalg.matrices import split_products
from lcpcli.typing import Matrix, Vector


def residual(A: Matrix, x: Vector, b: Vector) -> Vector:
    """Return b - A x for a dense A of shape (m, n), with an error of about one rounding
    unless the cancellation is extreme.
    """
    used = x.nonzero()[0]
    terms, errors = split_products(A[:, used].T, x[used, np.newaxis])
    terms = np.vstack((b, terms))
    low = errors.sum(axis=0)
    while len(terms) > 1:
        half = len(terms) // 2
        sums, lost = two_sum(terms[:half], terms[half : 2 * half])
        low += lost.sum(axis=0)
        terms = np.vstack((sums, terms[2 * half :]))
    return np.asarray(terms[0] + low)
