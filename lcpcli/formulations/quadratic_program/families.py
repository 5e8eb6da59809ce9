"""Linear and quadratic programs with random data, by their optimality conditions."""

from __future__ import annotations

import math

import numpy as np

from lcpcli.formulations.quadratic_program import reductions
from lcpcli.gallery.random_problems import complementary, integer_matrix
from lcpcli.model import block_form
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

# Random numbers of frontier and lasso are multiples of 1/16, so that their products are
# exact in double precision.
UNITS = 16
# Seconds between the inputs of control; the periods of the springs exceed pi.
STEP = 0.25


def lp(n: int, seed: int) -> Problem:
    """Pose min c'x, Ax >= b, x >= 0 with its dual: M = [0 -A'; A 0], q = (c, -b), z =
    (x, y). n is at least 2.

    There are n // 2 constraints of integers, up to ten entries per row; M is sparse
    above n = 200. The known vertex is strictly complementary, so the solution is
    unique, and exact. The data are original to lcp.
    G. B. Dantzig, R. W. Cottle, in: Nonlinear Programming, North-Holland (1967) 55-73.
    """
    return _program(
        "lp",
        n,
        seed,
        note="The diagonal of M is zero; x solves the program and y its dual.",
    )


def qp(n: int, seed: int) -> Problem:
    """Pose min x'Qx / 2 + c'x, Ax >= b, x >= 0: M = [Q -A'; A 0], q = (c, -b), z = (x,
    y). n is at least 2.

    There are n // 2 constraints; the data are integers, Q is positive definite, and M
    is dense. The known solution is strictly complementary with independent active
    constraints, hence unique, and exact.
    R. W. Cottle, G. B. Dantzig, Linear Algebra Appl. 1 (1968) 103-125. The random data
    are original to lcp.
    """
    return _program(
        "qp",
        n,
        seed,
        note="x solves the program, and y holds the multipliers of its constraints.",
    )


def _program(kind: str, n: int, seed: int, note: str) -> Problem:
    """Return the problem for integers x and y with (m + 1) // 2 positive entries each,
    and an A whose leading square is diagonally dominant."""
    from scipy.sparse import csr_array

    n = max(2, n)
    random = np.random.default_rng([seed, n])
    m, k = n // 2, n - n // 2
    count = min(10, k) - 1
    rows, columns = np.repeat(np.arange(m), count), random.integers(0, k, m * count)
    values = random.integers(-2, 3, m * count).astype(np.float64)
    sums = np.bincount(rows, abs(values), m) + 1
    corner = np.arange(m)
    A = csr_array(
        (
            np.concatenate((values, sums)),
            (np.concatenate((rows, corner)), np.concatenate((columns, corner))),
        )
    )
    A.resize(m, k)
    Q = None if kind == "lp" else integer_matrix(random, k)
    (x, r), (y, s) = (
        complementary(
            random.integers(1, 10, length).astype(np.float64),
            np.arange(length) < (m + 1) // 2,
        )
        for length in (k, m)
    )
    c = A.T @ y + r if Q is None else A.T @ y + r - Q @ x
    M = block_form.bordered(Q, A, sparse=kind == "lp" and n > 200)
    q, z = np.concatenate((c, s - A @ x)), np.concatenate((x, y))
    return Problem(M, q, solutions=[z], note=note)


