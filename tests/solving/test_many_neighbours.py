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
def test_results_are_those_of_run(family: str) -> None:
    problem = families.make(family, 225, 0)
    bounds: dict[str, Any] = {"lower": problem.lower, "upper": problem.upper}
    for change, turned in ((0.0, 0.0), (0.01, 0.0), (0.0, 3.0)):
        Q = columns(problem, change, turned)
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
    problem, made, own = families.make("obstacle", 900, 0), [], factors.PrincipalSolver._factorized
    monkeypatch.setattr(factors.PrincipalSolver, "_factorized", lambda *given: made.append(1) or own(*given))
    results = lcpcli.solve_many(problem.M, problem.q[:, np.newaxis] * np.linspace(1, 2, 20))
    next(results)
    made.clear()
    assert all(result.solved for result in results)
    assert len(made) == 1


def test_a_column_without_a_solution_between_others_is_proved_to_have_none() -> None:
    M = csr_array(np.kron(np.eye(150), np.array([[0.0, -1.0], [1.0, 1.0]])))
    solvable = np.tile([1.0, 1.0], 150)
    hopeless = solvable.copy()
    hopeless[10] = -0.5
    results = list(lcpcli.solve_many(M, np.array([solvable, solvable, hopeless, solvable, 2 * solvable]).T))
    assert [result.status.word for result in results] == ["solved", "solved", "infeasible", "solved", "solved"]


def test_a_singular_set_leaves_the_column_to_auto_limits_hold_and_large_numbers_are_compared() -> None:
    n = 300
    M = csr_array(diags_array([np.ones(n - 1)], offsets=[1], shape=(n, n)) * 1.0)
    q = np.ones(n)
    changed = q.copy()
    changed[-1] = -1e-3
    results = list(lcpcli.solve_many(M, np.array([q, changed, q, changed]).T))
    alone = [lcpcli.solve(M, own) for own in (q, changed, q, changed)]
    assert [result.status for result in results] == [result.status for result in alone]
    few = families.make("obstacle", 225, 0)
    results = list(lcpcli.solve_many(few.M, columns(few, 0.0, 0.0), max_iterations=0))
    assert {result.status.word for result in results} == {"iteration_limit"}
    M, q = csr_array(diags_array([np.full(300, 1e200)], offsets=[0])), np.full(300, -1e200)
    assert all(result.solved for result in lcpcli.solve_many(M, np.array([q, q, q, 2 * q]).T)), "without a warning"
