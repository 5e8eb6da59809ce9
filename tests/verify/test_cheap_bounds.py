"""Bounds that decide before the measure is computed never accept what the measure rejects, and mostly decide."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from lcpcli import Problem, run
from lcpcli.verify import cheap_bounds
from lcpcli.verify.point import Criterion, Point

TOL = 1e-10
N = 110


def random_problem(random: np.random.Generator) -> Problem:
    """A problem with a P-matrix in any units, with and without entries 0 in M, and with entries of q that are small or
    0."""
    A = random.standard_normal((N, N))
    M = A @ A.T / N + 0.1 * np.eye(N) + (A - A.T) / 4
    if random.random() < 0.3:
        M[np.abs(M) < 0.05] = 0.0
        M += np.eye(N)
    q = random.standard_normal(N)
    q[random.random(N) < 0.05] *= random.choice([0.0, 1e-12, 1e-6])
    R, C = np.exp2(random.integers(-1, 2, (2, N)) * random.choice([0, 0, 3, 40], (2, 1)))
    return Problem(R[:, None] * M * C, R * q)


def test_what_the_bounds_accept_passes_the_measure() -> None:
    accepted = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        problem = random_problem(random)
        assert cheap_bounds.apply_to(problem)
        z = run(problem, "newton").z
        for size in (0.0, 1e-16, 1e-12, 1e-11, 1e-10, 1e-9, 1e-6):
            moved = z * (1 + size * random.standard_normal(N))
            if cheap_bounds.surely_solve(problem, moved, problem.w(moved), TOL):
                assert Point(Criterion(problem), moved).relative_residual <= TOL
                accepted.append(size)
    assert accepted.count(0.0) >= 5
    assert accepted.count(1e-12) >= 3
    assert 1e-6 not in accepted


def test_a_point_that_runs_off_is_not_accepted() -> None:
    """No z has w >= 0 in the first two rows, but their terms grow with z, so that any residual is small beside them."""
    M = np.random.default_rng(0).uniform(1, 2, (N, N))
    M[0], q = -M[1], np.full(N, -1.0)
    z = np.r_[np.zeros(2), 1e16, M[1, 2] * 1e16 / M[1, 3], np.zeros(N - 4)]
    problem = Problem(M, q)
    assert not cheap_bounds.surely_solve(problem, z, problem.w(z), TOL)
    assert not Point(Criterion(problem), z).solves()


def test_sparse_and_small_problems_are_left_to_the_measure() -> None:
    left = (Problem(np.eye(5), np.ones(5)), Problem(csr_array(np.eye(200)), np.ones(200)))
    far = Problem(np.eye(200), np.ones(200), lower=1.0)
    assert not any(Criterion(problem).is_bounded_cheaply for problem in (*left, far))
    assert Criterion(Problem(np.eye(200), np.ones(200))).is_bounded_cheaply