def portfolio(n: int, seed: int, *, most: float = 0.2) -> Problem:
    """Minimize x'Dx + y'y subject to y = F'x, shares x of k assets that add up to 1, 0
    <= x <= most, and an expected return from 3 % to 12 %; about n unknowns with the
    multipliers of rows. D and F, of k // 10 + 1 factors, are random.
    H. Markowitz, J. Finance 7 (1952) 77-91; factors as in B. Stellato et al., Math.
    Program. Comput. 12 (2020) 637-672.

    most : the largest share, at least 2 / k.
    """
    from scipy.sparse import csr_array, diags_array, random_array, vstack

    k = max(3, round((n - 5) / 1.2))
    factors, random = k // 10 + 1, np.random.default_rng([seed, k])
    F = random_array(
        (k, factors), density=0.5, rng=random, data_sampler=random.standard_normal
    )
    risk = random.uniform(0.0, np.sqrt(factors), k)
    returns = random.integers(0, 16, k) / 100
    returns[:2] = 0.03, 0.12  # so that there is a portfolio with any return between
    none, share = np.zeros(factors), max(most, 2.0 / k)
    sums = np.stack(
        [np.concatenate((np.ones(k), none)), np.concatenate((returns, none))]
    )
    return reductions.from_qp(
        2.0 * diags_array(np.concatenate((risk, np.ones(factors)))),
        np.zeros(k + factors),
        vstack(
            [csr_array(sums), csr_array(np.block([[F.T.toarray(), -np.eye(factors)]]))]
        ),
        row_lower=np.concatenate(([1.0, 0.03], none)),
        row_upper=np.concatenate(([1.0, 0.12], none)),
        lower=np.concatenate((np.zeros(k), none - np.inf)),
        upper=np.concatenate((np.full(k, share), none + np.inf)),
        note=f"{k} assets, {factors} factors, at most {share:g} in one asset.",
    )


