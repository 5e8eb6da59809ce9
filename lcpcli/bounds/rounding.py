"""What rounding can do to the quantities of a bound, from above, by the usual model of floating-point arithmetic.

N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, chapter 3: an inner product of k terms
is off by at most gamma_k = k u / (1 - k u) times that of the absolute values, whatever the order of summation. With the
entries of M and z in the range that is asked for here, no product M_ij z_j underflows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lcpcli.linalg.accurate import accurate_residual
from lcpcli.linalg.doubles import EPS, SMALLEST_NORMAL
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import Problem
from lcpcli.typing import Matrix, Vector

Theorem = Callable[[Vector, Vector], float]
"""At least |z - z*|_inf, not always finite, from z in range and w = M z + q, each component within EPS of itself."""
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
    """gamma for sums of so many products and some operations on them before and after, with room to spare."""
    return (terms + 16) * EPS


def terms(M: Matrix) -> int:
    """The largest number of terms in a row of M."""
    return int(np.diff(M.indptr).max(initial=0)) if is_sparse(M) else int(M.shape[1])


def residual(problem: Problem, z: Vector) -> Vector | None:
    """M z + q, every component within EPS of itself, for M in range; None where z or that is not."""
    if not in_range(z):
        return None
    try:
        w = -accurate_residual(problem.M, z, -problem.q)
    except (OverflowError, ValueError):
        return None
    return w if in_range(w) else None


def norm(v: Vector) -> float:
    """At least |v|_2, for a largest entry between SMALLEST_NORMAL and LARGEST_ENTRY; at least SMALLEST_NORMAL."""
    largest = max(float(np.abs(v).max()), SMALLEST_NORMAL)
    scaled = v / largest
    return largest * float(np.sqrt(scaled @ scaled)) * (1 + factor(v.size)) + SMALLEST_NORMAL
