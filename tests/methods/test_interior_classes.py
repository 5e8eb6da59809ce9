"""The method `interior` on monotone mixed problems of every kind: those with a solution are solved, others refuted."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Status, Trace
from lcpcli.linalg.shifted_systems import SuperLU, systems
from lcpcli.methods.interior_scaling import slack_form
from lcpcli.methods.interior_steps import Steps
from lcpcli.methods.interior_systems import AccurateSystems, Regularization
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.point import Criterion, Point

from ..mixed_problems import definite, monotone, with_all_bounds

KINDS = ("definite", "monotone", "semidefinite", "skew", "program")
AT_LOWER, BETWEEN, AT_UPPER = range(3)


def matrix(kind: str, n: int, random: Generator) -> Matrix:
    """M with M + M' positive semidefinite: of full rank, of rank n / 2, or 0, and the conditions of a program."""
    if kind == "definite":
        return definite(n, random)[0]
    if kind == "monotone":
        return monotone(n, random)[0]
    B = random.standard_normal((n, n))
    if kind == "skew":
        return B - B.T
    half = B[: n // 2]
    if kind == "semidefinite":
        return half.T @ half / n
    m = n // 3
    A, Q = B[:m, m:], half[:, m:].T @ half[:, m:] / n
    return np.block([[Q, -A.T], [A, np.zeros((m, m))]])


def solvable(kind: str, n: int, random: Generator, degenerate: bool = False, sparse: bool = False) -> Problem:
    """A problem built around a solution, with bounds of all kinds; if degenerate, w is 0 at half of those attained."""
    M = matrix(kind, n, random)
    lower, upper = with_all_bounds(n, random)
    states = random.integers(0, 3, n)
    at_lower, at_upper = (states == AT_LOWER) & np.isfinite(lower), (states == AT_UPPER) & np.isfinite(upper)
    some = random.standard_normal(n)
    z = np.where(at_lower, lower, np.where(at_upper, upper, np.clip(some, lower, upper)))
    w = random.uniform(0.5, 2, n) * (at_lower * 1.0 - at_upper * 1.0)
    if degenerate:
        w[random.random(n) < 0.5] = 0.0
    return Problem(csr_array(M) if sparse else M, w - M @ z, lower=lower, upper=upper)


def residual(problem: Problem, z: Vector) -> float:
    """The largest component of z - mid(l, u, z - w), relative to the terms of w."""
    M = problem.M if isinstance(problem.M, np.ndarray) else problem.M.toarray()
    natural = z - np.clip(z - (M @ z + problem.q), problem.lower, problem.upper)
    return float(np.abs(natural).max() / (np.abs(M) @ np.abs(z) + np.abs(problem.q)).max())


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("degenerate", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_monotone_problem_is_solved(kind: str, degenerate: bool, sparse: bool) -> None:
    """With free variables, boxes, fixed variables and equations in each, and z_i = w_i = 0 in the degenerate ones."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        problem = solvable(kind, int(random.integers(3, 40)), random, degenerate, sparse)
        result = lcpcli.run(problem, "interior")
        assert result.solved
        assert residual(problem, result.z) <= 1e-9
        assert ((problem.lower <= result.z) & (result.z <= problem.upper)).all()


@pytest.mark.parametrize("kind", KINDS)
def test_nondegenerate_solutions_are_accurate_to_rounding(kind: str) -> None:
    """They end at the basic solution of the active set, not at a point of the path near it."""
    for seed in range(12):
        problem = solvable(kind, 30, np.random.default_rng(seed), sparse=True)
        assert residual(problem, lcpcli.run(problem, "interior").z) <= 1e-12


def test_unique_solutions_are_those_of_newton_and_lemke() -> None:
    for seed in range(20):
        random = np.random.default_rng(seed)
        M, q = monotone(15, random)
        lower, upper = with_all_bounds(15, random)
        z, *others = (lcpcli.solve(M, q, each, lower=lower, upper=upper).z for each in ("interior", "newton", "lemke"))
        assert all(np.abs(z - other).max() <= 1e-9 * (1 + np.abs(z).max()) for other in others)


@pytest.mark.parametrize("sparse", [False, True])
def test_programs_without_a_feasible_point_are_refuted(sparse: bool) -> None:
    """The rows of A x >= b add up to 0 >= 1, in integers."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        n, m = 8, 6
        A, b = random.integers(-5, 6, (m, n)).astype(float), random.integers(-5, 6, m).astype(float)
        A[-1], b[-1] = -A[:-1].sum(axis=0), 1 - b[:-1].sum()
        M = np.block([[definite(n, random)[0], -A.T], [A, np.zeros((m, m))]])
        lower = np.concatenate((np.full(n, -np.inf), np.zeros(m)))
        problem = Problem(csr_array(M) if sparse else M, np.concatenate((random.standard_normal(n), -b)), lower=lower)
        result = lcpcli.run(problem, "interior")
        assert result.status is Status.INFEASIBLE
        assert result.certificate is not None
        assert lcpcli.check(problem, y=result.certificate.vector).accepted


@pytest.mark.parametrize("kind", ["semidefinite", "skew", "program"])
def test_no_problem_with_a_solution_is_refuted(kind: str) -> None:
    for seed in range(40):
        result = lcpcli.run(solvable(kind, 12, np.random.default_rng(seed), degenerate=True), "interior")
        assert result.status is Status.SOLVED


@pytest.mark.parametrize("kind", KINDS)
def test_scaled_problem_has_the_points_of_the_given_one(kind: str) -> None:
    problem = solvable(kind, 24, np.random.default_rng(0), sparse=True)
    result = lcpcli.run(problem)
    within = slack_form(problem)
    x = problem.box.x_of(result.z, problem.w(result.z))
    inner = within.start(x)
    assert within.problem.n == np.count_nonzero(~problem.box.fixed)
    assert np.array_equal(problem.box.z_of(within.back(inner)), result.z)
    assert Point(Criterion(within.problem), within.problem.box.z_of(inner)).solves()


@pytest.mark.parametrize("kind", KINDS)
def test_slacks_and_multipliers_stay_positive_and_infeasibility_shrinks(kind: str) -> None:
    within = slack_form(solvable(kind, 24, np.random.default_rng(0), sparse=True))
    steps = Steps(within, AccurateSystems(within.problem.M, systems(within.problem.M, within.S), Regularization()))
    at = steps.start(1.0)
    first = steps.residuals(at).largest
    for _ in range(12):
        before = steps.residuals(at).largest
        if before < 1e-12 * first and steps.mu(at) < 1e-12:
            break  # what the factors leave of later steps is larger
        at, length, _ = steps.next(at)
        assert min(at.s.min(), at.w.min()) > 0
        assert steps.residuals(at).largest <= (1 - length) * before + 1e-2 * before + 1e-8 * first


def test_the_options_change_the_iterates() -> None:
    problem = solvable("program", 24, np.random.default_rng(1), sparse=True)
    runs: list[list[Vector]] = []
    shown = []
    for options in ({}, {"start_slack": 50.0}, {"regularization": 1e-3}):
        trace = Trace()
        assert lcpcli.run(problem, "interior", trace=trace, **options).solved  # type: ignore[arg-type]
        runs.append([row.z for row in trace.rows[1:]])
        shown.append(trace.rows[1].step)
    assert not np.allclose(runs[0][0], runs[1][0])
    assert "rho 1e-08" in shown[0]
    assert "rho 1e-03" in shown[2]


def test_fixed_variables_alone_are_a_solution() -> None:
    result = lcpcli.solve([[0.0, 1.0], [-1.0, 0.0]], [3.0, -5.0], "interior", lower=[1.0, 2.0], upper=[1.0, 2.0])
    assert result.solved
    assert result.z.tolist() == [1.0, 2.0]


def test_systems_of_every_kind_have_the_same_solutions() -> None:
    """Also after the order of the pivots has been kept, and with SuperLU where QDLDL is not installed."""
    random = np.random.default_rng(3)
    n, m = 30, 10
    A, B = (random.standard_normal((m, n - m)) * (random.random((m, n - m)) < 0.3) for _ in range(2))
    M = csr_array(np.block([[B.T @ B, -A.T], [A, np.zeros((m, m))]]))
    S = np.where(np.arange(n) < n - m, 1.0, -1.0)
    all_systems = [systems(M, None), systems(M, S), SuperLU(M), SuperLU(M, pivoting=True), systems(M.toarray(), None)]
    for _ in range(4):
        d, b = random.uniform(0.1, 10, n), random.standard_normal(n)
        expected = np.linalg.solve(M.toarray() + np.diag(d), b)
        for each in all_systems:
            each.factorize(d)
            assert np.abs(each.solve(b) - expected).max() <= 1e-9 * np.abs(expected).max()


def test_a_singular_basis_is_solved_although_diagonal_pivots_lose_the_shift() -> None:
    """Equal rows of equations: the basis [0 -A'; A 0] has rank 2 rather than 4, and QDLDL meets pivots that are 0."""
    A = np.array([[1.0, 2.0, 0.0, 1.0], [1.0, 2.0, 0.0, 1.0], [3.0, 6.0, 0.0, 3.0]])
    c, b = np.array([1.0, 2.0, 1.0, 1.0]), np.array([4.0, 4.0, 12.0])
    M = csr_array(np.block([[np.zeros((4, 4)), -A.T], [A, np.zeros((3, 3))]]))
    lower = np.concatenate((np.zeros(4), np.full(3, -np.inf)))
    problem = Problem(M, np.concatenate((c, -b)), lower=lower)
    result = lcpcli.run(problem, "interior")
    assert result.solved
    assert residual(problem, result.z) <= 1e-13


def test_a_proof_from_a_diverging_iterate_is_rounded_to_one_that_holds_exactly() -> None:
    """A chain x_1 >= x_2 >= ... >= x_n >= x_1 + 1: y is constant, on more columns than are corrected exactly."""
    n = 80
    A = np.eye(n) - np.roll(np.eye(n), 1, axis=1)
    M = csr_array(np.block([[np.zeros((n, n)), -A.T], [A, np.zeros((n, n))]]))
    q = np.concatenate((np.zeros(2 * n - 1), [-1.0]))
    problem = Problem(M, q, lower=np.concatenate((np.full(n, -np.inf), np.zeros(n))))
    result = lcpcli.run(problem, "interior")
    assert result.status is Status.INFEASIBLE
    assert result.certificate is not None
    assert result.certificate.vector is not None
    y = result.certificate.vector[n:]
    assert y.min() == y.max() > 0