def frontier(
    n: int, seed: int, *, target: float = 0.0, weight: float = 0.0, most: float = 0.2
) -> Problem:
    """Minimize x'Sx / 2 - weight r'x for shares x of n - 2 assets that add up to 1,
    with 0 <= x <= most and a return r'x of at least `target`. n is at least 4.

    M = [S -A'; A 0], with A = (e, r)', and the bounds are the same for all targets and
    weights. S = D + FF' is exact, with one random factor for 50 assets; the returns are
    random, from 2 % to 12 %.
    H. Markowitz, Naval Res. Logist. Quart. 3 (1956) 111-133; Portfolio Selection, Wiley
    (1959).

    target : 0 where the row is not active. most : the largest share, at least 2 / (n -
        2).
    """
    k = max(2, n - 2)
    random = np.random.default_rng([seed, k])
    F = np.rint(UNITS * random.standard_normal((k, k // 50 + 1))) / (8 * UNITS)
    S = np.diag(random.integers(4, 33, k) / 512) + F @ F.T
    returns = random.integers(20_000, 120_001, k) / 1e6
    return reductions.from_qp(
        S,
        -weight * returns,
        np.stack((np.ones(k), returns)),
        row_lower=[1.0, target],
        row_upper=[1.0, np.inf],
        upper=np.full(k, max(most, 2.0 / k)),
        rows=("budget", "return"),
        columns=[f"asset{i}" for i in range(1, k + 1)],
        note=(
            f"{k} assets; a path from one target, or weight, to another one is a "
            "part of the efficient frontier."
        ),
    )


def lasso(n: int, seed: int, *, penalty: float = 1.0, samples: int = 20) -> Problem:
    """Minimize |y - X b|^2 / 2 + lambda (|b_1| + ... + |b_k|) for k = n / 2 features,
    where b = b+ - b-.

    M = [G -G; -G G] with G = X'X, and q = (lambda e - X'y, lambda e + X'y), z = (b+,
    b-). X is normal in multiples of 1/16, and y sums up a tenth of the features, with
    whole coefficients, and noise, so that M and X'y are exact.
    R. Tibshirani, J. R. Stat. Soc. B 58 (1996) 267-288; the path by M. R. Osborne, B.
    Presnell, B. A. Turlach, IMA J. Numer. Anal. 20 (2000) 389-403.

    penalty : lambda as a fraction of the largest |X'y|, which moves q alone; from 1 on
        b = 0. samples : of y.
    """
    k = max(1, round(n / 2))
    X, y = regression(k, seed, samples)
    G, c = X.T @ X, X.T @ y
    return reductions.from_qp(
        np.block([[G, -G], [-G, G]]),
        penalty * abs(c).max() + np.concatenate((-c, c)),
        columns=[f"b{i}{sign}" for sign in "+-" for i in range(1, k + 1)],
        constant=float(y @ y) / 2,
        note=(
            f"{samples} samples of {k} features. b is the first half of x minus the "
            "second half."
        ),
    )


def regression(k: int, seed: int, samples: int) -> tuple[Vector, Vector]:
    random = np.random.default_rng([seed, k, samples])
    X = np.rint(UNITS * random.standard_normal((samples, k))) / UNITS
    noise = np.rint(UNITS * random.standard_normal(samples)) / UNITS
    return X, X @ np.where(
        np.arange(k) < max(1, k // 10), random.integers(1, 4, k), 0
    ) + noise


def control(n: int, seed: int, *, masses: int = 4, strength: float = 0.5) -> Problem:
    """Bring a chain of masses and springs to rest, over as many steps as give about n
    unknowns with multipliers.

    x has the states, which are positions and velocities, and the inputs, which are
    forces of at most `strength`, of one step after another, by the symplectic Euler
    method. The objective is half the sum of the squares of the states and of 0.1 times
    those of the inputs. The start is random.
    F. Borrelli, A. Bemporad, M. Morari, Predictive Control for Linear and Hybrid
    Systems (2017), chapter 11.
    """
    from scipy.sparse import (
        block_array,
        csr_array,
        diags_array,
        eye_array,
        hstack,
        kron,
    )

    steps, size = max(1, round(n / (5 * masses))), 2 * masses
    random = np.random.default_rng([seed, steps, masses])
    start = np.concatenate((random.uniform(-2.0, 2.0, masses), np.zeros(masses)))
    springs = diags_array(
        [np.ones(masses - 1), np.full(masses, -2.0), np.ones(masses - 1)],
        offsets=[-1, 0, 1],
    )
    one = eye_array(masses)
    # The change of a state in one step, without and by a force.
    drift = block_array([[one + STEP**2 * springs, STEP * one], [STEP * springs, one]])
    push = block_array([[STEP**2 * one], [STEP * one]])
    now = eye_array(steps)
    before = diags_array([np.ones(steps - 1)], offsets=[-1], shape=(steps, steps))
    state = kron(now, hstack([eye_array(size), -push])) - kron(
        before, hstack([drift, csr_array((size, masses))])
    )
    first = np.zeros(steps * size)
    first[:size] = drift @ start
    bound = np.tile(
        np.concatenate((np.full(size, np.inf), np.full(masses, strength))), steps
    )
    weights = np.tile(np.concatenate((np.ones(size), np.full(masses, 0.1))), steps)
    return reductions.from_qp(
        diags_array(weights),
        np.zeros(weights.size),
        state,
        row_lower=first,
        row_upper=first,
        lower=-bound,
        upper=bound,
        note=f"{masses} masses, {steps} steps of {STEP} s, forces up to {strength:g}.",
    )


def transport(n: int, seed: int) -> Problem:
    """Pose the linear program of m plants and m markets, with m^2 flows and 2 m
    multipliers, about n unknowns.

    The supplies, integers from 10 to 20, are enough for the demands from 5 to 10,
    each at a cost from 1 to 100.
    F. L. Hitchcock, J. Math. Phys. 20 (1941) 224-230. The numbers are random.
    """
    from scipy.sparse import eye_array, kron, vstack

    m = max(1, round(math.sqrt(n + 1) - 1))
    random = np.random.default_rng([seed, m])
    supply = random.integers(10, 21, m).astype(float)
    demand = random.integers(5, 11, m).astype(float)
    costs = random.integers(1, 101, m * m).astype(float)
    one = eye_array(m)
    ones = np.ones((1, m))
    none = np.full(m, np.inf)
    return reductions.from_qp(
        None,
        costs,
        vstack((kron(one, ones), kron(ones, one))),
        row_lower=np.concatenate((-none, demand)),
        row_upper=np.concatenate((supply, none)),
        note=f"{m} plants, {m} markets.",
    )
