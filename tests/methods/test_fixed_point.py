"""The method `fixed-point` is Schäfer's iteration, contracts as theory says, and refuses where it is undefined."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from lcpcli import Problem, Status, read
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.linalg import factors
from lcpcli.methods.fixed_point import best_omega, fixed_point
from lcpcli.options import Limits
from lcpcli.solving.driver import run

from .grids import line

EXAMPLE_1 = read(contents.shipped_path("paper-example-1.json"))


@pytest.mark.parametrize("omega", [0.5, 1.0, 4.0])
def test_iterates_satisfy_the_published_recursion(omega: float) -> None:
    M, q, identity = EXAMPLE_1.M, EXAMPLE_1.q, np.eye(4)
    x = np.full(4, 10.0)
    for _, iterate in zip(range(12), fixed_point(EXAMPLE_1, x, omega=omega), strict=False):
        x = np.linalg.solve(omega * identity + M, (omega * identity - M) @ np.abs(x) - q)
        assert np.allclose(iterate.x, x, rtol=1e-13, atol=1e-13)
        F = (omega * identity + M) @ x - (omega * identity - M) @ np.abs(x) + q
        assert np.allclose(iterate.F, F, atol=1e-12)


LARGE = np.diag(np.append(1.0, -np.ones(factors.MOST_NUMPY_ROWS)))


@pytest.mark.parametrize(
    "M",
    [[[0, 1], [1, 0]], [[-1]], np.outer([1, 2, 3], [3, 1, 2]) / 11 - np.eye(3), LARGE, csr_array(LARGE)],
    ids=["exactly", "one unknown", "up to rounding", "large", "sparse"],
)
def test_singular_matrix_is_refused_by_name(M: ArrayLike) -> None:
    result = run(Problem(M, -np.ones(np.shape(M)[0])), "fixed-point")
    assert result.status is Status.BREAKDOWN
    assert "I + M is singular" in result.message
    assert "--omega" in result.message


@pytest.mark.parametrize("M", [np.diag([1e-20, 1.0, 1e20]).tolist(), [[0.0, 1e20], [1.0, 2e20]]])
def test_badly_scaled_matrix_is_not_mistaken_for_a_singular_one(M: list[list[float]]) -> None:
    problem = Problem(M, [-1.0] * len(M))
    assert run(problem, "fixed-point", limits=Limits(max_iterations=3)).status is Status.ITERATION_LIMIT


@pytest.mark.parametrize("n", [factors.MOST_NUMPY_ROWS, factors.MOST_NUMPY_ROWS + 1])
def test_small_large_and_sparse_matrices_give_the_same_iterates(n: int) -> None:
    q = np.random.default_rng(n).standard_normal(n)
    dense, sparse = (run(Problem(M, q), "fixed-point") for M in (line(n, 4.0).toarray(), line(n, 4.0)))
    assert (dense.solved, sparse.solved) == (True, True)
    assert dense.iterations == sparse.iterations
    assert np.allclose(dense.z, sparse.z, rtol=0, atol=1e-13)


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0, 8), sparse=st.booleans())
def test_auto_omega_is_near_the_best_for_positive_definite_matrices(seed: int, spread: float, sparse: bool) -> None:
    generator = np.random.default_rng(seed)
    Q = np.linalg.qr(generator.standard_normal((8, 8)))[0]
    eigenvalues = 10 ** generator.uniform(-spread / 2, spread / 2, 8)
    M = (Q * eigenvalues) @ Q.T
    M = (M + M.T) / 2
    best = np.sqrt(eigenvalues.min() * eigenvalues.max())
    omega = best_omega(csr_array(M) if sparse else M)
    assert best / 3 <= omega <= 3 * best


def test_auto_omega_of_other_matrices_is_the_largest_diagonal_entry() -> None:
    rows_exchanged = [[2, 1, 2, -2], [1, 1, 2, -1], [2, 2, 1, -1], [-2, -1, -1, 2]]  # then all pivots are positive
    others = [([[1, 2], [2, 1]], 1), ([[0, -5], [1, 0]], 5), ([[0, 0], [0, 0]], 1), (rows_exchanged, 2)]
    for M, omega in [([[1, 2], [-1, 3]], 3), *others]:
        dense = np.array(M, dtype=float)
        assert best_omega(dense) == omega
        assert best_omega(csr_array(dense)) == omega


def test_auto_omega_and_anderson_each_save_iterations_on_the_obstacle_problem() -> None:
    problem, options = families.make("obstacle", 400), ({}, {"omega": "auto"}, {"omega": "auto", "anderson": 5})
    published, plain, fast = (run(problem, "fixed-point", **each) for each in options)
    assert (published.solved, plain.solved, fast.solved) == (True, True, True)
    assert plain.iterations < published.iterations
    assert 2 * fast.iterations < plain.iterations
    assert np.allclose(fast.z, plain.z, rtol=0, atol=1e-9)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 30), memory=st.integers(1, 12))
def test_anderson_never_diverges_on_h_matrices(seed: int, n: int, memory: int) -> None:
    """Strictly diagonally dominant by rows, rows and columns in other units, omega at least the diagonal."""
    generator = np.random.default_rng(seed)
    M = generator.standard_normal((n, n))
    np.fill_diagonal(M, 0)
    np.fill_diagonal(M, 1.05 * np.abs(M).sum(axis=1) + 0.01)
    M = M * np.exp2(generator.integers(-2, 3, n))
    problem = Problem(M, generator.standard_normal(n))
    start = 100 * generator.standard_normal(n)
    for anderson in (0, memory):
        assert run(problem, "fixed-point", start, omega="auto", anderson=anderson).solved
