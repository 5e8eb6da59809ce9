"""The compiled judgement of points of sparse problems, beside the measure that it stands for."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli import Problem, run
from lcpcli.gallery import families
from lcpcli.verify.point import Criterion, Point

from .. import kernels_together  # noqa: F401

compiled = pytest.importorskip("lcpcli.kernels.compiled")


def planted(seed: int) -> tuple[Problem, np.ndarray]:
    """A sparse problem, symmetric in every third case and a program in another, in units far apart, and a solution."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 30))
    M = random.standard_normal((n, n)) * (random.random((n, n)) < random.choice([0.1, 0.3, 0.6]))
    lower, upper = np.where(random.random(n) < 0.3, -np.inf, 0.0), np.where(random.random(n) < 0.3, 5.0, np.inf)
    if seed % 2:
        lower, upper = lower + 1e3, upper + 1e3
    z = np.clip(np.where(random.random(n) < 0.5, 1.5, -9.0) + 1e3 * (seed % 2), lower, upper)
    w = np.where(z == lower, 1.0, np.where(z == upper, -1.0, 0.0)) * random.random(n)
    if seed % 3 == 0:
        M = M @ M.T
    R, C = 10.0 ** random.integers(-4, 5, (2, n)) if seed % 5 == 0 else np.ones((2, n))
    M = R[:, np.newaxis] * M * C
    low, high, z = (value / C for value in (lower, upper, z))
    problem = Problem(csr_array(M), R * w - M @ z, lower=low, upper=high)
    return problem, np.clip(z, low, high)


@given(st.integers(0, 10**6), st.sampled_from([0.0, 1e-16, 1e-13, 1e-10, 1e-7, 1e-3]))
def test_what_is_beyond_doubt_meets_the_criterion_and_most_solutions_are(seed: int, error: float) -> None:
    problem, z = planted(seed)
    random = np.random.default_rng(seed)
    z = problem.box.project(z * (1 + error * random.standard_normal(z.size)))
    point, judged = Point(Criterion(problem), z), Point(Criterion(problem, judge=compiled.judged_by_entries), z)
    if problem.is_moderate:
        surely, rows = compiled.judged_by_entries(problem, z, 1e-10)
        assert surely in (None, point.solves())
        if rows is not None:
            usual = point.criterion.measure.rows(z)
            assert np.all(np.abs(rows.w - usual.w) <= rows.error + usual.error)
            assert all(map(partial(np.allclose, atol=0), rows[1:3], usual[1:3]))
            assert np.all(rows.error >= (1 - 1e-12) * usual.error)
    assert judged.solves() == point.solves()


@pytest.mark.parametrize("family", ["qp", "lp", "transport"])
def test_solutions_of_programs_are_beyond_doubt_and_points_beside_them_are_not(family: str) -> None:
    for seed in range(3):
        problem = families.make(family, 60, seed)
        z = run(problem).z
        sparse = Problem(csr_array(problem.M), problem.q, lower=problem.lower, upper=problem.upper)
        assert compiled.solves(sparse, z, 1e-10)
        moved = problem.box.project(z + 1e-6 * np.sin(np.arange(z.size)))
        assert not compiled.solves(sparse, moved, 1e-10)


def test_stored_zeros_tie_no_components_together() -> None:
    """x1 - x2 = 0 and x1 - x2 = 1 are nearly satisfied beside x near 1e12, which is small only in the last row."""
    M = np.zeros((5, 5))
    M[:2, 2:4], M[2:4, :2], M[4, 4] = [[-1, -1], [1, 1]], [[1, -1], [1, -1]], 1.0
    z, free = np.array([1e12 + 0.5, 1e12, 0, 0, 1e12]), np.array([False, False, True, True, False])
    full = csr_array(np.where(M == 0, 7.0, M))
    full.data[full.data == 7.0] = 0.0
    for stored in (csr_array(M), full):
        problem = Problem(stored, [0, 0, 0, -1, -1e12], lower=np.where(free, -np.inf, 0.0))
        assert not compiled.solves(problem, z, 1e-10)
        assert compiled.solves(Problem(stored, [0, 0, 0, 0, -1e12], lower=problem.lower), z * [0, 0, 0, 0, 1], 1e-10)
