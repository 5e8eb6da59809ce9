"""Random nonlinear problems with a known solution, monotone and not, with bounds of all
kinds and with domains."""

from collections.abc import Callable

import numpy as np

from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.typing import Vector

KINDS = ("monotone", "log", "root", "nonmonotone", "bilinear")
MONOTONE = KINDS[:3]
Terms = tuple[Callable[[Vector], Vector], Callable[[Vector], Vector]]


def planted(kind, seed):
    """F(z) = M z + N(z) + c, with c for a solution with components at and between
    bounds."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 31))
    lower = np.where(random.random(n) < 0.7, random.normal(size=n).round(1), -np.inf)
    width = 2 * random.exponential(size=n) + 0.1
    upper = np.where(
        random.random(n) < 0.4, np.where(np.isfinite(lower), lower, 0.0) + width, np.inf
    )
    if kind in ("log", "root"):
        lower = np.maximum(lower, 0.05)
        upper = np.maximum(upper, lower + 0.5)
    z, w = solution(lower, upper, random)
    A, B = random.normal(size=(2, n, n)) / n**0.5
    M = (
        A @ A.T + A - A.T + 0.1 * np.eye(n)
        if kind in MONOTONE
        else A + random.choice([0.0, 0.5, 1.0]) * np.eye(n)
    )
    N, slopes = terms(kind, B)
    c = w - M @ z - N(z)
    start = z + 3 * random.normal(size=n)
    if kind in ("log", "root"):
        start = lower + random.exponential(size=n)
    J = (lambda z: M + slopes(z)) if seed % 2 else None
    name = f"{kind} {seed}"
    return NonlinearProblem(
        lambda z: M @ z + N(z) + c,
        J,
        lower=lower,
        upper=upper,
        x0=start,
        name=name,
        solutions=[z],
    )


def solution(lower, upper, random):
    z, w = np.zeros((2, lower.size))
    for i, (low, high) in enumerate(zip(lower, upper, strict=True)):
        where = random.random()
        if where < 0.3 and np.isfinite(low):
            z[i], w[i] = low, random.exponential()
        elif where < 0.5 and np.isfinite(high):
            z[i], w[i] = high, -random.exponential()
        else:
            below = low if np.isfinite(low) else high - 3 if np.isfinite(high) else -2.0
            z[i] = random.uniform(below, high if np.isfinite(high) else below + 4)
    return z, w


def terms(kind, B):
    found = {
        "monotone": (
            lambda z: z**3 + np.exp(z / 2),
            lambda z: np.diag(3 * z**2 + np.exp(z / 2) / 2),
        ),
        "log": (lambda z: 2 * np.log(z), lambda z: np.diag(2 / z)),
        "root": (
            lambda z: 3 * np.sqrt(z - 0.02),
            lambda z: np.diag(1.5 / np.sqrt(z - 0.02)),
        ),
        "nonmonotone": (
            lambda z: 2 * np.sin(B @ z) + 0.3 * z**3,
            lambda z: 2 * np.cos(B @ z)[:, np.newaxis] * B + np.diag(0.9 * z**2),
        ),
        "bilinear": (
            lambda z: (B @ z) * z / 2,
            lambda z: (np.diag(B @ z) + z[:, np.newaxis] * B) / 2,
        ),
    }
    return found[kind]


def natural_residual(problem, z):
    with np.errstate(all="ignore"):
        F = np.asarray(problem.F(z), dtype=float)
        return float(
            np.abs(
                z - np.minimum(np.maximum(z - F, problem.lower), problem.upper)
            ).max()
        )
