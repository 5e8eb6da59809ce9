"""Jacobians that are wrong: nothing is claimed because of them, and what is wrong is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli.errors import OptionError, ProblemError
from lcpcli.model.box import Box
from lcpcli.model.differences import rounding
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


@pytest.mark.parametrize("factor", [1e12, 1e30])
def test_violations_are_not_little_beside_a_jacobian_that_is_too_large(factor: float) -> None:
    for matrix in (lambda z: factor * J(z), lambda z: csr_array(factor * J(z))):
        result = lcpcli.solve_mcp(F, matrix, x0=[5, 5], restarts=0)
        assert not result.solved
        assert result.relative_residual > result.tol


def test_differences_over_a_jump_or_over_far_more_than_z_make_no_solution() -> None:
    assert not lcpcli.solve_mcp(jump, x0=[4], restarts=0).solved
    tiny = lcpcli.solve_mcp(lambda z: (z / 1e-20) ** 2 - 3, x0=[1e-20], restarts=0)
    assert not tiny.solved or abs(tiny.z[0] / 1e-20 - 3**0.5) < 1e-8


def test_large_units_of_F_are_no_fault_of_its_jacobian() -> None:
    result = lcpcli.solve_mcp(lambda z: 1e20 * F(z), lambda z: 1e20 * J(z), x0=[1, 1])
    assert result.solved
    assert np.abs(F(result.z)).max() < 1e-12


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda z: -J(z), "J[0, 0] is -2.34375 there, but by differences of F 2.34375 "),
        (lambda z: J(z) + np.array([[0, 99], [0, 0]]), "J[0, 1] is 100 there, but by differences of F 1 "),
        (lambda _: np.full((2, 2), np.nan), "J[0, 0] is nan there, but by differences of F "),
        (lambda z: 1j * J(z), "is nan there, but by differences of F "),
    ],
)
def test_stalls_name_an_entry_that_is_wrong(wrong: Any, words: str) -> None:
    result = lcpcli.solve_mcp(F, wrong, x0=[5, 5], restarts=0)
    assert not result.solved
    assert words in result.message
    assert "another J" in result.advice


def test_stalls_do_not_blame_a_right_jacobian() -> None:
    result = lcpcli.solve_mcp(lambda z: 1 + z**2, lambda z: np.diag(2 * z), lower=None, x0=[0.5, 3.0], restarts=0)
    assert not result.solved
    assert "J[" not in result.message
    assert "another J" not in result.advice


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"F": lambda _: None}, "F: returns nothing"),
        ({"F": lambda _: [1.0, [2.0, 3.0]]}, "F: returns a list"),
        ({"J": lambda _: None}, "J: returns nothing"),
        ({"pattern": np.eye(3)}, r"pattern: has shape \(3, 3\) for 2 unknowns"),
        ({"x0": 1.0}, "x0: is a number, so that the number of unknowns is unknown"),
        ({"F": np.log, "x0": [-1, -1], "names": ["a", "b"], "lower": None}, "x0: F is nan there, in row a"),
    ],
)
def test_what_else_cannot_be_used_is_refused_in_one_line(given: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {"F": F, "x0": [1, 1], **given}
    with pytest.raises((ProblemError, OptionError), match=message) as caught:
        lcpcli.solve_mcp(**arguments)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", [{"lower": None}, {"lower": [0, 0]}, {"upper": 3}, {"infinity": 1e20}, {"J": J}])
def test_bounds_beside_a_problem_are_refused_instead_of_ignored(given: dict[str, Any]) -> None:
    with pytest.raises(OptionError, match="has no effect on a NonlinearProblem"):
        lcpcli.solve_mcp(NonlinearProblem(F, x0=[1, 1]), **given)


def test_differences_where_F_is_infinite_are_undefined_and_no_breakdown() -> None:
    unit = 1e-10  # far less than the steps of differences
    result = lcpcli.solve_mcp(lambda z: np.log(z / unit) + np.array([0.0, 1.0]), x0=[unit, unit])
    assert result.status is not Status.BREAKDOWN
    J = Evaluations(NonlinearProblem(np.log, x0=[0, 1])).jacobian(np.array([0.0, 1.0]))
    assert not np.isfinite(J[0, 0])
    assert J[1, 1] == pytest.approx(1)


@pytest.mark.parametrize(("noise", "is_rounding"), [(1e-12, True), (0.3, False)])
def test_noise_that_is_large_beside_F_is_not_taken_for_rounding(noise: float, is_rounding: bool) -> None:
    generator, z = np.random.default_rng(0), np.full(3, 0.7)
    found = rounding(lambda z: z + 1 + noise * generator.standard_normal(z.size), Box(0.0, np.inf), z, 1e-6)
    assert (found > 0).tolist() == [is_rounding] * 3
