"""Derivatives of a batch are those of its results one by one; and of J z where z is one of several solutions, as with
redundant contacts."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.random import Generator

import lcpcli
from lcpcli import Batch, Result
from lcpcli.errors import DerivativeError, OptionError
from lcpcli.typing import Vector

from .families import random_change, random_problem

B = 10
ARRAYS = ("q", "M", "lower", "upper")
NAN = float("nan")


def batch_of(M: Any, q: Any, **bounds: Any) -> Batch:
    batch: Batch = lcpcli.solve_many(M, q, **bounds)
    return batch


def assert_close(found: Vector, known: Any, size: float) -> None:
    assert np.allclose(found, known, rtol=1e-9, atol=1e-10 * size, equal_nan=True)


def assert_as_one_by_one(batch: Batch, g: Vector, changes: dict[str, Vector], J: Vector | None, sided: bool) -> None:
    """All derivatives of a batch, with nan for none, against those of its results."""
    by = batch.gradient(g, J=J, unsolved="nan")
    along = batch.derivative(**changes, one_sided=sided, J=J, unsolved="nan")
    for i, result in enumerate(batch):
        try:
            alone = result.gradient(g[i], J=J)
        except DerivativeError:
            assert all(np.isnan(getattr(by, name)[i]).all() for name in ARRAYS)
        else:
            size = float(np.abs(alone.M).max(initial=1.0))
            for name in ARRAYS:
                assert_close(getattr(by, name)[i], getattr(alone, name), size)
            assert by.kinks.get(i, []) == alone.kinks
        try:
            there = result.derivative(**{name: change[i] for name, change in changes.items()}, one_sided=sided, J=J)
        except DerivativeError:
            assert np.isnan(along.z[i]).all()
            assert np.isnan(along.w[i]).all()
            assert along.strongly_regular[i] is None
        else:
            size = float(np.abs(there.z).max(initial=1.0))
            assert_close(along.z[i], there.z, size)
            assert_close(along.w[i], there.w, 100 * size)
            assert (along.kinks.get(i, []), along.strongly_regular[i]) == (there.kinks, there.strongly_regular)


@pytest.mark.parametrize(("seed", "mixed"), [*product(range(3), (False, True))])
def test_derivatives_of_random_batches_are_those_of_their_results(seed: int, mixed: bool) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 15))
    problems = [random_problem(n, random, mixed) for _ in range(B)]
    moves = [random_change(problem, random) for problem in problems]
    changes = {name: np.array([move[name] for move in moves]) for name in moves[0]}
    bounds = np.array([problem.box.vectors(n) for problem in problems])
    M, q = (np.array([getattr(problem, name) for problem in problems]) for name in ("M", "q"))
    batch = batch_of(M, q, lower=bounds[:, 0], upper=bounds[:, 1])
    assert batch._linearizations.clear.sum() > B / 2, "most are computed at once"
    for J in (None, random.normal(size=(2, n))):
        g = random.normal(size=(B, n if J is None else 2))
        assert_as_one_by_one(batch, g, changes, J, sided=False)


@settings(max_examples=30)
@given(
    arrays(float, (5, 3, 3), elements=st.integers(-2, 2)),
    arrays(float, (5, 3), elements=st.integers(-2, 2)),
    st.sampled_from([(0.0, np.inf), (-1.0, 1.0)]),
    st.booleans(),
    st.booleans(),
)
def test_kinks_singular_and_unsolved_problems_are_those_of_their_results(
    M: Vector, q: Vector, bounds: tuple[float, float], sided: bool, with_J: bool
) -> None:
    g, changes = np.ones((5, 3)), {"dq": np.tile([1.0, -2, 3], (5, 1)), "dM": np.ones((5, 3, 3))}
    J = np.array([[1.0, 1, 0], [0, 1, 1], [0, 0, 1]]) if with_J else None
    assert_as_one_by_one(batch_of(M, q, lower=bounds[0], upper=bounds[1]), g, changes, J, sided)


M, Q = [np.eye(2), [[0.0, 1], [1, 0]], np.ones((2, 2))], [[-1.0, -2], [-1, 1], [-1, -1]]  # one has no solution


def test_the_first_problem_without_derivatives_is_named_or_its_row_is_nan() -> None:
    batch, g = batch_of(M, Q), np.ones((3, 2))
    for call in (batch.gradient, lambda g: batch.derivative(dq=g)):
        with pytest.raises(DerivativeError, match=r"^batch\[1\]: no derivative, as the problem is not solved: has no"):
            call(g)
    gradient = batch.gradient(g, unsolved="nan")
    assert np.isnan(gradient.q).all(axis=1).tolist() == [False, True, False]
    assert np.isnan(gradient.M).all(axis=(1, 2)).tolist() == [False, True, False]
    assert gradient.q[0].tolist() == [-1.0, -1.0]
    with pytest.raises(OptionError, match="unsolved: 'no' is unknown"):
        batch.gradient(g, unsolved="no")  # type: ignore[arg-type]


def test_what_is_given_without_a_first_dimension_is_the_same_for_all() -> None:
    batch = batch_of([np.eye(2), 2 * np.eye(2)], [[-1, -2], [-3, 4]])
    assert batch.gradient([1, 2]).q.tolist() == [[-1.0, -2.0], [-0.5, 0.0]]
    assert batch.derivative(dM=np.eye(2)).z.tolist() == [[-1.0, -2.0], [-0.75, 0.0]]
    assert batch.derivative(dq=[1, 1], J=[[1, 0]]).z.tolist() == [[-1.0], [-0.5]]


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


@pytest.mark.parametrize("unsolved", ["raise", "nan"])
def test_an_unsolved_problem_of_a_batch_has_the_gradient_0_of_a_function_that_leaves_it_out(unsolved: str) -> None:
    batch = lcpcli.solve_many(np.array([[[1.0]], [[-1.0]]]), np.array([[-1.0], [-1.0]]))
    found = batch.gradient(np.array([[1.0], [0.0]]), unsolved=unsolved)
    for values, expected in ((found.q, [-1, 0]), (found.M, [-1, 0]), (found.lower, [0, 0])):
        assert values.ravel().tolist() == expected


@pytest.mark.parametrize("J", [[1, 0, 0, 0], [0, 0, 0, 1], [1, 1, 1, 0]])
def test_J_z_has_a_derivative_only_if_no_direction_of_several_changes_it(J: list[float]) -> None:
    """z1 + z2 and z3 + z4 are determined, and no more."""
    result = lcpcli.solve(np.kron(np.diag([1.0, 2.0]), np.ones((2, 2))), [-1, -1, -4, -4], "interior")
    assert (result.z > 0.1).all()
    assert result.derivative(dq=[1, 1, 0, 0], J=[[1, 1, 0, 0], [0, 0, 1, 1]]).z == pytest.approx([-1, 0])
    with pytest.raises(DerivativeError, match="several solutions, which differ in J z"):
        result.derivative(dq=[1, 1, 0, 0], J=[J])
