"""Pairs of problems with one M, from seeds."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from lcpcli import Problem

Pair = tuple[Problem, Problem]


def positive(seed: int, least: int = 5, most: int = 50) -> Pair:
    """Return two problems whose M is positive definite, so a P-matrix, and not symmetric; one in three with bounds, one
    in three with bounds that move."""
    random = np.random.default_rng(seed)
    n = int(random.integers(least, most + 1))
    A, K = random.standard_normal((2, n, n))
    M = A @ A.T / n + 0.1 * np.eye(n) + K - K.T
    first, last = random.standard_normal((2, n))
    lower, upper = -random.random(n), random.random(n)
    given: list[dict[str, Any]] = [{}, {}]
    if seed % 3:
        given = [{"lower": lower, "upper": upper}] * 2
    if seed % 3 == 2:
        given[1] = {"lower": lower - random.random(n), "upper": upper + random.random(n)}
    return Problem(M, first, **given[0]), Problem(M, last, **given[1])


def integers(seed: int, most: int = 12) -> Pair:
    """Return two problems of small integers, with many ties: M positive definite, semidefinite, triangular with a unit
    diagonal, or that of linear programs."""
    random, kind = np.random.default_rng(seed), seed % 4
    n = int(random.integers(2, most + 1))
    first, last = random.integers(-1, 2, (2, n))
    if kind == 0:
        A = random.integers(-1, 2, (n, n))
        M = A @ A.T + 2 * np.eye(n)
    elif kind == 1:
        A = random.integers(-1, 2, (n, max(1, n // 2)))
        M = A @ A.T
    elif kind == 2:
        M = np.tril(random.integers(0, 3, (n, n)), -1) + np.eye(n)
    else:
        k = n // 2
        A, M = random.integers(-1, 2, (n - k, k)), np.zeros((n, n))
        M[k:, :k], M[:k, k:] = A, -A.T
    return Problem(M, np.abs(first) if kind % 2 else first), Problem(M, last)


def boxed(seed: int) -> Pair:
    """Return two problems of small integers with bounds, some of them equal, and for every third seed moving."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 9))
    A = random.integers(-3, 4, (n, n))
    M = A @ A.T + np.eye(n) + np.triu(A) - np.triu(A).T
    lower = random.integers(-2, 1, n).astype(float)
    upper = lower + random.integers(0, 3, n)
    moved = random.integers(-1, 2, (2, n)) * (seed % 3 == 0)
    last_lower = lower + moved[0]
    last_upper = np.maximum(last_lower, upper + moved[1])
    free = random.integers(0, n)
    upper[free] = last_upper[free] = np.inf
    first, last = random.integers(-2, 3, (2, n))
    return Problem(M, first, lower=lower, upper=upper), Problem(M, last, lower=last_lower, upper=last_upper)


def general(seed: int) -> Pair:
    """Return two problems whose M has no class, or is copositive, n <= 5, of which the first is solved by 0."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 6))
    M = random.integers(-9, 10, (n, n))
    if seed % 2:
        M = np.abs(M) * random.integers(0, 2, (n, n))
    return Problem(M, random.integers(1, 20, n)), Problem(M, random.integers(-19, 20, n))


def sparsely(pair: Pair) -> Pair:
    """Return the same problems with a sparse M."""
    M = sparse.csr_array(pair[0].M)
    first, last = (Problem(M, each.q, lower=each.lower, upper=each.upper) for each in pair)
    return first, last
