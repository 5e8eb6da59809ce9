"""Columns of Q for a sparse M: neighbours share active sets and factors, and are solved as `run` solves each."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

import lcpcli
from lcpcli import Problem
from lcpcli.gallery import families
from lcpcli.linalg import factors

K = 6


def columns(problem: Problem, change: float, turned: float) -> Any:
    """q, with changes of that relative size in each entry, and that much of another vector."""
    generator, size = np.random.default_rng(0), float(np.abs(problem.q).mean())
    noise = 1 + change * generator.standard_normal((problem.n, K))
    return problem.q[:, np.newaxis] * noise + turned * size * generator.standard_normal((problem.n, K))


@pytest.mark.parametrize("family", ["obstacle", "two-obstacles", "american-put", "circuit"])
@pytest.mark.parametrize(("change", "turned"), [(0.0, 0.0), (0.01, 0.0), (0.0, 3.0)])
def test_results_are_those_of_run(family: str, change: float, turned: float) -> None:
    problem = families.make(family, 400, 0)
    Q = columns(problem, change, turned)
    bounds: dict[str, Any] = {"lower": problem.lower, "upper": problem.upper}
    results = list(lcpcli.solve_many(problem.M, Q, **bounds))
    assert len(results) == K
    for result, q in zip(results, Q.T, strict=True):
        alone = lcpcli.solve(problem.M, q, **bounds)
        assert (result.status, result.method, result.message) == (alone.status, alone.method, alone.message)
        assert np.allclose(result.z, alone.z, rtol=1e-8, atol=1e-9 * float(np.abs(alone.z).max()))
        assert result.relative_residual <= 1e-10
        assert result.options == alone.options
        assert result.seconds == pytest.approx(sum(result.parts.values()))
    assert any(result.route in {("newton",), ("elimination",)} for result in results[1:]) or turned


def test_factors_are_shared_by_columns_with_the_same_active_set(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = families.make("obstacle", 2500, 0)
    count = 0
    factorized = factors.PrincipalSolver._factorized

    def counted(*given: Any) -> Any:
        nonlocal count
        count += 1
        return factorized(*given)

    monkeypatch.setattr(factors.PrincipalSolver, "_factorized", counted)
    Q = problem.q[:, np.newaxis] * np.linspace(1, 2, 20)
    results = lcpcli.solve_many(problem.M, Q)
    next(results)
    count = 0
    assert all(result.solved for result in results)
    assert count == 1


def test_a_column_without_a_solution_between_others_is_proved_to_have_none() -> None:
    M = csr_array(np.kron(np.eye(150), np.array([[0.0, -1.0], [1.0, 1.0]])))
    solvable = np.tile([1.0, 1.0], 150)
    hopeless = solvable.copy()
    hopeless[10] = -0.5
    results = list(lcpcli.solve_many(M, np.array([solvable, solvable, hopeless, solvable, 2 * solvable]).T))
    assert [result.status.word for result in results] == ["solved", "solved", "infeasible", "solved", "solved"]


def test_a_singular_set_leaves_the_column_to_auto() -> None:
    n = 300
    M = csr_array(diags_array([np.ones(n - 1)], offsets=[1], shape=(n, n)) * 1.0)
    q = np.ones(n)
    changed = q.copy()
    changed[-1] = -1e-3
    results = list(lcpcli.solve_many(M, np.array([q, changed, q, changed]).T))
    alone = [lcpcli.solve(M, own) for own in (q, changed, q, changed)]
    assert [result.status for result in results] == [result.status for result in alone]


def test_numbers_beyond_the_range_of_doubles_are_compared_without_a_word() -> None:
    M = csr_array(diags_array([np.full(300, 1e200)], offsets=[0]))
    q = np.full(300, -1e200)
    assert all(result.solved for result in lcpcli.solve_many(M, np.array([q, q, q, 2 * q]).T))


def test_time_limit_and_iteration_limit_are_those_of_each_column() -> None:
    problem = families.make("obstacle", 400, 0)
    results = list(lcpcli.solve_many(problem.M, columns(problem, 0.0, 0.0), max_iterations=0))
    assert {result.status.word for result in results} == {"iteration_limit"}
