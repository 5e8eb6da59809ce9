"""The problems of the benchmarks, by name and size, seeded."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse


def harker_pang(n: int, symmetric: bool, seed: int = 0) -> tuple[Any, Any]:
    """M = A'A + B + D with A and the skew B in (-5, 5), the diagonal D in (0, 0.3), q in (-500, 500).

    P. T. Harker and J.-S. Pang, A damped Newton method for the linear complementarity problem, in: Lectures in Applied
    Mathematics 26 (1990) 265-284; B = 0 in the symmetric variant.
    """
    random = np.random.default_rng([seed, n])
    A, B = random.uniform(-5, 5, (2, n, n))
    M = A.T @ A + np.diag(random.uniform(0, 0.3, n))
    if not symmetric:
        upper = np.triu(B, 1)
        M += upper - upper.T
    return M, random.uniform(-500, 500, n)


def obstacle(m: int) -> tuple[Any, Any]:
    """-Laplace u >= f, u >= 0 and complementarity on the unit square, five-point differences on an m x m grid."""
    h = 1 / (m + 1)
    T = tridiagonal_matrix(m, 2.0)
    x = np.linspace(h, 1 - h, m)
    X, Y = np.meshgrid(x, x)
    load = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    M = sparse.kron(T, sparse.eye_array(m)) + sparse.kron(sparse.eye_array(m), T)
    return sparse.csr_array(M), (-h * h * load).ravel()


def tridiagonal(n: int) -> tuple[Any, Any]:
    """M = tridiag(-1, 4, -1), q normally distributed."""
    return sparse.csr_array(tridiagonal_matrix(n, 4.0)), np.random.default_rng(n).standard_normal(n)


def dominant(n: int) -> tuple[Any, Any]:
    """Ten entries a row at random places, strictly diagonally dominant and not symmetric."""
    random = np.random.default_rng(n)
    rows, columns = np.repeat(np.arange(n), 9), random.integers(0, n, 9 * n)
    off = sparse.csr_array((random.standard_normal(9 * n), (rows, columns)), shape=(n, n))
    off = sparse.csr_array(off - sparse.diags_array(off.diagonal()))
    return sparse.csr_array(off + sparse.diags_array(1.1 * abs(off).sum(axis=1) + 0.1)), random.standard_normal(n)


def tridiagonal_matrix(n: int, diagonal: float) -> Any:
    return sparse.diags_array([-np.ones(n - 1), np.full(n, diagonal), -np.ones(n - 1)], offsets=[-1, 0, 1])
