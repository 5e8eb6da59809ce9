"""Mixed problems of few unknowns by kernels: what they find is a solution by the measure of the rest of the package."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli import Problem
from lcpcli.linalg.units import UNITS_FAR_APART
from lcpcli.verify.point import Criterion, Point

from .. import kernels_together  # noqa: F401

pytest.importorskip("numba")

from lcpcli.basis.free_variables import NEAR_ONE, exponents
from lcpcli.kernels.compiled import rows_of
from lcpcli.kernels.compiled_mixed import mixed, own_exponents, surely_solves


def with_bounds_of_all_kinds(seed: int, n: int) -> Problem:
    """Return a problem with free, fixed, boxed and mirrored variables, far and narrow bounds, degenerate or not."""
    generator = np.random.default_rng(seed)
    A = generator.standard_normal((n, n))
    M = (A @ A.T / n + A - A.T, A, np.rint(A), np.diag(np.abs(A[0])))[seed % 4]
    lower, upper = np.zeros(n), np.full(n, np.inf)
    far = generator.standard_normal(n) * 10.0 ** generator.integers(-8, 8, n)
    beyond = far + 10.0 ** generator.integers(-9, 3, n)
    kinds = generator.integers(0, 7, n)
    for i, kind in enumerate(kinds):
        lowest = (0, -np.inf, -np.inf, -1, 1, far[i], far[i])
        lower[i], upper[i] = lowest[kind], (np.inf, np.inf, far[i], 1, 1, np.inf, beyond[i])[kind]
    z = np.clip(2 * generator.standard_normal(n), lower, upper)
    w = np.where(z == lower, 1.0, np.where(z == upper, -1.0, 0.0)) * (generator.random(n) < 0.7)
    q = w - M @ z if seed % 3 else np.rint(generator.standard_normal(n))
    R, C = 10.0 ** generator.uniform(-6, 6, (2, n)) if seed % 5 == 0 else np.ones((2, n))
    return Problem(R[:, np.newaxis] * M * C, R * q, lower=lower / C, upper=upper / C)


@settings(max_examples=200)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 40))
def test_an_answer_of_the_kernels_is_a_solution(seed: int, n: int) -> None:
    problem = with_bounds_of_all_kinds(seed, n)
    if not problem.is_mixed:
        return
    answer = mixed(problem, 1e-10)
    assert answer is None or Point(Criterion(problem), answer.z, is_admissible=False).solves()


def test_most_monotone_problems_are_answered_by_the_kernels() -> None:
    problems = [with_bounds_of_all_kinds(4 * seed, 24) for seed in range(1, 30)]
    assert sum(mixed(problem, 1e-10) is not None for problem in problems) >= 20


@settings(max_examples=200)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 12), size=st.integers(-16, 0))
def test_the_compiled_check_accepts_nothing_that_the_measure_refuses(seed: int, n: int, size: int) -> None:
    problem = with_bounds_of_all_kinds(seed, n)
    if not problem.is_mixed:
        return
    answer, generator = lcpcli.run(problem), np.random.default_rng(seed)
    z = problem.box.project(answer.z * (1 + 10.0**size * generator.standard_normal(n)))
    if surely_solves(*rows_of(problem), problem.q, problem.lower, problem.upper, 1e-10, z):
        assert Point(Criterion(problem), z).solves()


def test_sparse_and_dense_matrices_have_the_same_results() -> None:
    sparse = pytest.importorskip("scipy.sparse")
    problems = [with_bounds_of_all_kinds(4 * seed, 24) for seed in range(1, 12)]
    for problem in [problem for problem in problems if mixed(problem, 1e-10) is not None]:
        results = [
            lcpcli.solve(M, problem.q, lower=problem.lower, upper=problem.upper, compiled=True)
            for M in (problem.M, sparse.csr_array(problem.M), sparse.coo_matrix(problem.M))
        ]
        assert len({(result.status, result.route, result.z.tobytes()) for result in results}) == 1


@settings(max_examples=100)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 30), far=st.sampled_from([1, 8, 40]))
def test_the_compiled_units_are_those_of_numpy(seed: int, n: int, far: int) -> None:
    """Rows and columns of zeros, and units that are near, apart, or too far apart for the kernel."""
    generator = np.random.default_rng(seed)
    A = generator.standard_normal((n, n)) * (generator.random((n, n)) < generator.choice([0.1, 0.4, 1.0]))
    A *= np.exp2(far * generator.standard_normal((n, 1))) * np.exp2(far * generator.standard_normal(n))
    powers, sizes = own_exponents(A), np.abs(A)
    assert np.array_equal(powers, exponents(A))
    largest = np.append(sizes.max(axis=0), sizes.max(axis=1))
    largest = largest[largest > 0.0]
    if not largest.size or (largest.max() <= NEAR_ONE and largest.min() >= 1 / NEAR_ONE):
        assert powers.size == 2 * n
        assert not powers.any()
    elif not powers.size:
        assert np.log2(largest.max()) - np.log2(largest.min()) > UNITS_FAR_APART


@pytest.mark.parametrize("seed", range(8))
def test_the_kernels_take_the_steps_of_the_program_where_variables_are_fixed(seed: int) -> None:
    random = np.random.default_rng(seed)
    A, B = random.normal(size=(2, 14, 14))
    lower = np.where(random.random(14) < 0.3, -1.0, 0.0)
    upper = np.where(random.random(14) < 0.4, lower, np.where(random.random(14) < 0.3, 1.0, np.inf))
    problem = Problem(A @ A.T + B - B.T + np.eye(14), 3 * random.normal(size=14), lower=lower, upper=upper)
    kernels, plain = (lcpcli.run(problem, compiled=compiled) for compiled in (True, False))
    assert (kernels.route, kernels.iterations) == (plain.route, plain.iterations)
    np.testing.assert_allclose(kernels.z, plain.z, rtol=1e-9, atol=1e-12)
