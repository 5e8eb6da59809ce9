"""Random mixed problems with a known solution (original to lcp)."""

from __future__ import annotations

import numpy as np

from lcpcli.model.problem import Problem

CLASS = "symmetric positive definite"
SOURCE = "original to lcp"
KINDS = 5  # boxed, a lower bound, an upper one, free, fixed


def boxes(n: int, seed: int) -> Problem:
    """Random integers: M = A A' + n I, bounds of every kind, and the q for which a random z is the solution.

    Of the variables with a bound, about two thirds are at one.
    """
    random = np.random.default_rng([seed, n])
    A = random.integers(-2, 3, (n, n)).astype(float)
    M = A @ A.T + n * np.eye(n)
    kind, state = random.permutation(np.arange(n) % KINDS), random.integers(0, 3, n)
    low = random.integers(-9, 10, n).astype(float)
    high = low + random.integers(2, 9, n)
    lower = np.where((kind == 2) | (kind == 3), -np.inf, low)
    upper = np.where((kind == 1) | (kind == 3), np.inf, np.where(kind == 4, low, high))
    at_lower, at_upper = (state == 0) & np.isfinite(lower), (state == 1) & np.isfinite(upper)
    z = np.where(at_lower | (kind == 4), lower, np.where(at_upper, upper, low + 1))
    size = random.integers(1, 10, n).astype(float)
    w = np.where(kind == 4, size - 5, np.where(at_lower, size, np.where(at_upper, -size, 0.0)))
    note = f"{np.count_nonzero(at_lower)} variables at a lower bound, {np.count_nonzero(at_upper)} at an upper one."
    return Problem(M, w - M @ z, name=f"boxes-{n}", source=SOURCE, solutions=(z,), note=note, lower=lower, upper=upper)
