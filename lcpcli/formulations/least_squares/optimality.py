"""Whether the optimality conditions of a fit hold, row by row."""

from __future__ import annotations

import numpy as np

from lcpcli.formulations.least_squares.fit import Data
from lcpcli.linalg.doubles import EPS
from lcpcli.typing import Mask, Vector

# The conditions must hold to this, relative to the terms of each row. It is 2e-13, far
# below every tolerance that a user may set for a run that is not exact.
ROUNDING_OF_ROWS = 1000 * EPS
# With equations, the terms of A x may be this many times the largest |b|, and those of
# E x this many times |d|. Larger terms cancel, which may hide a contradiction.
MAX_CANCELLATION = 1e6
REASON = "each row holds to 2e-13 of its terms"


@np.errstate(all="ignore")
def holds(data: Data, r: Vector, x: Vector, y: Vector) -> Mask:
    """Return whether all optimality conditions hold to rounding of the terms of each
    row; for several fits, which are columns of r, x and y, one truth value for each.
    r must be b - A x as computed, since large terms of A x would hide any other r.

    The criterion of the package (`verify.measure`) allows a row a violation of 1e-10 of
    its terms, and does not count terms that are much larger than b and d explain. Here
    a row may be violated by 2e-13 of its terms. Bounds must have 0 between them,
    because the criterion counts terms from the bounds; and with equations the terms
    must be explained by b and d.
    """
    A, b, lower, upper, E, d = data
    if not ((lower <= 0) & (upper >= 0)).all():
        return np.zeros(b.shape[1:], dtype=bool)
    if x.ndim > 1:
        lower = lower[:, np.newaxis]
        upper = upper[:, np.newaxis]
        d = d[:, np.newaxis]
    of_A = abs(A)
    sizes = of_A @ np.abs(x)
    violation = np.abs(r + A @ x - b)
    good = (violation <= ROUNDING_OF_ROWS * (sizes + np.abs(b))).all(axis=0)
    slopes = A.T @ r
    terms = of_A.T @ np.abs(r)
    # Without equations a minimizer always exists, so that cancellation in A x cannot
    # hide a contradiction.
    if len(data.d):
        of_E = abs(E)
        others = of_E @ np.abs(x)
        largest = np.abs(b).max(axis=0, initial=0.0)
        good &= sizes.max(axis=0, initial=0.0) <= MAX_CANCELLATION * largest
        good &= (others <= MAX_CANCELLATION * np.abs(d)).all(axis=0)
        violation = np.abs(E @ x - d)
        good &= (violation <= ROUNDING_OF_ROWS * (others + np.abs(d))).all(axis=0)
        slopes = slopes + E.T @ y
        terms = terms + of_E.T @ np.abs(y)
    terms = ROUNDING_OF_ROWS * terms
    rises = (slopes <= terms) | (x >= upper)
    falls = (slopes >= -terms) | (x <= lower)
    return np.asarray(good & (rises & falls).all(axis=0))
