"""Random problems that several populations share."""

import subprocess
import sys
from tempfile import TemporaryDirectory

import numpy as np
from record import exact

from lcpcli import Problem, read

RANDOM_FAMILIES = (
    "harker-pang",
    "ill-scaled",
    "tridiagonal",
    "dominant",
    "contact",
    "rigid-boxes",
    "bimatrix",
    "poker",
    "relays",
    "spatial-prices",
    "boxes",
    "lp",
    "qp",
    "portfolio",
    "frontier",
    "lasso",
    "control",
    "transport",
    "near-singular",
    "degenerate",
    "near-degenerate",
    "infeasible",
    "unsolvable",
    "planted",
    "gaussian",
    "indefinite",
    "ray",
)
FIXED_FAMILIES = (  # without random numbers
    "obstacle",
    "two-obstacles",
    "torsion",
    "journal-bearing",
    "american-put",
    "bargaining",
    "circuit",
    "murty",
    "all-cones",
    "fathi",
    "ben-gharbia-gilbert",
    "kostreva",
    "growth",
    "hilbert",
    "diagonal",
)
FAMILIES = RANDOM_FAMILIES + FIXED_FAMILIES
# Steps of the numbers in 1, so that products with small integers are not rounded.
GRID = 4096


def in_uneven_units(problem, random, decades, base):
    """Return the problem with rows and columns in units of up to 10^+-decades/2, of
    powers of two (then it is exactly as solvable) or of ten, which are rounded."""
    steps = decades / 2 if base == 10 else decades * 1.66
    R, C = (
        float(base) ** np.rint(random.uniform(-steps, steps, size=problem.n))
        for _ in range(2)
    )
    bounds = {"lower": problem.lower / C, "upper": problem.upper / C}
    return Problem(R[:, None] * problem.M * C, R * problem.q, **bounds)


def bounds_of_all_kinds(random, n):
    """Return bounds of which any may be missing or equal."""
    lower = random.integers(-3, 3, size=n).astype(float)
    upper = lower + random.integers(0, 4, size=n)
    return np.where(random.random(n) < 0.3, -np.inf, lower), np.where(
        random.random(n) < 0.4, np.inf, upper
    )


def mixed(random, n, kind):
    """Return a problem of a class of matrices with bounds of all kinds."""
    M = np.rint(GRID * exact.CLASSES[kind](random, n)) / GRID
    lower, upper = bounds_of_all_kinds(random, n)
    return Problem(
        M, np.rint(GRID * 2 * random.normal(size=n)) / GRID, lower=lower, upper=upper
    )


def program(random, k, m, is_linear):
    """Return the conditions of: minimize x'Px / 2 + c'x subject to Ax >= b, or = b, and
    x >= 0; often with a solution and degenerate, sometimes infeasible or unbounded."""
    A = random.integers(-3, 4, size=(m, k)).astype(float)
    G = random.integers(-2, 3, size=(k, k)).astype(float)
    P = np.zeros((k, k)) if is_linear else G @ G.T
    x, y = random.integers(0, 3, size=k), random.integers(0, 3, size=m)
    equal = random.random(m) < 0.3
    slack = np.where(equal, 0, (y == 0) * random.integers(0, 3, size=m))
    c, b = A.T @ y - P @ x + (x == 0) * random.integers(0, 3, size=k), A @ x - slack
    if random.random() < 0.3:  # anything may come of it
        b += random.integers(-2, 3, size=m)
        c += random.integers(-2, 3, size=k)
    M = np.block([[P, -A.T], [A, np.zeros((m, m))]])
    return Problem(
        M,
        np.concatenate([c, -b]),
        lower=np.where(np.r_[np.zeros(k, bool), equal], -np.inf, 0.0),
    )


def opposed_rows(random, room):
    """Return the conditions of a linear program with a row a'x >= b and the opposed one
    a'x <= b + room, or with the room in a coefficient, and costs of any size."""
    k = int(random.integers(1, 4))
    a = random.integers(1, 4, size=k) * random.choice([-1.0, 1.0], size=k)
    A, b = np.array([a, -a]), random.integers(1, 5) * np.array([1.0, -1.0])
    if random.random() < 0.5:
        b[1] -= room
    else:
        A[1, 0] += abs(a[0]) * room
    c = random.integers(0, 4, size=k) * 10.0 ** random.integers(0, 17, size=k)
    M = np.block([[np.zeros((k, k)), -A.T], [A, np.zeros((2, 2))]])
    return Problem(M, np.concatenate([c, -b]))


def planted(random, n, kind):
    """Return a problem of a class of matrices, with or without bounds, that has a
    solution in small integers, in units of powers of two."""
    M = np.rint(16 * exact.CLASSES[kind](random, n)) / 16
    lower, upper = (
        bounds_of_all_kinds(random, n)
        if random.random() < 0.5
        else (np.zeros(n), np.full(n, np.inf))
    )
    z = np.clip(random.integers(0, 4, size=n) * (random.random(n) < 0.5), lower, upper)
    w = random.integers(0, 4, size=n).astype(float)
    free = random.integers(-3, 4, size=n)
    w = np.where(
        lower == upper, free, np.where(z == lower, w, np.where(z == upper, -w, 0.0))
    )
    R, C = (
        np.exp2(random.integers(-26, 27, size=n) * (random.random() < 0.5))
        for _ in range(2)
    )
    return Problem(
        R[:, None] * M * C,
        R * (w - M @ z),
        lower=lower / C,
        upper=upper / C,
        solutions=[z / C],
    )


def gallery(family, n, seed):
    """Return a problem of the gallery."""
    with TemporaryDirectory() as folder:
        file = f"{folder}/problem.npz"
        make(file, family, n, *["--seed", seed] * (family in RANDOM_FAMILIES))
        return read(file)


def make(file, family, n, *words):
    """Write a problem of the gallery, by the command `lcp make`, which stays where it
    is when modules move."""
    command = ["-m", "lcpcli", "make", family, "-n", n, "-o", file, *words]
    words = [sys.executable, *map(str, command)]
    subprocess.run(words, check=True, capture_output=True)
