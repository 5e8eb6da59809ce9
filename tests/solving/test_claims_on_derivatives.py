"""Nonlinear claims rest on terms that differences of F show; noise of F is told, and matched by the steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli.errors import OptionError, ProblemError
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.typing import Vector

WRONG: list[tuple[Callable[[Vector], Any], Callable[[Vector], Any], dict[str, Any]]] = [
    (lambda z: 1e-10 * (z**2 - 9), lambda z: [[2 * z[0]]], {"x0": [1.0]}),
    (lambda z: 1e-7 * (1 + z**2), lambda _: [[1e5]], {"x0": [1.0], "lower": None}),
    (lambda z: z * 1e6 - 0.3, lambda _: [[1e18]], {"x0": [9e-7]}),
]


@pytest.mark.parametrize(("F", "J", "others"), WRONG)
def test_in_small_units_a_wrong_jacobian_makes_no_solution_and_is_named(F: Any, J: Any, others: dict[str, Any]) -> None:
    result = lcpcli.solve_mcp(F, J, **others, restarts=0)
    assert result.status is lcpcli.Status.STALLED
    assert "J[0, 0] is " in result.message
    assert result.relative_residual > result.tol


def test_check_says_which_entry_is_wrong() -> None:
    problem = NonlinearProblem(lambda z: 1e-10 * (z**2 - 9), lambda z: [[2 * z[0]]], x0=[1.0])
    found = lcpcli.check(problem, [2.0])
    assert not found.accepted
    assert "J[0, 0] is 4 there, but by differences of F 4e-10" in found.message
    assert lcpcli.check(problem, [3.0]).accepted


@settings(max_examples=40)
@given(st.integers(-12, 12), st.integers(-12, 12), st.sampled_from([1e-8, 1e-3, 1e3, 1e8]))
def test_no_claim_hangs_on_a_factor_of_the_jacobian(unit: int, scale: int, factor: float) -> None:
    u, s = 10.0**unit, 10.0**scale

    def F(z: Vector) -> Vector:
        return np.asarray(u * ((z / s) ** 3 + z / s - 10))

    def J(z: Vector) -> Vector:
        return np.asarray([[factor * u * (3 * (z[0] / s) ** 2 + 1) / s]])

    result = lcpcli.solve_mcp(F, J, x0=[s], restarts=0, max_iterations=50)
    assert not result.solved or abs(result.z[0] / s - 2) < 1e-9


@pytest.mark.parametrize(("F", "x0", "z"), [
    (lambda z: np.exp(z / 1e-10) - 5, 2e-10, 1e-10 * np.log(5)),
    (lambda z: (z / 1e-12) ** 4 - 16, 3e-12, 2e-12),
])  # fmt: skip
def test_differences_take_steps_to_match_a_tiny_z(F: Any, x0: float, z: float) -> None:
    result = lcpcli.solve_mcp(F, x0=[x0])
    assert result.solved
    assert result.z[0] == pytest.approx(z, rel=1e-9)


@pytest.mark.parametrize("x0", [1.0, 1e8])
def test_differences_far_from_0_make_no_solution(x0: float) -> None:
    assert not lcpcli.solve_mcp(lambda z: (z - 1e8) ** 2 + 1e-3, lower=None, x0=[x0], restarts=0).solved


@pytest.mark.parametrize("level", [1e-9, 1e-7, 1e-5])
def test_noise_is_told_and_solved_up_to_it_with_few_evaluations(level: float) -> None:
    calls, random = [0], np.random.default_rng(1)

    def F(z: Vector) -> Vector:
        calls[0] += 1
        return np.asarray(z**3 + z - [2, 10] + level * random.uniform(-1, 1, 2))

    result = lcpcli.solve_mcp(F, x0=[2.0, 3.0], tol=100 * level)
    assert result.solved
    assert "F is noisy at about " in result.message
    assert np.abs(result.z - [1, 2]).max() < 10 * level
    assert calls[0] <= 300
    calls[0] = 0
    assert not lcpcli.solve_mcp(F, x0=[2.0, 3.0], tol=1e-14).solved
    assert calls[0] <= 600


def test_noise_that_no_difference_shows_is_told_where_the_tolerance_is_loose() -> None:
    """By bisection of [-1, 2 + z] to 1e-6, F has slopes that are not those of its limit, and jumps."""

    def F(z: Vector) -> Vector:
        low, high = -np.ones(2), 2 + z
        while (high - low).max() > 2e-6:
            y = (low + high) / 2
            low, high = np.where(y**3 + y > z, low, y), np.where(y**3 + y > z, y, high)
        return (low + high) / 2 - [0.5, 0.8]

    result = lcpcli.solve_mcp(F, x0=[2.0, 3.0], tol=1e-4)
    assert result.solved
    assert "F is noisy at about " in result.message


@pytest.mark.parametrize(("shift", "scale"), [(1e7, 1.0), (3e6, 1.0), (1e7, 100.0), (2e7, 0.01)])
def test_oscillation_that_finer_differences_resolve_is_no_noise(shift: float, scale: float) -> None:
    A = np.array([[0.8, 0.6], [-0.5, 0.4]])

    def F(z: Vector) -> Vector:
        return scale * (A @ (z - shift) + 2 * np.sin(z - shift) - 1)

    result = lcpcli.solve_mcp(F, x0=shift + np.array([1.4, 2.6]))
    assert result.solved
    assert "noisy" not in result.message
    assert np.abs(F(result.z)).max() <= 1e-6 * scale


@pytest.mark.parametrize("seed", range(3))
def test_noise_above_rounding_ends_a_run_within_300_evaluations(seed: int) -> None:
    calls, random = [0], np.random.default_rng(seed)
    A = random.standard_normal((5, 5)) / 5**0.5
    M, z = A @ A.T + A - A.T + 0.5 * np.eye(5), random.uniform(0.3, 2, 5)

    def F(at: Vector) -> Vector:
        calls[0] += 1
        return np.asarray(M @ (at - z) + at**3 - z**3 + 4e-9 * random.uniform(-1, 1, 5))

    result = lcpcli.solve_mcp(F, x0=z + random.uniform(0.2, 1, 5))
    assert np.abs(result.z - z).max() < 4e-8
    assert "F is noisy at about " in result.message
    assert calls[0] <= 300


def test_steps_within_noise_that_is_known_are_few() -> None:
    """By bisection to 1e-6, of which the noise has slopes of its own."""
    calls, random = [0], np.random.default_rng(3)
    A = random.standard_normal((2, 2))
    M, z = A @ A.T + A - A.T + 0.5 * np.eye(2), random.uniform(0.3, 2, 2)

    def smooth(y: Vector) -> Vector:
        return np.asarray(1e3 * (M @ y + np.exp(y / 2)))

    def F(at: Vector) -> Vector:
        calls[0] += 1
        low, high = -1 - np.abs(at), 2 + 1.3 * np.abs(at)
        while (high - low).max() > 2e-6:
            middle = (low + high) / 2
            above = middle + 0.6 * np.sin(middle) > at + 0.6 * np.sin(at)
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return smooth((low + high) / 2) - smooth(z)

    result = lcpcli.solve_mcp(F, x0=z + 0.5)
    assert np.abs(result.z - z).max() < 1e-5
    assert "F is noisy at about " in result.message
    assert calls[0] <= 300


def test_a_given_step_is_taken() -> None:
    seen = list[float]()

    def F(z: Vector) -> Vector:
        seen.append(float(z[0]))
        return z**2 - 4

    assert lcpcli.solve_mcp(F, z0=[3.0], difference_step=1e-3).solved
    assert min(abs(each - 3.003) for each in seen) < 1e-12
    for step, others in ((2.0, {}), (1e-3, {"J": lambda z: [[2 * z[0]]]})):
        with pytest.raises(OptionError, match="difference_step: "):
            lcpcli.solve_mcp(lambda z: z**2 - 4, z0=[3.0], difference_step=step, **others)


def test_z0_is_the_start_also_of_a_problem() -> None:
    problem = NonlinearProblem(lambda z: z**2 - 4, lower=None, x0=[1.0])
    assert lcpcli.solve_mcp(problem, z0=[-1.0]).z[0] == pytest.approx(-2)
    assert lcpcli.solve_mcp(problem.F, lower=None, z0=[-1.0]).z[0] == pytest.approx(-2)
    with pytest.raises(OptionError, match="x0: is another name of z0"):
        lcpcli.solve_mcp(problem.F, z0=[1.0], x0=[1.0])


def test_functions_that_change_z_or_are_complex_are_refused_in_one_line() -> None:
    def changing(z: Vector) -> Vector:
        z *= 2
        return z - 1

    with pytest.raises(ProblemError, match="F: changes its argument z"):
        lcpcli.solve_mcp(changing, z0=[1.0])
    with pytest.raises(ProblemError, match=r"F\[0\] is the complex number 1\+2j there"):
        lcpcli.solve_mcp(lambda z: z + 2j, z0=[1.0])
