"""First-order conditions of nonlinear programs: W. Hock, K. Schittkowski, Test examples for nonlinear programming
codes, Lecture Notes in Economics and Mathematical Systems 187 (1981), from the starts given there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.solving.solve_mcp import run_nonlinear, solution_of_linearization
from lcpcli.typing import Vector

from ..nonlinear_problems import natural_residual

FREE = -math.inf


def _rosenbrock(x: Vector) -> Vector:
    return np.array([-400 * x[0] * (x[1] - x[0] ** 2) - 2 * (1 - x[0]), 200 * (x[1] - x[0] ** 2)])


def _problem_1(v: Vector) -> Any:
    """x_2 >= -1.5, with its multiplier."""
    return [*_rosenbrock(v[:2]) - [0, v[2]], v[1] + 1.5]


def _problem_15(v: Vector) -> Any:
    """x_1 x_2 >= 1, x_1 + x_2^2 >= 0 and x_1 <= 0.5."""
    by_x = _rosenbrock(v[:2]) - v[2] * v[1::-1] - v[3] * np.array([1, 2 * v[1]]) + [v[4], 0]
    return [*by_x, v[0] * v[1] - 1, v[0] + v[1] ** 2, 0.5 - v[0]]


PROGRAMS = {
    1: NonlinearProblem(_problem_1, lower=[FREE, FREE, 0], x0=[-2, 1, 0]),
    15: NonlinearProblem(_problem_15, lower=[FREE, FREE, 0, 0, 0], x0=[-2, 1, 0, 0, 0]),
}


@pytest.mark.parametrize("number", sorted(PROGRAMS))
def test_narrow_valleys_take_few_steps(number: int) -> None:
    problem = PROGRAMS[number]
    result = run_nonlinear(problem, restarts=0)
    assert result.solved
    assert natural_residual(problem, result.z) <= 1e-8
    assert result.iterations <= 40


def test_another_attempt_is_made_where_the_first_one_is_stuck_and_shown() -> None:
    result = lcpcli.solve_mcp(lambda z: z**2 + 1, lower=None, x0=[3.0], restarts=2, trace=True)
    assert not result.solved
    assert result.trace is not None
    steps = [row.step for row in result.trace.rows]
    assert steps.count("restart") == 2
    assert steps[steps.index("restart") + 1] == "smoothed"
    assert result.residual == min(row.residual for row in result.trace.rows)


def test_double_zeros_are_reached_faster_than_by_halving_the_error() -> None:
    result = lcpcli.solve_mcp(
        lambda z: (z - 1) ** 2 * (z + 5), lambda z: np.diag((z - 1) * (3 * z + 9)), lower=None, x0=[9.0, 7.0]
    )
    assert result.solved
    assert result.iterations <= 12


def test_a_large_slack_does_not_loosen_the_other_rows_of_a_linearization() -> None:
    M, q = np.diag([1.0, 1e-3, 1.0]), np.array([-1e-7, 1e-7, 1e9])
    M[0, 1] = M[1, 0] = 0.5
    problem = lcpcli.Problem(M, q, lower=[FREE, FREE, 0.0])
    evaluations = Evaluations(NonlinearProblem(lambda z: M @ z + q, lower=[FREE, FREE, 0.0]))
    found = solution_of_linearization(M, q, problem.box, None, False, evaluations)
    assert found is not None
    assert np.abs(problem.box.gaps(found[0], problem.w(found[0]))).max() <= 1e-14
