"""Obstacle problems, and others with sparse M-matrices, for benchmarks: M and q of a
given size."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import csr_array, eye_array, kron

from lcpcli.gallery import families as gallery
from lcpcli.gallery.systems import three_diagonals
from lcpcli.typing import Matrix, Vector

Data = tuple[Matrix, Vector]
Field = Callable[[Vector, Vector], Vector]


def membrane(m: int, obstacle: Field, load: Field | float, across: float = 1.0) -> Data:
    """-u_yy - across u_xx >= load, u >= obstacle on the unit square with m x m points,
    u = 0 on its boundary; z is the height above the obstacle, and the rows of M are
    divided by its diagonal."""
    h = 1 / (m + 1)
    X, Y = np.meshgrid(*2 * [h * np.arange(1, m + 1)])
    T, unit = three_diagonals(np.full(m, 2.0)), eye_array(m)
    M = csr_array(kron(T, unit) + across * kron(unit, T)) / (2 * (1 + across))
    force = load(X, Y) if callable(load) else np.full((m, m), load)
    return M, M @ obstacle(X, Y).ravel() - h * h / (2 * (1 + across)) * force.ravel()


def cap(X: Vector, Y: Vector) -> Vector:
    return 0.3 - 3 * ((X - 0.5) ** 2 + (Y - 0.5) ** 2)


def bumps(X: Vector, Y: Vector) -> Vector:
    tops = (0.25, 0.3), (0.7, 0.25), (0.5, 0.7), (0.8, 0.8)
    return np.max([0.3 - 20 * ((X - a) ** 2 + (Y - b) ** 2) for a, b in tops], axis=0)


def hills(X: Vector, Y: Vector) -> Vector:
    """A random sum of smooth waves."""
    heights = np.random.default_rng(1).standard_normal((6, 6))
    waves = [
        heights[i - 1, j - 1]
        / (i * i + j * j) ** 0.75
        * np.sin(np.pi * i * X)
        * np.sin(np.pi * j * Y)
        for i in range(1, 7)
        for j in range(1, 7)
    ]
    return 0.5 * np.sum(waves, axis=0) - 0.1


def chessboard(X: Vector, Y: Vector) -> Vector:
    return np.where((np.floor(4 * X) + np.floor(4 * Y)) % 2 == 0, 30.0, -40.0)


def of_gallery(family: str, n: int) -> Data:
    problem = gallery.make(family, n)
    return problem.M, problem.q


MEMBRANES: dict[str, Callable[[int], Data]] = {
    "cap": partial(membrane, obstacle=cap, load=-1.0),
    "gallery": lambda m: of_gallery("obstacle", m * m),
    "bumps": partial(membrane, obstacle=bumps, load=-1.0),
    "pyramid": partial(
        membrane,
        obstacle=lambda X, Y: 0.4 - 1.5 * np.maximum(abs(X - 0.5), abs(Y - 0.5)),
        load=0.0,
    ),
    "ring": partial(
        membrane,
        obstacle=lambda X, Y: 0.2 - 10 * (np.hypot(X - 0.5, Y - 0.5) - 0.25) ** 2,
        load=-2.0,
    ),
    "hills": partial(membrane, obstacle=hills, load=-1.0),
    "nearly full contact": partial(
        membrane, obstacle=lambda X, Y: -0.1 - 0.2 * X * Y, load=-50.0
    ),
    "nearly no contact": partial(
        membrane, obstacle=lambda X, _: np.full_like(X, -0.07), load=-1.0
    ),
    "discontinuous load": partial(
        membrane, obstacle=lambda X, _: np.zeros_like(X), load=chessboard
    ),
    "bumps, anisotropic 10": partial(membrane, obstacle=bumps, load=-1.0, across=0.1),
    "cap, anisotropic 100": partial(membrane, obstacle=cap, load=-1.0, across=0.01),
}


OTHERS = {
    f"{family}, n = {n}": partial(of_gallery, family, n)
    for family, n in (
        ("tridiagonal", 10**6),
        ("dominant", 10**5),
        ("american-put", 1000),
        ("american-put", 10**5),
        ("journal-bearing", 400),
        ("journal-bearing", 10**4),
    )
}
