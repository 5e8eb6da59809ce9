"""The active set from coarse versions of a sparse problem gives the solution of `newton`, whatever the M-matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron

from lcpcli import Problem, run
from lcpcli.methods.active_set import Factors, active_set, multilevel
from lcpcli.methods.full_approximation import FullApproximation
from lcpcli.methods.inexact import krylov
from lcpcli.methods.multilevel import Hierarchy
from lcpcli.methods.sparse_route import sparse_route
from lcpcli.methods.stages import Breakdown, Stalled
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.point import Criterion, Point

from .stages import through


def second_difference(m: int) -> Matrix:
    return diags_array([-np.ones(m - 1), 2 * np.ones(m), -np.ones(m - 1)], offsets=[-1, 0, 1])


def plane(m: int, across: float = 1.0) -> Matrix:
    return csr_array(kron(second_difference(m), eye_array(m)) + across * kron(eye_array(m), second_difference(m)))


def space(m: int) -> Matrix:
    unit = eye_array(m)
    return csr_array(kron(plane(m), unit) + kron(eye_array(m * m), second_difference(m)))


def stream(m: int, speed: float) -> Matrix:
    """Convection and diffusion with upwind differences, which is not symmetric."""
    upwind = diags_array([-np.ones(m - 1), np.ones(m)], offsets=[-1, 0])
    return csr_array(plane(m) + speed / m * (kron(upwind, eye_array(m)) + 0.5 * kron(eye_array(m), upwind)))


def graph(n: int, edges: int, shift: float, seed: int = 0) -> Matrix:
    """The Laplacian of a path with random edges and weights, plus a diagonal."""
    random = np.random.default_rng(seed)
    i = np.concatenate((np.arange(n - 1), random.integers(0, n, edges)))
    j = np.concatenate((np.arange(1, n), random.integers(0, n, edges)))
    i, j = i[i != j], j[i != j]
    weights = 10.0 ** random.uniform(-1, 1, i.size)
    W = coo_array((np.tile(weights, 2), (np.concatenate((i, j)), np.concatenate((j, i)))), shape=(n, n)).tocsr()
    return csr_array(diags_array(W.sum(axis=0) + shift) - W)


def smooth(n: int, seed: int = 0) -> Vector:
    """A load that changes sign a few times along the unknowns."""
    phases = np.random.default_rng(seed).uniform(1, 9, 2)
    t = np.linspace(0, 1, n)
    return 0.01 * (np.sin(6 * phases[0] * t) * np.cos(4 * phases[1] * t) - 0.2)


MATRICES: dict[str, Callable[[], Matrix]] = {
    "line": lambda: csr_array(second_difference(2000)),
    "plane": lambda: plane(45),
    "anisotropic": lambda: plane(40, 0.02),
    "space": lambda: space(13),
    "slow stream": lambda: stream(40, 5),
    "fast stream": lambda: stream(40, 2000),
    "graph": lambda: graph(2500, 250, 1e-3),
    "other units": lambda: scaled(plane(40)),
}


def scaled(M: Matrix) -> Matrix:
    units = diags_array(np.exp2(np.random.default_rng(3).integers(-8, 8, M.shape[0])))
    return csr_array(units @ M @ units)


def assert_equal_to_newton(problem: Problem, z: Vector) -> None:
    assert Point(Criterion(problem), z).relative_residual <= 1e-10
    expected = run(problem, "newton")
    assert expected.solved
    assert np.allclose(z, expected.z, rtol=1e-6, atol=1e-7 * np.abs(expected.z).max())


@pytest.mark.parametrize("name", MATRICES)
def test_the_route_gives_the_solution_of_newton(name: str) -> None:
    M = MATRICES[name]()
    for seed in range(3):
        problem = Problem(M, smooth(M.shape[0], seed) * np.sqrt(M.diagonal()))
        iterates, _ = through(sparse_route(problem, np.zeros(problem.n)))
        assert_equal_to_newton(problem, problem.box.z_of(iterates[-1].x))


def test_auto_solves_what_the_route_leaves() -> None:
    """The square of a difference matrix is positive definite, with positive entries off the diagonal."""
    M = csr_array(plane(40) @ plane(40))
    problem = Problem(M, smooth(1600))
    assert_equal_to_newton(problem, run(problem).z)


@pytest.mark.parametrize("name", ["plane", "space", "slow stream", "graph"])
def test_bounds_on_both_sides(name: str) -> None:
    M = MATRICES[name]()
    n = M.shape[0]
    for upper in (0.05, np.where(np.arange(n) % 7 == 0, np.inf, 0.02 + 0.05 * np.linspace(0, 1, n))):
        problem = Problem(M, smooth(n), lower=-0.05, upper=upper)
        iterates, ending = through(multilevel(problem))
        assert isinstance(ending, Stalled)
        assert_equal_to_newton(problem, problem.box.project(problem.box.z_of(iterates[-1].x)))


def test_coarse_versions_leave_little_to_be_pivoted() -> None:
    M = plane(60)
    problem = Problem(M, smooth(3600))
    z = FullApproximation(Hierarchy(M), problem.q, problem.box).solution()
    expected = run(problem, "newton").z
    states = z - problem.w(z) / M.diagonal() > 0
    assert np.count_nonzero(states != (expected > 0)) <= 0.05 * problem.n
    iterates, _ = through(multilevel(problem))
    assert len(iterates) <= 8


def test_factors_serve_in_place_of_coarse_versions() -> None:
    for M in (plane(30), stream(30, 200)):
        problem = Problem(M, smooth(900))
        start = run(problem, "newton").z + 1e-3 * np.random.default_rng(1).uniform(-1, 1, 900)
        iterates, ending = through(active_set(problem, np.maximum(start, 0), Factors(M)))
        assert isinstance(ending, Stalled)
        assert_equal_to_newton(problem, problem.box.z_of(iterates[-1].x))


def test_solutions_at_the_extremes() -> None:
    M = plane(30)
    for q in (np.ones(900), -np.ones(900), np.zeros(900)):
        problem = Problem(M, q)
        iterates, _ = through(multilevel(problem))
        assert Point(Criterion(problem), problem.box.z_of(iterates[-1].x)).relative_residual <= 1e-10


@pytest.mark.parametrize("method", [krylov, multilevel])
def test_a_diagonal_entry_that_is_not_positive_is_refused(method: Callable[..., object]) -> None:
    M = csr_array(diags_array(np.where(np.arange(400) == 7, 0.0, 1.0)))
    problem = Problem(M, -np.ones(400))
    iterates, ending = through(method(problem) if method is multilevel else method(problem, np.zeros(400)))
    assert iterates == []
    assert isinstance(ending, Breakdown)
