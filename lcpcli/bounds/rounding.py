"""Upper bounds on rounding errors in the quantities of a bound, by the standard model of floating-point arithmetic.

N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, chapter 3: an inner product of k terms
has an error of at most gamma_k = k u / (1 - k u) times that of the absolute values, in any order of summation. With the
entries of M and z in the range required here, no product M_ij z_j underflows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import accurate_residual, is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

Theorem = Callable[[Vector, Vector], float]
"""An upper bound on |z - z*|_inf, possibly infinite, from z in range and w = M z + q with relative errors up to EPS."""
LARGEST_ENTRY = 2.0**450
SMALLEST_ENTRY = 2.0**-450


def in_range(A: Matrix, smallest: float = 0.0) -> bool:
    """Whether all entries are finite and at most LARGEST_ENTRY, and those that are not zero at least `smallest`."""
    entries = np.abs(A.data if is_sparse(A) else A)
    if not entries.size:
        return True
    if not entries.max() <= LARGEST_ENTRY:
        return False
    return smallest == 0 or bool(entries.min(where=entries != 0, initial=LARGEST_ENTRY) >= smallest)


def factor(terms: int) -> float:
    """gamma for sums of that many products and a few operations before and after, with a margin."""
    return (terms + 16) * EPS


def terms(M: Matrix) -> int:
    """The largest number of terms in a row of M."""
    return int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else int(M.shape[1])


def residual(problem: Problem, z: Vector) -> Vector | None:
    """M z + q with componentwise relative error at most EPS, for M in range; None if z or the result is not."""
    if not in_range(z):
        return None
    try:
        w = -accurate_residual(problem.M, z, -problem.q)
    except (OverflowError, ValueError):
        return None
    return w if in_range(w) else None


def norm(v: Vector) -> float:
    """An upper bound on |v|_2, for a largest entry up to LARGEST_ENTRY; at least SMALLEST_NORMAL."""
    largest = max(float(np.abs(v).max()), SMALLEST_NORMAL)
    scaled = v / largest
    return largest * float(np.sqrt(scaled @ scaled)) * (1 + factor(v.size)) + SMALLEST_NORMAL
