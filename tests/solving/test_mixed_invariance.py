"""The answer to a mixed problem depends neither on units, nor on order, signs, or where the bounds lie."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.typing import Vector

from ..mixed_problems import definite, monotone, with_all_bounds

SHIFTS = (1e2, 1e4, 1e6)


def near(z: Vector, reference: Vector, size: float = 1.0) -> bool:
    return bool(np.abs(z - reference).max() <= 1e-6 * max(size * 1e-6, 1.0) * (1 + np.abs(reference).max()))


@pytest.fixture(params=range(25))
def given(request: pytest.FixtureRequest) -> tuple[Problem, Vector, np.random.Generator]:
    generator = np.random.default_rng(request.param)
    n = int(generator.integers(1, 30))
    M, q = monotone(n, generator)
    lower, upper = with_all_bounds(n, generator)
    problem = Problem(M, q, lower=lower, upper=upper)
    result = lcpcli.run(problem)
    assert result.solved
    return problem, result.z, generator


Given = tuple[Problem, Vector, np.random.Generator]


def bounds(problem: Problem) -> tuple[Vector, Vector]:
    lower, upper = problem.box.lower, problem.box.upper
    assert isinstance(lower, np.ndarray)
    assert isinstance(upper, np.ndarray)
    return lower, upper


def test_units_of_rows_and_columns_do_not_matter(given: Given) -> None:
    problem, z, generator = given
    (lower, upper), (R, C) = bounds(problem), 10.0 ** generator.uniform(-8, 8, (2, problem.n))
    result = lcpcli.solve(R[:, np.newaxis] * problem.M * C, R * problem.q, lower=lower / C, upper=upper / C)
    assert result.solved
    assert near(C * result.z, z)


def test_order_does_not_matter(given: Given) -> None:
    problem, z, generator = given
    (lower, upper), P = bounds(problem), generator.permutation(problem.n)
    result = lcpcli.solve(problem.M[np.ix_(P, P)], problem.q[P], lower=lower[P], upper=upper[P])
    assert result.solved
    assert near(result.z, z[P])


def test_mirroring_exchanges_the_bounds(given: Given) -> None:
    problem, z, _ = given
    lower, upper = bounds(problem)
    result = lcpcli.solve(problem.M, -problem.q, lower=-upper, upper=-lower)
    assert result.solved
    assert near(-result.z, z)
    exchanged = {"lower": "upper", "upper": "lower", "basic": "basic"}
    free = lower < upper
    states = [np.array(lcpcli.run(problem).basis)[free], np.array([exchanged[state] for state in result.basis])[free]]
    assert states[0].tolist() == states[1].tolist()


@pytest.mark.parametrize("size", SHIFTS)
def test_a_shift_moves_the_answer(given: Given, size: float) -> None:
    problem, z, generator = given
    (lower, upper), shift = bounds(problem), size * generator.standard_normal(problem.n)
    result = lcpcli.solve(problem.M, problem.q - problem.M @ shift, lower=lower + shift, upper=upper + shift)
    assert result.solved
    assert near(result.z - shift, z, size)


@pytest.mark.parametrize("size", [-1e6, -1e3, 1e3, 1e6, 1e8])
def test_no_shift_makes_a_wrong_answer_right(size: float) -> None:
    """No variable is free: to shift one is to change q as for any linear system, and with it the scale of its row."""
    for seed in range(20):
        generator = np.random.default_rng(seed)
        M, q = definite(8, generator)
        kind = seed % 4
        lower = None if kind == 1 else generator.uniform(-1, 0, 8)
        upper = None if kind == 0 else generator.uniform(0, 1, 8)
        if kind == 3:
            lower, upper = np.where(np.arange(8) % 2, lower, -np.inf), np.where(np.arange(8) % 4 == 1, np.inf, upper)
        z = lcpcli.solve(M, q, lower=lower, upper=upper).z
        wrong = Problem(M, q, lower=lower, upper=upper).box.project(z + 1e-4 * generator.standard_normal(8))
        assert not lcpcli.check(Problem(M, q, lower=lower, upper=upper), wrong).accepted
        shifted = Problem(
            M,
            q - M @ np.full(8, size),
            lower=None if lower is None else lower + size,
            upper=None if upper is None else upper + size,
        )
        assert not lcpcli.check(shifted, wrong + size).accepted


def test_the_mixed_spelling_of_a_complementarity_problem_has_the_same_bits() -> None:
    for seed in range(10):
        M, q = monotone(15, np.random.default_rng(seed))
        plain, spelt = lcpcli.solve(M, q), lcpcli.solve(M, q, lower=np.zeros(15), upper=[np.inf] * 15)
        assert plain.z.tobytes() == spelt.z.tobytes()
        assert plain.w.tobytes() == spelt.w.tobytes()
        assert plain.relative_residual == spelt.relative_residual
