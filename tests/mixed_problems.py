"""Random problems with bounds of all kinds."""

import numpy as np

KINDS = 5  # a lower bound, an upper bound, both, the same, none


def definite(n, generator):
    """M symmetric positive definite, and q."""
    A = generator.standard_normal((n, n))
    return A @ A.T / n + 0.2 * np.eye(n), 3 * generator.standard_normal(n)


def monotone(n, generator):
    """The same with a skew-symmetric part."""
    M, q = definite(n, generator)
    B = generator.standard_normal((n, n))
    return M + 0.3 * (B - B.T), q


def with_all_bounds(n, generator):
    """Bounds of each kind in turn, in random order."""
    kinds = generator.permutation(np.arange(n) % KINDS)
    low, high = np.sort(generator.standard_normal((2, n)), axis=0)
    lower = np.where((kinds == 0) | (kinds == 2) | (kinds == 3), low, -np.inf)
    upper = np.where(
        kinds == 3, low, np.where((kinds == 1) | (kinds == 2), high, np.inf)
    )
    return lower, upper
