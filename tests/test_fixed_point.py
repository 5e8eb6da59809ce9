"""The method `fixed-point` is Schäfer's iteration, contracts as theory says, and refuses where it is undefined."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from lcpcli import Limits, Problem, Status, linalg, read, run, shipped
from lcpcli.errors import OptionError
from lcpcli.methods.fixed_point import fixed_point

EXAMPLE_1 = read(shipped.path("paper-example-1.json"))


@pytest.mark.parametrize("omega", [0.5, 1.0, 4.0])
def test_iterates_satisfy_the_published_recursion(omega: float) -> None:
    M, q, identity = EXAMPLE_1.M, EXAMPLE_1.q, np.eye(4)
    x = np.full(4, 10.0)
    for _, iterate in zip(range(12), fixed_point(EXAMPLE_1, x, omega=omega), strict=False):
        assert np.allclose(iterate.x, x, rtol=1e-13, atol=1e-13)
        if iterate.F is not None:
            F = (omega * identity + M) @ x - (omega * identity - M) @ np.abs(x) + q
            assert np.allclose(iterate.F, F, atol=1e-12)
        x = np.linalg.solve(omega * identity + M, (omega * identity - M) @ np.abs(x) - q)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), omega=st.sampled_from([0.3, 1.0, 3.0]))
def test_distances_contract_by_the_spectral_factor(seed: int, omega: float) -> None:
    """|x_(k+1) - y_(k+1)| <= max |omega - lambda| / |omega + lambda| |x_k - y_k| for M positive definite."""
    generator = np.random.default_rng(seed)
    factor = generator.standard_normal((5, 5))
    M = factor @ factor.T + 0.1 * np.eye(5)
    problem = Problem(M, generator.standard_normal(5))
    eigenvalues = np.linalg.eigvalsh(M)
    rate = np.max(np.abs(omega - eigenvalues) / (omega + eigenvalues))

    def path() -> list[NDArray[np.float64]]:
        start = 10 * generator.standard_normal(5)
        return [iterate.x for _, iterate in zip(range(20), fixed_point(problem, start, omega=omega), strict=False)]

    distances = [float(np.linalg.norm(x - y)) for x, y in zip(path(), path(), strict=True)]
    for before, after in pairwise(distances):
        assert after <= rate * before + 1e-12


@pytest.mark.parametrize(
    "M",
    [
        [[0.0, 1.0], [1.0, 0.0]],
        [[-1.0]],
        (np.outer([1, 2, 3], [3, 1, 2]) / 11 - np.eye(3)).tolist(),
    ],
    ids=["exactly", "one unknown", "up to rounding"],
)
def test_singular_matrix_is_refused_by_name(M: list[list[float]]) -> None:
    result = run(Problem(M, -np.ones(len(M))), "fixed-point")
    assert result.status is Status.BREAKDOWN
    assert "I + M is singular" in result.message
    assert "--omega" in result.message


@pytest.mark.parametrize("sparse", [False, True])
def test_singular_matrix_is_refused_however_large(sparse: bool) -> None:
    n = linalg.SMALL + 1
    M = -np.eye(n)
    M[0, 0] = 1.0
    result = run(Problem(csr_array(M) if sparse else M, -np.ones(n)), "fixed-point")
    assert result.status is Status.BREAKDOWN
    assert "singular" in result.message


@pytest.mark.parametrize("M", [np.diag([1e-20, 1.0, 1e20]).tolist(), [[0.0, 1e20], [1.0, 2e20]]])
def test_badly_scaled_matrix_is_not_mistaken_for_a_singular_one(M: list[list[float]]) -> None:
    problem = Problem(M, [-1.0] * len(M))
    assert run(problem, "fixed-point", limits=Limits(max_iterations=3)).status is Status.ITERATION_LIMIT


@pytest.mark.parametrize("n", [linalg.SMALL, linalg.SMALL + 1])
def test_small_large_and_sparse_matrices_give_the_same_iterates(n: int) -> None:
    generator = np.random.default_rng(n)
    S = diags_array([-np.ones(n - 1), 4 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    q = generator.standard_normal(n)
    dense, sparse = run(Problem(S.toarray(), q), "fixed-point"), run(Problem(S, q), "fixed-point")
    assert dense.solved
    assert sparse.solved
    assert dense.iterations == sparse.iterations
    assert np.allclose(dense.z, sparse.z, rtol=0, atol=1e-13)


def test_solve_by_inverse_is_as_accurate_as_by_elimination() -> None:
    n = 12
    hilbert = 1 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    b = hilbert.sum(axis=1)
    shift = 1e-9
    x = linalg.factorizer(hilbert)(shift)(b)
    A = hilbert + shift * np.eye(n)
    residual = np.abs(b - A @ x).max()
    assert residual <= 4 * np.finfo(float).eps * np.abs(A).sum(axis=1).max() * np.abs(x).max() * n


def test_best_omega_beats_the_published_one_where_the_spectrum_is_not_around_one() -> None:
    M = np.diag([1.0, 10.0, 100.0])
    problem = Problem(M, -M @ np.array([1.0, 2.0, 3.0]))
    published, best = run(problem, "fixed-point"), run(problem, "fixed-point", omega=np.sqrt(1.0 * 100.0))
    assert published.solved
    assert best.solved
    assert 8 * best.iterations < published.iterations


def test_omega_must_be_positive() -> None:
    with pytest.raises(OptionError, match="--omega"):
        fixed_point(EXAMPLE_1, np.zeros(4), omega=0.0)
