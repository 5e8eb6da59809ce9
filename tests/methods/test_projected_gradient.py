"""Projected gradients lead to states that are nearly right, in single precision where that has room for the numbers."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.gallery import families
from lcpcli.linalg import matrices
from lcpcli.methods import projected_gradient
from lcpcli.solving.driver import run


@pytest.fixture
def precisions(monkeypatch: pytest.MonkeyPatch) -> set[np.dtype[np.floating]]:
    """The types of the matrices of which products are taken."""
    seen: set[np.dtype[np.floating]] = set()
    monkeypatch.setattr(projected_gradient, "product", lambda M, v: seen.add(M.dtype) or matrices.product(M, v))
    return seen


@pytest.mark.parametrize("family", ["harker-pang", "boxes"])
def test_steps_in_single_precision_lead_to_the_solution_in_doubles(
    family: str, precisions: set[np.dtype[np.floating]]
) -> None:
    result = run(families.make(family, 250, 1), "auto")
    assert result.solved
    assert result.relative_residual <= 1e-12
    assert result.route[0] == "gradient"
    assert precisions == {np.dtype(np.float32)}


@pytest.mark.parametrize(("of_M", "of_q"), [(2.0**-60, 1.0), (2.0**60, 1.0), (1.0, 2.0**-60), (1.0, 2.0**60)])
def test_numbers_beyond_the_range_of_single_precision_are_left_to_doubles(
    of_M: float, of_q: float, precisions: set[np.dtype[np.floating]]
) -> None:
    problem = families.make("harker-pang", 250, 1)
    plain = run(problem, "auto")
    precisions.clear()
    result = run(Problem(of_M * problem.M, of_q * problem.q), "auto")
    assert result.solved
    assert not precisions
    assert np.allclose(result.z * of_M / of_q, plain.z, rtol=1e-12, atol=0)


def test_steps_end_where_states_do_not_settle() -> None:
    """M = 0.1 I + A'A + B - B' with B as large as A: the iteration has no reason to converge."""
    A, B = np.random.default_rng(0).standard_normal((2, 300, 300)) / np.sqrt(300)
    M, q = 0.1 * np.eye(300) + A.T @ A + (B - B.T), np.random.default_rng(1).standard_normal(300)
    stage = projected_gradient.projected_gradient(Problem(M, q), np.zeros(300))
    evaluations = [iterate.evaluations for iterate in stage]
    assert len(evaluations) == 1
    assert evaluations[0] < projected_gradient.MOST_GRADIENT_STEPS
    assert run(Problem(M, q), "auto").solved
