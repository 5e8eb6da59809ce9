"""What is measured is what is said: zero at solutions, the same in all units, never fooled by small numbers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli import Problem, read, run
from lcpcli.files import shipped
from lcpcli.linalg.equilibration import equilibrate, range_of_units
from lcpcli.linalg.matrices import norm_inf, row_and_column_maxima
from lcpcli.verify.accuracy import Accuracy
from lcpcli.verify.point import Point

NAMES = ["paper-example-1.json", "paper-example-2.json", "tridiagonal-100.json", "bimatrix.json"]


@pytest.mark.parametrize("name", NAMES)
def test_both_residuals_vanish_at_known_solutions(name: str) -> None:
    problem = read(shipped.path(name))
    accuracy = Accuracy(problem)
    for z in problem.solutions:
        w = problem.w(z)
        assert accuracy.natural_residual(z, w) <= 1e-15
        assert accuracy.relative_residual(z, w) <= 1e-15
        assert accuracy.error(z) == 0


def test_relative_residual_hardly_changes_with_the_units_of_rows_columns_and_q() -> None:
    """By a factor of 1.2 in the median of random problems, of 12 in one of a hundred: equilibration has no one end."""
    factors = []
    for seed in range(1000):
        generator = np.random.default_rng(seed)
        M, q, z = generator.standard_normal((5, 5)), generator.standard_normal(5), generator.random(5)
        R, C = np.exp2(generator.integers(-26, 27, (2, 5)).astype(float))
        t = 2.0 ** int(generator.integers(-300, 300))
        problem, scaled = Problem(M, q), Problem(R[:, None] * M * C, t * R * q)
        here = Accuracy(problem).relative_residual(z, problem.w(z))
        there = Accuracy(scaled).relative_residual(t * z / C, scaled.w(t * z / C))
        factors.append(max(here / there, there / here))
    median, high = np.percentile(factors, (50, 99))
    assert median <= 1.5
    assert high <= 16


def test_small_solution_is_not_taken_for_zero() -> None:
    """M = 1e12, q = -1: z = 2e-12 has a natural residual of 2e-12, and is wrong by a factor of 2."""
    problem = Problem([[1e12]], [-1.0])
    z = np.array([2e-12])
    assert Accuracy(problem).natural_residual(z, problem.w(z)) <= 2e-12
    assert Accuracy(problem).relative_residual(z, problem.w(z)) > 0.1


@pytest.mark.parametrize(
    ("M", "q", "z"),
    [
        ([[2.0, 1.0], [-1.0, 0.0]], [-5.0, 1e12], [0.0, 0.0]),
        ([[0.0, 0.0], [0.0, 1.0]], [-1.0, -1e11], [0.0, 1e11]),
        ([[1.0, 0.0], [0.0, 3.0]], [-1e12, -6.0], [1e12, 12.0]),
        ([[1e250, 1e200, 1e-200], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]], [-1.0, -1.0, -1.0], [1e-250, 1.0, 0.0]),
    ],
    ids=["inactive bound", "infeasible row", "two scales", "extreme"],
)
def test_large_entry_of_one_row_does_not_hide_an_error_in_another(
    M: list[list[float]], q: list[float], z: list[float]
) -> None:
    problem, wrong = Problem(M, q), np.array(z)
    assert Accuracy(problem).relative_residual(wrong, problem.w(wrong)) > 1e-8


def test_z_that_runs_off_to_infinity_does_not_look_right() -> None:
    """M z + q >= 0 is never met, but |M| |z| grows without bound."""
    problem = Problem([[0.0, 1.0], [0.0, -1.0]], [-2.0, 1.0])
    for size in (1.0, 1e8, 1e15):
        z = np.array([size, 1.5])
        assert Accuracy(problem).relative_residual(z, problem.w(z)) > 0.1


def test_relative_residual_of_a_homogeneous_problem_is_zero_only_at_a_solution() -> None:
    accuracy = Accuracy(Problem(np.eye(2), np.zeros(2)))
    assert accuracy.relative_residual(np.zeros(2), np.zeros(2)) == 0
    assert accuracy.relative_residual(np.ones(2), np.ones(2)) == math.inf


def test_nan_and_infinity_are_infinitely_wrong() -> None:
    accuracy = Accuracy(Problem(np.eye(2), -np.ones(2), solutions=[np.ones(2)]))
    for z in (np.array([np.nan, 1.0]), np.array([np.inf, 1.0])):
        assert accuracy.natural_residual(z, z) == math.inf
        assert accuracy.relative_residual(z, z) == math.inf
        assert accuracy.error(z) == math.inf


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 40))
def test_equilibrated_rows_and_columns_have_entries_near_one(seed: int, spread: int) -> None:
    generator = np.random.default_rng(seed)
    powers = generator.integers(-spread, spread + 1, (2, 6)).astype(float)
    M = np.exp2(powers[0])[:, None] * generator.standard_normal((6, 6)) * np.exp2(powers[1])
    for matrix in (M, csr_array(M)):
        R, C = equilibrate(matrix, np.ones(6))
        scaled = R[:, None] * np.abs(M) * C
        largest = np.concatenate((scaled.max(axis=0), scaled.max(axis=1)))
        assert largest.min() >= 1 / 2
        assert largest.max() <= 2
        assert np.array_equal(np.concatenate((R, C)), np.exp2(np.rint(np.log2(np.concatenate((R, C))))))


def test_equilibration_keeps_symmetry() -> None:
    M = np.diag([1e-8, 1.0, 1e8]) + 1e-5
    R, C = equilibrate(M, np.ones(3))
    assert np.array_equal(R, C)


def test_rows_and_columns_of_zeros_are_equilibrated_too() -> None:
    M = np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    for matrix in (M, csr_array(M)):
        R, C = equilibrate(matrix, np.array([1e10, 1.0, 0.0]))
        assert R[1] / 2 <= 1e10 * R[0] <= 2 * R[1]
        assert R[2] == C[0] == C[2] == 1.0


def test_sparse_and_dense_norms_agree() -> None:
    generator = np.random.default_rng(3)
    M = generator.standard_normal((50, 50)) * (generator.random((50, 50)) < 0.1)
    R, C = generator.random((2, 50))
    assert norm_inf(M) == pytest.approx(norm_inf(csr_array(M)), rel=1e-15)
    for dense, sparse in zip(row_and_column_maxima(M, R, C), row_and_column_maxima(csr_array(M), R, C), strict=True):
        assert np.array_equal(dense, sparse)


@settings(deadline=None, max_examples=300)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.sampled_from([1, 2, 5, 20, 120]),
    spread=st.integers(0, 4),
    size=st.integers(-17, -2),
    sparse=st.booleans(),
)
def test_bounds_never_call_a_solution_what_is_none(seed: int, n: int, spread: int, size: int, sparse: bool) -> None:
    """Perturbed solutions, with a tolerance just below and well above the relative residual."""
    generator = np.random.default_rng(seed)
    units = np.exp2(generator.integers(-spread, spread + 1, (2, n)).astype(float))
    A = generator.standard_normal((n, n))
    M = units[0][:, None] * (A @ A.T + np.eye(n)) * units[1]
    z = np.maximum(generator.standard_normal(n), 0) / units[1]
    q = units[0] * np.maximum(generator.standard_normal(n), 0) * (z == 0) - M @ z
    z = np.maximum(z * (1 + 10.0**size * generator.standard_normal(n)), 0)
    problem = Problem(csr_array(M) if sparse else M, q)
    if not z.any():
        return
    exact = Accuracy(problem, 1e-15)
    residual = exact.relative_residual(z, exact.w(z))
    if 0 < residual < 0.1:
        assert not Point(Accuracy(problem, 0.9 * residual), z).solves()
        assert Point(Accuracy(problem, max(1.1 * residual, 1e-13)), z).solves()


@settings(deadline=None, max_examples=300)
@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 3))
def test_units_lie_in_the_range_that_the_diagonal_promises(seed: int, spread: int) -> None:
    generator = np.random.default_rng(seed)
    sizes = np.exp2(generator.uniform(-spread, spread, 6))
    M = generator.uniform(-1, 1, (6, 6)) * sizes
    np.fill_diagonal(M, sizes * generator.choice([-1, 1], 6))
    q, largest = np.ones(6), float(np.abs(M).max())
    low, high = range_of_units(float(np.abs(M.diagonal()).min()), largest)
    for R in equilibrate(M, q):
        assert low <= R.min()
        assert R.max() <= high
    for plain, informed in zip(equilibrate(M, q), equilibrate(csr_array(M), q, np.abs(M).max(axis=1)), strict=True):
        assert np.array_equal(plain, informed)


def test_a_solution_that_bounds_show_needs_no_equilibration(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    monkeypatch.setattr("lcpcli.verify.accuracy.equilibrate", lambda *_: pytest.fail("equilibrated in vain"))
    assert Point(Accuracy(problem), np.array([4 / 3, 7 / 3])).solves()
    assert not Point(Accuracy(problem), np.zeros(2)).solves()


@pytest.mark.parametrize("size", [1.0, 1e11, 1e15])
@pytest.mark.parametrize("method", ["auto", "interior", "newton", "lemke"])
def test_a_bound_that_solves_a_problem_is_found_whatever_the_size_of_q(size: float, method: Any) -> None:
    """At the bound w = size, so that relative to size every z is a solution."""
    result = run(Problem([[1.0]], [size + 1], lower=-1.0), method)
    assert (result.z.tolist(), result.residual) == ([-1.0], 0.0)
    assert run(Problem([[1.0]], [-size - 1], lower=-np.inf, upper=1.0), method).z.tolist() == [1.0]
