"""Derivatives of J z where z is one of several solutions, as with redundant contacts."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator

import lcpcli
from lcpcli import Result
from lcpcli.errors import DerivativeError, ProblemError
from lcpcli.typing import Vector

METHODS = ("interior", "lemke", "auto")  # whose z is within the set of solutions, or a vertex of it


def contacts(random: Generator) -> tuple[Vector, Vector, Vector]:
    """Normals of contacts of a body, of which each occurs twice, in the columns; a mass matrix, and velocities with
    which all of them touch."""
    d, k = 6, int(random.integers(1, 4))
    normals = random.normal(size=(d, k))
    N = np.concatenate((normals, normals), axis=1)
    A = random.normal(size=(d, d))
    W = A @ A.T + np.eye(d)
    forces = random.random(2 * k) + 0.5
    return N, W, -W @ N @ forces


def solved(N: Vector, W: Vector, v: Vector, method: str) -> Result:
    return lcpcli.solve(N.T @ W @ N, N.T @ v, method)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(3))
def test_the_derivative_of_the_force_on_the_body_is_its_difference(seed: int, method: str) -> None:
    """M and q change with the normals, the masses and the velocities, the first half of the contacts as the other."""
    random = np.random.default_rng(seed)
    N, W, v = contacts(random)
    half = random.normal(size=(6, N.shape[1] // 2))
    dN, A, dv = np.concatenate((half, half), axis=1), random.normal(size=(6, 6)), random.normal(size=6)
    dW, h = A + A.T, 1e-5
    result = solved(N, W, v, method)
    changes = {"dM": dN.T @ W @ N + N.T @ dW @ N + N.T @ W @ dN, "dq": dN.T @ v + N.T @ dv}
    force = result.derivative(**changes, J=N)
    ends = []
    for t in (h, -h):
        near = N + t * dN
        ends.append(N @ solved(near, W + t * dW, v + t * dv, "lemke").z)
    known = (ends[0] - ends[1]) / (2 * h)
    assert np.abs(force.z - known).max() <= 1e-6 * np.abs(known).max(initial=1.0)
    assert np.abs(force.w).max() <= 1e-8 * np.abs(known).max(initial=1.0)
    g = random.normal(size=6)
    gradient = result.gradient(g, J=N)
    total = (gradient.M * changes["dM"]).sum() + gradient.q @ changes["dq"]
    assert total == pytest.approx(g @ force.z, rel=1e-8, abs=1e-8)


G = np.array([[1.0, 1, 0], [0, 0, 1]])


@pytest.mark.parametrize("scale", [1e-6, 1e9])
@pytest.mark.parametrize("method", METHODS)
def test_it_does_not_depend_on_units_and_names_what_is_not_determined(method: str, scale: float) -> None:
    R = np.array([1.0, scale, 1.0])
    M = R[:, np.newaxis] * (G.T @ G) * R
    result, J = lcpcli.solve(M, R * (G.T @ [-3, -2]), method), G * R
    assert result.solved
    direction = R * (G.T @ [1.0, 0])
    assert result.derivative(dq=direction, J=J).z == pytest.approx([-1, 0], abs=1e-9)
    assert G @ (result.gradient([1, 0], J=J).q * R) == pytest.approx([-1, 0], abs=1e-9)
    for call in (lambda J: result.derivative(dq=direction, J=J), lambda J: result.gradient(np.ones(len(J)), J=J)):
        with pytest.raises(DerivativeError, match="several solutions, which differ in J z, in row 1 of J"):
            call(np.array([J[0], [1.0, 0, 0]]))
    with pytest.raises(DerivativeError, match="no derivative in this direction: M, q and the bounds change so that"):
        result.derivative(dq=[1, 0, 0], J=J)
    assert result.derivative(dq=[0, 0, 1], J=J).z == pytest.approx([0, -1], abs=1e-9)


def test_w_is_nan_where_the_solutions_differ_in_it() -> None:
    """z_1 + z_2 = 1, and w_3 = z_1 - z_2 + 5 depends on which of them it is."""
    M, q = np.array([[1.0, 1, 0], [1, 1, 0], [1, -1, 1]]), np.array([-1.0, -1, 5])
    result = lcpcli.solve(M, q, "interior")
    found = result.derivative(dq=[1, 1, 0], J=[[1, 1, 0]])
    assert found.z == pytest.approx([-1.0])
    assert np.isnan(found.w).tolist() == [False, False, True]
    assert found.strongly_regular is None


def test_J_z_of_a_regular_solution_is_J_times_the_derivative() -> None:
    random = np.random.default_rng(1)
    A = random.normal(size=(5, 5))
    result, J = lcpcli.solve(A @ A.T + np.eye(5), random.normal(size=5)), random.normal(size=(3, 5))
    dq, g = random.normal(size=5), random.normal(size=3)
    alone, of_J = result.derivative(dq=dq), result.derivative(dq=dq, J=J)
    assert np.allclose(of_J.z, J @ alone.z, rtol=1e-12)
    assert of_J.w.tolist() == alone.w.tolist()
    assert np.allclose(result.gradient(g, J=J).q, result.gradient(J.T @ g).q, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize(
    ("g", "J", "message"),
    [
        ([1], [[1, 2]], "J: has shape (1, 2); give rows of 3 numbers"),
        ([1, 2], [[1, 2, 3]], "g: has 2 entries for 1 row of J"),
    ],
)
def test_a_J_that_cannot_be_used_is_one_clear_error(g: list[int], J: list[list[int]], message: str) -> None:
    with pytest.raises(ProblemError) as caught:
        lcpcli.solve(np.eye(3), [-1, -1, -1]).gradient(g, J=J)
    assert str(caught.value).startswith(message)
