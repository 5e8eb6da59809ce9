"""Elimination for tridiagonal M-matrices: states of a solution in O(n) operations, wherever its basic variables lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array, diags_array

import lcpcli
from lcpcli import Problem
from lcpcli.methods import z_matrix
from lcpcli.methods.stages import Finished, Iterate, advance
from lcpcli.methods.z_matrix import Elimination, eliminated
from lcpcli.typing import Matrix, Vector

from .grids import line


def tridiagonal(rng: np.random.Generator, n: int, spread: int) -> Vector:
    """A tridiagonal M-matrix: M v > 0 for some v > 0, with entries off the diagonal of any size, some of them 0."""
    below, above = (rng.uniform(0, 1, n - 1) * 10.0 ** rng.integers(-spread, spread + 1, n - 1) for _ in range(2))
    N = np.diag(below * (rng.random(n - 1) < 0.9), -1) + np.diag(above * (rng.random(n - 1) < 0.9), 1)
    v = 10.0 ** rng.uniform(-1, 1, n)
    return np.array(np.diag((N @ v) / v * (1 + rng.uniform(0.01, 1, n)) + 1e-6) - N)


def by_chandrasekaran(M: Vector, q: Vector) -> Vector:
    """The solution for an M-matrix: variables whose w is negative become basic, and remain so."""
    basic = np.zeros(q.size, np.bool_)
    while True:
        z = np.zeros(q.size)
        z[basic] = np.linalg.solve(M[np.ix_(basic, basic)], -q[basic])
        new = (M @ z + q < -1e-12 * np.abs(q).max()) & ~basic
        if not new.any():
            return z
        basic |= new


@settings(max_examples=100)
@given(st.integers(0, 10**6), st.integers(2, 30), st.integers(0, 2))
def test_the_solution_is_found_wherever_the_basic_variables_lie(seed: int, n: int, spread: int) -> None:
    rng = np.random.default_rng(seed)
    M, q = tridiagonal(rng, n, spread), rng.standard_normal(n)
    stage, last = eliminated(Problem(csr_array(M), q)), None
    while isinstance(step := advance(stage), Iterate):
        last = step
    assert isinstance(step, Finished)
    assert last is not None
    np.testing.assert_allclose(2 * np.maximum(last.x, 0), by_chandrasekaran(M, q), rtol=1e-6, atol=1e-9)


def stopping(n: int, drift: float) -> tuple[Matrix, Vector]:
    """Optimal stopping of a diffusion with the payoff |x| - 1/5: both ends stop, and the middle goes on."""
    x, h = np.linspace(-3, 3, n, retstep=True)
    up, down = 0.045 / h**2 + max(drift, 0) / h, 0.045 / h**2 + max(-drift, 0) / h
    diagonal = np.full(n, 0.05 + up + down)
    diagonal[[0, -1]] -= down, up
    M = diags_array([np.full(n - 1, -down), diagonal, np.full(n - 1, -up)], offsets=(-1, 0, 1), format="csr")
    return M, M @ (np.abs(x) - 0.2)


@pytest.mark.parametrize("drift", [0.1, -0.1])
def test_optimal_stopping_with_two_free_boundaries_takes_a_few_passes_on_every_grid(
    drift: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    passes = list[None]()
    monkeypatch.setattr(z_matrix, "check", lambda: passes.append(None))
    for n in (201, 2001, 20001):
        passes.clear()
        result = lcpcli.solve(*stopping(n, drift))
        assert result.solved
        assert (result.route, result.evaluations) == (("elimination",), 1)
        assert len(passes) < 6
        assert np.count_nonzero(np.diff((result.z > 0).astype(int))) == 2


@pytest.mark.parametrize("rate", [1.0, 1e-3, 1e-8])
def test_many_runs_of_basic_variables_are_those_of_one_addition_after_another(rate: float) -> None:
    rng, n = np.random.default_rng(0), 300
    below, above = rng.uniform(0.5, 1, (2, n - 1))
    M = np.diag(rate + np.append(0, below) + np.append(above, 0)) - np.diag(below, -1) - np.diag(above, 1)
    q = 0.01 * np.cumsum(rng.standard_normal(n)) + 0.1 * rng.standard_normal(n)
    z, basic = Elimination(csr_array(M)).solution(q)
    assert lcpcli.solve(csr_array(M), q, z0=z).solved
    np.testing.assert_array_equal(basic, by_chandrasekaran(M, q) > 0)


def test_a_tridiagonal_matrix_that_is_no_m_matrix_is_left_to_other_methods() -> None:
    M = -line(200) + 0.1 * np.eye(200)
    result = lcpcli.solve(csr_array(M), -np.ones(200))
    assert "elimination" not in result.route


def test_a_dense_tridiagonal_matrix_takes_the_route_of_compressed_rows() -> None:
    M, q = stopping(401, 0.1)
    for form in (M.toarray(), M, M.tocsc(), M.tocoo(), np.asfortranarray(M.toarray())):
        result = lcpcli.solve(form, q)
        assert (result.solved, result.route) == (True, ("elimination",))
    problem = Problem(M.toarray(), q)
    assert lcpcli.run(problem).problem is problem
