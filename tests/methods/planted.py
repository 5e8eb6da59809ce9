"""Problems, mixed ones of every kind too, that are built around a solution."""

import numpy as np
from scipy.sparse import csr_array

from lcpcli import Problem

from ..mixed_problems import definite, monotone, with_all_bounds

KINDS = ("definite", "monotone", "semidefinite", "skew", "program", "zero")
AT_LOWER, BETWEEN, AT_UPPER = range(3)


def matrix(kind, n, random):
    """M with M + M' positive semidefinite, of full rank, of rank n / 2, or 0; the
    conditions of a program; or any M."""
    if kind == "definite":
        return definite(n, random)[0]
    if kind == "monotone":
        return monotone(n, random)[0]
    B = random.standard_normal((n, n))
    half = B[: n // 2]
    m = n // 3
    A, Q = B[:m, m:], half[:, m:].T @ half[:, m:] / n
    return {
        "semidefinite": half.T @ half / n,
        "skew": B - B.T,
        "half": half.T @ half / n + B - B.T,
        "program": np.block([[Q, -A.T], [A, np.zeros((m, m))]]),
        "zero": np.zeros((n, n)),
        "any": B,
    }[kind]


def solvable(kind, n, random, degenerate=False, sparse=False):
    """A problem built around a solution, with bounds of all kinds; if degenerate, w is
    0 at half of those attained."""
    M = matrix(kind, n, random)
    lower, upper = with_all_bounds(n, random)
    states = random.integers(0, 3, n)
    at_lower = (states == AT_LOWER) & np.isfinite(lower)
    at_upper = (states == AT_UPPER) & np.isfinite(upper)
    some = random.standard_normal(n)
    z = np.where(
        at_lower, lower, np.where(at_upper, upper, np.clip(some, lower, upper))
    )
    w = random.uniform(0.5, 2, n) * (at_lower * 1.0 - at_upper * 1.0)
    if degenerate:
        w[random.random(n) < 0.5] = 0.0
    return Problem(csr_array(M) if sparse else M, w - M @ z, lower=lower, upper=upper)


def planted(n, seed, density=1.0):
    """A normal M, or one with a share of its entries, and q for which z and w have half
    of their entries each."""
    random = np.random.default_rng(seed)
    M = random.standard_normal((n, n))
    M *= random.random((n, n)) < density
    basic = random.random(n) < 0.5
    z = np.where(basic, random.random(n) + 0.1, 0)
    w = np.where(basic, 0, random.random(n) + 0.1)
    return M, w - M @ z
