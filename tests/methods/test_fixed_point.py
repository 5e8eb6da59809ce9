"""The method `fixed-point` is Schäfer's iteration, contracts as theory says, and refuses where it is undefined."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array, kron

from lcpcli import Problem, Status, read
from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.linalg import factors
from lcpcli.methods.fixed_point import Anderson, best_omega, fixed_point
from lcpcli.options import Limits
from lcpcli.solving.driver import run

EXAMPLE_1 = read(contents.shipped_path("paper-example-1.json"))


@pytest.mark.parametrize("omega", [0.5, 1.0, 4.0])
def test_iterates_satisfy_the_published_recursion(omega: float) -> None:
    M, q, identity = EXAMPLE_1.M, EXAMPLE_1.q, np.eye(4)
    x = np.full(4, 10.0)
    for _, iterate in zip(range(12), fixed_point(EXAMPLE_1, x, omega=omega), strict=False):
        x = np.linalg.solve(omega * identity + M, (omega * identity - M) @ np.abs(x) - q)
        assert np.allclose(iterate.x, x, rtol=1e-13, atol=1e-13)
        assert iterate.F is not None
        F = (omega * identity + M) @ x - (omega * identity - M) @ np.abs(x) + q
        assert np.allclose(iterate.F, F, atol=1e-12)


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
    n = factors.MOST_NUMPY_ROWS + 1
    M = -np.eye(n)
    M[0, 0] = 1.0
    result = run(Problem(csr_array(M) if sparse else M, -np.ones(n)), "fixed-point")
    assert result.status is Status.BREAKDOWN
    assert "singular" in result.message


@pytest.mark.parametrize("M", [np.diag([1e-20, 1.0, 1e20]).tolist(), [[0.0, 1e20], [1.0, 2e20]]])
def test_badly_scaled_matrix_is_not_mistaken_for_a_singular_one(M: list[list[float]]) -> None:
    problem = Problem(M, [-1.0] * len(M))
    assert run(problem, "fixed-point", limits=Limits(max_iterations=3)).status is Status.ITERATION_LIMIT


@pytest.mark.parametrize("n", [factors.MOST_NUMPY_ROWS, factors.MOST_NUMPY_ROWS + 1])
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
    x = factors.factorizer(hilbert)(shift)(b)
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


def test_options_must_be_in_their_ranges() -> None:
    for omega in (0.0, "best", True):
        with pytest.raises(OptionError, match=r"^omega"):
            run(EXAMPLE_1, "fixed-point", omega=omega)
    for anderson in (-1, 0.5, "auto"):
        with pytest.raises(OptionError, match=r"^anderson"):
            run(EXAMPLE_1, "fixed-point", anderson=anderson)


def obstacle(m: int) -> Problem:
    h = 1 / (m + 1)
    T = diags_array([-np.ones(m - 1), 2 * np.ones(m), -np.ones(m - 1)], offsets=[-1, 0, 1])
    X, Y = np.meshgrid(*2 * [np.linspace(h, 1 - h, m)])
    f = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    return Problem(kron(T, eye_array(m)) + kron(eye_array(m), T), (-h * h * f).ravel())


@settings(max_examples=50, deadline=None)
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


@pytest.mark.parametrize("size", [1e-3, 1.0, 50.0])
def test_auto_omega_solves_problems_with_a_multiple_of_the_identity_at_once(size: float) -> None:
    """The contraction factor |omega - lambda| / |omega + lambda| is 0 for omega = lambda, and for no other omega."""
    for M in (size * np.eye(6), size * eye_array(6)):
        result = run(Problem(M, np.arange(6.0) - 2.5), "fixed-point", 10 * np.ones(6), omega="auto")
        assert result.solved
        assert result.iterations <= 3


def test_auto_omega_of_other_matrices_is_the_largest_diagonal_entry() -> None:
    rows_exchanged = [[2, 1, 2, -2], [1, 1, 2, -1], [2, 2, 1, -1], [-2, -1, -1, 2]]  # then all pivots are positive
    others = [([[1, 2], [2, 1]], 1), ([[0, -5], [1, 0]], 5), ([[0, 0], [0, 0]], 1), (rows_exchanged, 2)]
    for M, omega in [([[1, 2], [-1, 3]], 3), *others]:
        dense = np.array(M, dtype=float)
        assert best_omega(dense) == omega
        assert best_omega(csr_array(dense)) == omega


def test_auto_omega_and_anderson_each_save_iterations_on_the_obstacle_problem() -> None:
    problem = obstacle(30)
    published = run(problem, "fixed-point")
    plain = run(problem, "fixed-point", omega="auto")
    fast = run(problem, "fixed-point", omega="auto", anderson=5)
    assert published.solved
    assert plain.solved
    assert fast.solved
    assert plain.iterations < published.iterations
    assert 2 * fast.iterations < plain.iterations
    assert np.allclose(fast.z, plain.z, rtol=0, atol=1e-9)


def test_accelerated_iterates_know_their_residual() -> None:
    problem = obstacle(6)
    for _, iterate in zip(range(15), fixed_point(problem, np.zeros(36), omega=0.5, anderson=4), strict=False):
        if iterate.F is not None:
            z, w = np.abs(iterate.x) + iterate.x, 0.5 * (np.abs(iterate.x) - iterate.x)
            assert np.allclose(iterate.F, problem.M @ z - w + problem.q, rtol=0, atol=1e-13)


@settings(max_examples=60, deadline=None)
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
    plain = run(problem, "fixed-point", start, omega="auto")
    fast = run(problem, "fixed-point", start, omega="auto", anderson=memory)
    assert plain.solved
    assert fast.solved


def test_anderson_restarts_when_the_change_runs_away() -> None:
    """x -> (0.5 x_1, 5 for x_1 < 1e-3 else 0): a jump after a smooth start."""
    x, accelerator, changes = np.array([1.0, 0.0]), Anderson(3, 2), []
    for _ in range(60):
        g = np.array([0.5 * x[0], 5.0 if abs(x[0]) < 1e-3 else 0.0])
        changes.append(float(np.linalg.norm(g - x)))
        x = accelerator.next(x, g)
    assert max(changes) < 20
    assert changes[-1] <= 1e-12
