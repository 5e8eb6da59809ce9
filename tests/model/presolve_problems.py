"""Random small mixed problems with what presolve looks for, and the first-order conditions of linear programs."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.sparse import block_array, csr_array

from lcpcli import Problem
from lcpcli.typing import Vector


def problem(random: Generator, most: int = 6) -> Problem:
    """Small integers; bounds of all kinds; a pattern that a rule looks for; a solution, for more than half of them."""
    n = int(random.integers(1, most + 1))
    M = np.where(random.random((n, n)) < random.choice([0.2, 0.35, 0.5, 0.8]), random.integers(-2, 3, (n, n)), 0)
    lower, upper = bounds(random, n)
    if n > 1:
        PATTERNS[random.integers(len(PATTERNS))](random, M, lower, upper)
    q = random.integers(-2, 3, n)
    if random.random() < 0.6:
        z, w = solution(random, lower, upper)
        q = w - M @ z
    else:
        i, j = random.integers(n, size=2)
        q[j] = q[i] * random.choice([-1, 1, 2])
    return Problem(csr_array(M.astype(float)) if random.random() < 0.3 else M, q, lower=lower, upper=upper)


def bounds(random: Generator, n: int) -> tuple[Vector, Vector]:
    low, high = np.sort(random.integers(-2, 3, (2, n)), axis=0).astype(float)
    kind = random.integers(7, size=n)  # 0 and 1: z >= 0; 2: one more lower bound; 3: an upper one; 4: both; 5: fixed
    lower = np.select([kind <= 1, np.isin(kind, (2, 4, 5))], [0.0, low], -np.inf)
    return lower, np.select([np.isin(kind, (3, 4)), kind == 5], [high, low], np.inf)


def solution(random: Generator, lower: Vector, upper: Vector) -> tuple[Vector, Vector]:
    """z within the bounds, and w with the signs for it."""
    inside = np.clip(np.where(np.isfinite(lower), lower, 0) + random.integers(0, 2, lower.size), lower, upper)
    z = np.where(np.isfinite(lower) & (random.random(lower.size) < 0.5), lower, inside)
    low, high = np.where(z == upper, -1, 0), np.where(z == lower, 2, 1)
    return z, random.integers(low, high).astype(float)


def repeated(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    i, j = random.choice(lower.size, 2, replace=False)
    M[j] = M[i] * random.choice([-1, 1, 2])
    M[:, j] = M[:, i] * random.choice([-1, 1, 2])
    lower[[i, j]], upper[[i, j]] = -np.inf, np.inf


def single_in_row(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    i, j = random.integers(lower.size, size=2)
    M[i], M[i, j] = 0, random.choice([-1, 1, 2])
    if random.random() < 0.5:
        lower[i], upper[i] = -np.inf, np.inf


def single_in_column(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    i, j = random.integers(lower.size, size=2)
    M[:, j], M[i, j] = 0, random.choice([-1, 1, 2])
    lower[[i, j]], upper[[i, j]] = -np.inf, np.inf


def bound(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    """Rows that are bounds of one variable, each with its multiplier."""
    j, *rows = random.permutation(lower.size)[:3].tolist()
    for i in rows:
        M[i], M[:, i] = 0, 0
        M[i, j], M[j, i] = random.choice([-1, 1], 2)
        lower[i], upper[i] = (0, np.inf) if random.random() < 0.7 else (-np.inf, 0)


def pair(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    """An equation of two variables, with its multiplier."""
    i, j, k = random.permutation(max(lower.size, 3))[:3] % lower.size
    if i not in (j, k) and j != k:
        M[i], M[:, i] = 0, 0
        M[i, j], M[i, k] = M[j, i], M[k, i] = random.choice([-2, -1, 1, 2], 2)
        M[:, i] *= random.choice([-1, 1])
        lower[[i, j]], upper[[i, j]] = -np.inf, np.inf


def skew(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    """Skew-symmetric but for the signs and the order of equations."""
    M[:] = np.triu(M, 1) - np.triu(M, 1).T
    free = np.flatnonzero(np.isinf(lower) & np.isinf(upper))
    M[free] = M[random.permutation(free)] * random.choice([-1, 1], (free.size, 1))


def nothing(random: Generator, M: Vector, lower: Vector, upper: Vector) -> None:
    pass


PATTERNS = (repeated, single_in_row, single_in_column, bound, pair, skew, nothing)


def linear_program(seed: int, written: str, infeasible: bool = False) -> Problem:
    """Conditions of a linear program in x >= 0 with equations and inequalities, as models have them: a free variable
    for the objective, and rows x - l >= 0 with multipliers of their own.

    written : "plainly", with "signs" of equations, in "disorder", or with rows in other "units".
    """
    random = np.random.default_rng(seed)
    n, equations, inequalities = 30, 8, 10
    A = np.where(random.random((equations + inequalities, n)) < 0.2, random.integers(-5, 6, (18, n)), 0).astype(float)
    x = np.where(random.random(n) < 0.5, random.integers(1, 5, n), 0).astype(float)
    y = random.integers(-3, 4, 18).astype(float)
    y[equations:] = np.abs(y[equations:])
    c = A.T @ y + np.where(x == 0, random.integers(0, 4, n), 0)
    b = A @ x - np.append(np.zeros(equations), np.where(y[equations:] == 0, random.integers(0, 3, inequalities), 0))
    if infeasible:
        A[-1], b[-1] = -np.abs(A[-2]) - 1, 1  # no x >= 0 has A x >= b in that row
    s = np.append(random.choice([-1.0, 1.0], equations) if written != "plainly" else np.ones(equations), np.ones(10))
    zero = np.zeros((18 + n, 18 + n))
    top = np.hstack([np.zeros((n, n)), -A.T, -np.eye(n)])
    M = np.vstack([top, np.hstack([np.vstack([s[:, np.newaxis] * A, np.eye(n)]), zero])])
    q = np.concatenate([c, -s * b, np.zeros(n)])
    M = block_array([[M, None], [np.append(-c, np.zeros(18 + n))[np.newaxis], np.ones((1, 1))]]).toarray()
    lower = np.append(np.where(np.arange(q.size) - n < equations, -np.inf, 0), -np.inf)
    lower[:n] = 0
    q = np.append(q, 0.0)
    rows = np.arange(q.size)
    if written == "disorder":
        free = np.isinf(lower)
        rows[free] = random.permutation(rows[free])
    units = 10 ** random.uniform(-2, 2, q.size) if written == "units" else np.ones(q.size)
    order = random.permutation(q.size)
    M, q = units[:, np.newaxis] * M[rows], units * q[rows]
    return Problem(csr_array(M[order][:, order]), q[order], lower=lower[order], upper=np.inf)


def transportation(sources: int, sinks: int, supply: float, demand: float) -> Problem:
    """Conditions of a transportation problem with these amounts at each source and sink, with bounds as rows."""
    n = sources * sinks
    rows = np.vstack([-np.kron(np.eye(sources), np.ones(sinks)), np.kron(np.ones(sources), np.eye(sinks)), np.eye(n)])
    zero = np.zeros((n, n)), np.zeros((sources + sinks + n, sources + sinks + n))
    q = np.concatenate([np.arange(n) % 7 + 1, np.full(sources, supply), np.full(sinks, -demand), np.zeros(n)])
    lower = np.where(np.arange(q.size) < n, -np.inf, 0.0)
    return Problem(csr_array(np.block([[zero[0], -rows.T], [rows, zero[1]]])), q, lower=lower, upper=np.inf)
