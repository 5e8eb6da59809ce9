"""Small LCPs whose numbers are anywhere in double range."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.random import Generator

from lcpcli import Problem

from .. import exact

LARGEST = 4  # unknowns: what the oracle decides at once
SPECIAL = [0.0, 1.0, -1.0, 5e-324, -5e-324, 1e-310, 2.3e-308, -1e-300, 1e-150, 1e150, -1e150, 1e300, 1.7e308, -1.7e308]
SPREADS = (10, 40, 150, 300)  # decades on either side of 1


def data(seed: int) -> tuple[np.ndarray, np.ndarray, str]:
    """M of shape (n, n), q of shape (n,) and the kind of numbers in them."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, LARGEST + 1))
    kind = list(KINDS)[int(random.integers(len(KINDS)))]
    with np.errstate(all="ignore"):
        M, q = KINDS[kind](random, n)
    M, q = (np.clip(values, -1.7e308, 1.7e308) for values in (M, q))
    special = random.integers(12)
    if special == 0:
        q = np.abs(q)
    elif special == 1:
        q = np.zeros(q.size)
    elif special == 2:
        M = np.zeros((q.size, q.size))
    return M, q, kind


def _plain(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A problem of an ordinary kind."""
    problem = exact.random_problem(int(random.integers(2**31)), n)
    return problem.M, problem.q


def _units(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """An ordinary problem with rows and columns in units far apart."""
    M, q = _plain(random, n)
    powers = int(random.choice([30, 200, 500]))
    R, C = np.exp2(random.integers(-powers, powers + 1, (2, q.size)).astype(float))
    return R[:, np.newaxis] * M * C, R * q


def _sizes(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """An ordinary problem with M of one size and q of another."""
    M, q = _plain(random, n)
    powers = random.integers(-1000, 1000, 2).astype(float)
    return M * np.exp2(powers[0]), q * np.exp2(powers[1])


def _wide(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Every entry of a size of its own."""
    spread = int(random.choice(SPREADS))
    M, q = (random.standard_normal(shape) * 10.0 ** random.uniform(-spread, spread, shape) for shape in ((n, n), n))
    if random.integers(2):
        M[np.diag_indices(n)] = np.abs(M[np.diag_indices(n)])
    return M * (random.random((n, n)) < 0.8), q


def _special(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Zeros, ones, subnormals and the ends of double range."""
    return random.choice(SPECIAL, (n, n)), random.choice(SPECIAL, n)


def _ill_conditioned(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Positive definite with a condition number of up to 1e16 or so, or growing from index to index."""
    if random.integers(2):
        growth = 10.0 ** random.uniform(0, 12)
        return np.eye(n) - growth * np.tril(np.ones((n, n)), -1), -np.ones(n)
    Q = np.linalg.qr(random.standard_normal((n, n)))[0]
    M = (Q * 10.0 ** random.uniform(-16, 0, n)) @ Q.T
    return 0.5 * (M + M.T), random.standard_normal(n)


KINDS = {
    function.__name__.strip("_"): function for function in (_plain, _units, _sizes, _wide, _special, _ill_conditioned)
}


def is_solution_rounded(problem: Problem, z: np.ndarray) -> bool:
    """Whether z is an exact solution, each component of it to within a few units of the last digit."""
    M, q = exact._rational(problem)
    inside = np.flatnonzero(z > 0).tolist()
    z_P = exact._regular([[M[i][j] for j in inside] for i in inside], [-q[i] for i in inside])
    if z_P is None:
        return False
    right = dict(zip(inside, z_P, strict=True))
    near = all(abs(Fraction(z[i].item()) - value) <= abs(value) / 2**50 for i, value in right.items())
    return near and exact.solves(problem, [right.get(i, Fraction(0)) for i in range(z.size)])
