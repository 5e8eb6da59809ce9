"""First-order conditions of programs as models write them: presolve shows that they are monotone, if they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.linalg.krylov import is_semidefinite
from lcpcli.model.presolve import presolved

from . import presolve_problems as problems


@pytest.mark.parametrize("written", ["plainly", "signs", "disorder", "units"])
@pytest.mark.parametrize("seed", range(2))
def test_conditions_of_linear_programs_are_monotone_however_they_are_written(seed: int, written: str) -> None:
    problem = problems.linear_program(seed, written)
    change = presolved(problem)
    assert not is_semidefinite(problem.M)
    assert is_semidefinite(change.problem.M)
    assert change.kept.size <= 48  # of 79: x, its bounds, which are rows here, 18 equations and inequalities
    result = lcpcli.run(problem)
    assert result.solved
    assert "milp" not in result.route


def test_conditions_of_infeasible_linear_programs_are_refuted() -> None:
    result = lcpcli.run(problems.linear_program(0, "signs", infeasible=True))
    assert result.status.word == "infeasible"
    assert result.certificate.kind == "farkas"


@pytest.mark.parametrize("seed", range(2))
def test_conditions_of_programs_that_are_not_convex_are_solved(seed: int) -> None:
    """Stationary points of x'Qx / 2 + c'x, with Q indefinite, on 0 <= x <= 10 with equations; bounds are rows."""
    random = np.random.default_rng(seed)
    n, m = 30, 6
    A = np.where(random.random((m, n)) < 0.2, random.integers(-5, 6, (m, n)), 0).astype(float)
    B = np.where(random.random((n, n)) < 0.1, random.integers(-5, 6, (n, n)), 0).astype(float)
    top = np.hstack([B + B.T, -A.T, -np.eye(n), np.eye(n)])
    rows = np.vstack([A, np.eye(n), -np.eye(n)])
    M = np.vstack([top, np.hstack([rows, np.zeros((len(rows), len(rows)))])])
    b = A @ random.integers(0, 6, n)
    q = np.concatenate([random.integers(-5, 6, n), -b, np.zeros(n), np.full(n, 10.0)])
    lower = np.where(np.arange(q.size) < n + m, -np.inf, 0.0)
    result = lcpcli.run(Problem(csr_array(M), q, lower=lower, upper=np.inf))
    assert result.solved
    assert "milp" not in result.route
