"""Nonlinear claims rest on terms that differences of F show: nothing is claimed because of Jacobians that are wrong,
and what is wrong is told; noise of F is told, and matched by the steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

import lcpcli
from lcpcli.errors import OptionError
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.solving.result import Status
from lcpcli.typing import Vector


def F(z: Vector) -> Vector:
    return np.array([z[0] ** 2 + z[1] - 2, z[0] + z[1] ** 3 - 3])


def J(z: Vector) -> Vector:
    return np.array([[2 * z[0], 1.0], [1.0, 3 * z[1] ** 2]])


def jump(z: Vector) -> Vector:
    """1e-3 short of 0 below 5, and 1 from there on."""
    return np.where(z < 5, 1e-3 * (z - 6), z - 4)


def test_differences_over_a_jump_or_over_far_more_than_z_make_no_solution() -> None:
    assert not lcpcli.solve_mcp(jump, x0=[4], restarts=0).solved
    tiny = lcpcli.solve_mcp(lambda z: (z / 1e-20) ** 2 - 3, x0=[1e-20], restarts=0)
    assert not tiny.solved or abs(tiny.z[0] / 1e-20 - 3**0.5) < 1e-8


def test_stalls_name_an_entry_that_is_wrong() -> None:
    for wrong, words in (
        (lambda z: -J(z), "J[0, 0] is -2.34375 there, but by differences of F 2.34375 "),
        (lambda z: J(z) + np.array([[0, 99], [0, 0]]), "J[0, 1] is 100 there, but by differences of F 1 "),
        (lambda _: np.full((2, 2), np.nan), "J[0, 0] is nan there, but by differences of F "),
        (lambda z: 1j * J(z), "is nan there, but by differences of F "),
    ):
        result = lcpcli.solve_mcp(F, wrong, x0=[5, 5], restarts=0)
        assert (result.solved, words in result.message, "another J" in result.advice) == (False, True, True)


def test_stalls_do_not_blame_a_right_jacobian() -> None:
    result = lcpcli.solve_mcp(lambda z: 1 + z**2, lambda z: np.diag(2 * z), lower=None, x0=[0.5, 3.0], restarts=0)
    assert (result.solved, "J[" in result.message, "another J" in result.advice) == (False, False, False)


def test_bounds_beside_a_problem_are_refused_instead_of_ignored() -> None:
    for bounds in ({"lower": None}, {"lower": [0, 0]}, {"upper": 3}, {"infinity": 1e20}, {"J": J}):
        with pytest.raises(OptionError, match="has no effect on a NonlinearProblem"):
            lcpcli.solve_mcp(NonlinearProblem(F, x0=[1, 1]), **bounds)


def test_differences_where_F_is_infinite_are_undefined_and_no_breakdown() -> None:
    unit = 1e-10  # far less than the steps of differences
    result = lcpcli.solve_mcp(lambda z: np.log(z / unit) + np.array([0.0, 1.0]), x0=[unit, unit])
    assert result.status is not Status.BREAKDOWN
    J = Evaluations(NonlinearProblem(np.log, x0=[0, 1])).jacobian(np.array([0.0, 1.0]))
    assert not np.isfinite(J[0, 0])
    assert J[1, 1] == pytest.approx(1)


WRONG: dict[str, tuple[Callable[[Vector], Any], Callable[[Vector], Any], dict[str, Any]]] = {
    "too large": (F, lambda z: 1e12 * J(z), {"x0": [5.0, 5.0]}),
    "far too large and sparse": (F, lambda z: csr_array(1e30 * J(z)), {"x0": [5.0, 5.0]}),
    "too large in small units": (lambda z: 1e-10 * (z**2 - 9), lambda z: [[2 * z[0]]], {"x0": [1.0]}),
    "without a solution": (lambda z: 1e-7 * (1 + z**2), lambda _: [[1e5]], {"x0": [1.0], "lower": None}),
    "in large units": (lambda z: z * 1e6 - 0.3, lambda _: [[1e18]], {"x0": [9e-7]}),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_jacobian_makes_no_solution_in_any_units_and_is_named(name: str) -> None:
    F, J, others = WRONG[name]
    result = lcpcli.solve_mcp(F, J, **others, restarts=0)
    assert result.status is Status.STALLED
    assert "J[0, 0] is " in result.message
    assert result.relative_residual > result.tol


def test_check_says_which_entry_is_wrong() -> None:
    problem = NonlinearProblem(lambda z: 1e-10 * (z**2 - 9), lambda z: [[2 * z[0]]], x0=[1.0])
    found = lcpcli.check(problem, [2.0])
    assert not found.accepted
    assert "J[0, 0] is 4 there, but by differences of F 4e-10" in found.message
    assert lcpcli.check(problem, [3.0]).accepted


@settings(max_examples=25)
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
