"""The sparse route solves what it is made for, to rounding, and fails in words elsewhere."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array, eye_array, kron

from lcpcli import Problem
from lcpcli.methods.sparse_route import sparse_route
from lcpcli.methods.stages import Breakdown, Iterate, Stalled, advance
from lcpcli.model.box import ORTHANT
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.point import Criterion, Point

TOL = 1e-10


def laplacian(m: int) -> Matrix:
    T = diags_array([-np.ones(m - 1), 2 * np.ones(m), -np.ones(m - 1)], offsets=[-1, 0, 1])
    return csr_array(kron(T, eye_array(m)) + kron(eye_array(m), T))


def obstacle(m: int) -> Problem:
    """-Laplace u >= f, u >= 0 on the unit square, five-point formula, a load f that changes sign."""
    h = 1 / (m + 1)
    X, Y = np.meshgrid(*2 * [np.linspace(h, 1 - h, m)])
    f = 50 * np.sin(2 * np.pi * X) * np.cos(1.5 * np.pi * Y) + 10 * (X - 0.5)
    return Problem(laplacian(m), (-h * h * f).ravel())


def tridiagonal(n: int) -> Problem:
    M = diags_array([-np.ones(n - 1), 4 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    return Problem(M, np.random.default_rng(0).standard_normal(n))


def dominant(n: int) -> Problem:
    """A nonsymmetric strictly diagonally dominant matrix with random places, whose factors would be full."""
    generator = np.random.default_rng(1)
    A = csr_array((generator.standard_normal(9 * n), tuple(generator.integers(0, n, (2, 9 * n)))), shape=(n, n))
    A = A - diags_array(A.diagonal())
    return Problem(A + diags_array(1.1 * abs(A).sum(axis=1) + 0.01), generator.standard_normal(n))


def solve(problem: Problem, x0: Vector | None = None) -> tuple[Vector, list[str]]:
    """The first z that meets the tolerance by its residual, and the methods of the route."""
    criterion, methods = Criterion(problem), []
    for k, iterate in enumerate(sparse_route(problem, np.zeros(problem.n) if x0 is None else x0)):
        methods.append(iterate.method)
        z = ORTHANT.z_of(iterate.x)
        if Point(criterion, z).relative_residual <= TOL:
            return z, list(dict.fromkeys(methods))
        assert k < 1000
    raise AssertionError("ended without a solution")


@pytest.mark.parametrize("m", [5, 30, 80])
def test_obstacle_problem(m: int) -> None:
    z, methods = solve(obstacle(m))
    assert "fixed-point" not in methods
    assert z.min() >= 0


@pytest.mark.parametrize("problem", [tridiagonal(50_000), dominant(20_000)], ids=["tridiagonal", "dominant"])
def test_well_conditioned_matrices_are_not_factorized(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scipy.sparse.linalg.splu", None)
    _, methods = solve(problem)
    assert methods == ["krylov"]


def test_other_units_make_no_difference() -> None:
    problem = obstacle(40)
    units = np.exp2(np.random.default_rng(3).integers(-20, 20, problem.n))
    scaled = Problem(diags_array(units) @ problem.M @ diags_array(units), units * problem.q)
    z, _ = solve(scaled)
    assert np.allclose(z * units, solve(problem)[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("start", [1.0, -1.0])
def test_any_start_will_do(start: float) -> None:
    for problem in (obstacle(20), tridiagonal(300), dominant(500)):
        z, _ = solve(problem, np.full(problem.n, start))
        assert np.allclose(z, solve(problem)[0], rtol=0, atol=1e-8)


def test_degenerate_solution() -> None:
    """A third of the unknowns has z = w = 0."""
    M, generator = laplacian(30), np.random.default_rng(4)
    side = generator.integers(-1, 2, 900)
    z = np.where(side > 0, generator.uniform(0, 1, 900), 0)
    w = np.where(side < 0, generator.uniform(0, 1, 900), 0)
    found, _ = solve(Problem(M, w - M @ z))
    assert np.allclose(found, z, rtol=0, atol=1e-7)


def test_zero_and_positive_q_are_solved_by_zero() -> None:
    for q in (np.zeros(900), np.ones(900)):
        z, _ = solve(Problem(laplacian(30), q), np.ones(900))
        assert np.abs(z).max() <= 1e-9


def test_what_rounding_stops_is_finished_by_one_factorization() -> None:
    """The condition number is 4e9: no z in double precision meets the tolerance, but the active set can be right."""
    n = 50_000
    M = diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1])
    problem = Problem(M, np.random.default_rng(6).standard_normal(n))
    *_, last = sparse_route(problem, np.zeros(n))
    assert (last.method, last.step) == ("multilevel", "finish")
    z = ORTHANT.z_of(last.x)
    rounding = np.finfo(float).eps * (abs(problem.M) @ z + np.abs(problem.q))
    assert np.all(np.abs(np.minimum(z, problem.w(z))) <= 8 * rounding)


def test_p_matrix_that_is_not_positive_definite() -> None:
    """1 on the diagonal and 4 above it: an upper triangular P-matrix with an indefinite symmetric part."""
    n = 200
    M = diags_array([np.ones(n), 4 * np.ones(n - 1)], offsets=[0, 1])
    z = np.where(np.arange(n) % 3 == 0, 1.0, 0.0)
    w = np.where(np.arange(n) % 3 == 1, 1.0, 0.0)
    found, _ = solve(Problem(M, w - M.tocsr() @ z, solutions=[z]))
    assert np.allclose(found, z, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "M",
    [-laplacian(30), csr_array((900, 900)), laplacian(30) - 0.5 * eye_array(900)],
    ids=["negative", "zero", "indefinite"],
)
def test_matrices_it_is_not_made_for_end_in_words(M: Matrix) -> None:
    criterion = Criterion(Problem(M, -np.ones(900)))
    best, stage = np.inf, sparse_route(criterion.problem, np.zeros(900))
    with np.errstate(over="raise", invalid="raise"):
        for _ in range(300):
            step = advance(stage)
            if not isinstance(step, Iterate):
                assert isinstance(step, (Breakdown, Stalled))
                break
            z = ORTHANT.z_of(step.x)
            best = min(best, Point(criterion, z).relative_residual)
    assert best > TOL
