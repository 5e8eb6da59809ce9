"""Derivatives of solutions: against differences of exact solutions, reverse against forward, and refusals."""

from __future__ import annotations

import pickle
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem
from lcpcli.errors import DerivativeError, ProblemError
from lcpcli.gallery import families
from lcpcli.linalg.matrices import dense

from .differences import exact_derivative, random_change, random_problem


def pairing(gradient: Any, change: dict[str, Any]) -> float:
    """The sum of the products of all derivatives with the changes."""
    return sum(float(np.sum(dense(getattr(gradient, name[1:])) * dense(move))) for name, move in change.items())


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 40])
@pytest.mark.parametrize("mixed", [False, True])
def test_derivatives_by_all_data_are_those_of_the_exact_solutions(n: int, mixed: bool) -> None:
    for seed in range(4 if n < 10 else 1):
        random = np.random.default_rng(seed)
        problem = random_problem(n, random, mixed)
        change = random_change(problem, random)
        result = lcpcli.run(problem)
        for one in ({"dM": change["dM"]}, {"dq": change["dq"]}, change):
            found, known = result.derivative(**one), exact_derivative(problem, one)
            assert (found.kinks, found.strongly_regular) == ([], True)
            assert np.abs(found.z - known).max() <= (1e-12 if n < 10 else 1e-11) * np.abs(known).max()


@pytest.mark.parametrize(("seed", "sparse"), [*product(range(8), (False, True))])
def test_gradient_is_the_adjoint_of_the_derivative(seed: int, sparse: bool) -> None:
    random = np.random.default_rng(seed)
    problem = random_problem(int(random.integers(1, 40)), random, mixed=seed % 2 > 0)
    change: dict[str, Any] = random_change(problem, random)
    if sparse:
        pattern = np.eye(problem.n) + (random.random((problem.n, problem.n)) < 0.2) > 0
        M = csr_array(problem.M * pattern + 10 * np.eye(problem.n))
        problem = Problem(M, problem.q, lower=problem.lower, upper=problem.upper)
        change["dM"] = csr_array(change["dM"] * (M.toarray() != 0))
    result, g = lcpcli.run(problem), random.normal(size=problem.n)
    gradient, derivative = result.gradient(g), result.derivative(**change)
    if sparse:
        assert np.array_equal(gradient.M.indices, problem.M.indices)
        assert np.array_equal(gradient.M.indptr, problem.M.indptr)
    sizes = {name: abs(move) for name, move in change.items()}
    terms = abs(pairing(gradient, sizes)) + np.abs(g) @ np.abs(derivative.z)
    assert abs(pairing(gradient, change) - g @ derivative.z) <= 1e-11 * terms
    w = dense(change["dM"]) @ result.z + change["dq"] + problem.M @ derivative.z
    assert np.abs(w - derivative.w).max() <= 1e-11 * np.abs(w).max(initial=1.0)


BAD = {
    "g: has 2 entries for 3 unknowns": {"g": [1, 2]},
    "dM: is 2 x 2 but q has 3 entries": {"dM": np.eye(2)},
    "dq: has 2 entries for 3 unknowns": {"dq": [1, 2]},
    "dq[1]: is not a finite number": {"dq": [1, np.nan, 2]},
    "dlower[1]: is 1, but there is no such bound": {"dlower": [0, 1, 0]},
    "dupper[0]: is 2, but there is no such bound": {"dupper": [2, 0, 0]},
    "dlower[2]: is 1 and dupper[2] is 0, but lower[2] = upper[2]": {"dlower": [0, 0, 1]},
}


@pytest.mark.parametrize("message", BAD)
def test_what_cannot_be_used_is_one_clear_error(message: str) -> None:
    result = lcpcli.solve(np.eye(3), [1, 2, 3], lower=[0, None, 1], upper=[None, None, 1])
    with pytest.raises(ProblemError) as caught:
        (result.gradient if "g" in BAD[message] else result.derivative)(**BAD[message])
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_result_that_is_not_solved_has_no_derivative() -> None:
    result = lcpcli.solve([[0, 1], [1, 0]], [-1, 1])
    with pytest.raises(DerivativeError, match="no derivative, as the problem is not solved: has no solution"):
        result.derivative(dq=[1, 0])
    with pytest.raises(DerivativeError, match="not solved"):
        result.gradient([1, 0])


def test_fixed_variables_move_with_both_bounds_and_the_sides_of_the_gradient_add_up() -> None:
    result = lcpcli.solve([[2, 1], [1, 2]], [-5, -6], lower=[1, 0], upper=[1, None])
    found = result.derivative(dlower=[2, 0], dupper=[2, 0])
    assert found.z.tolist() == [2.0, -1.0]
    gradient = result.gradient([0, 1])
    assert (gradient.lower + gradient.upper).tolist() == [-0.5, 0.0]


def test_only_and_no_basic_variables() -> None:
    one = lcpcli.solve([[4]], [-2])
    assert one.derivative(dM=[[1]], dq=[1]).z.tolist() == [-0.375]
    assert one.gradient([1]).M.tolist() == [[-0.125]]
    zero = lcpcli.solve([[4, 1], [1, 4]], [2, 1])
    found = zero.derivative(dM=np.ones((2, 2)), dq=[1, 1], dlower=[1, 0])
    assert (found.z.tolist(), found.w.tolist(), found.kinks) == ([1, 0], [5, 2], [])
    assert zero.gradient([1, 1]).lower.tolist() == [1, 1]
    assert not zero.gradient([1, 1]).M.any()


@pytest.mark.parametrize("method", ["shi", "fixed-point", "interior", "auto"])
def test_derivatives_do_not_depend_on_the_method_that_solved_the_problem(method: str) -> None:
    problem = families.make("tridiagonal", 30)
    known = lcpcli.run(problem).derivative(dq=np.ones(30))
    found = lcpcli.run(problem, method, tol=1e-8).derivative(dq=np.ones(30))
    assert np.abs(found.z - known.z).max() <= 1e-11 * np.abs(known.z).max()


def test_results_of_columns_are_pickled_with_their_derivatives() -> None:
    M, Q = np.array([[4.0, 1.0], [1.0, 4.0]]), np.array([[-1.0, 1, 2, -3, 1], [1.0, -2, 3, -4, 5]])
    for result in lcpcli.solve_many(M, Q):
        gradient = result.gradient([1.0, 2.0])
        again = pickle.loads(pickle.dumps(result)).gradient([1.0, 2.0])
        assert gradient.q.tolist() == again.q.tolist()
        assert pickle.loads(pickle.dumps(gradient)).M.tolist() == gradient.M.tolist()


def test_large_obstacle_has_a_gradient_in_the_pattern_of_its_matrix() -> None:
    result = lcpcli.run(families.make("obstacle", 2500))
    gradient = result.gradient(np.ones(result.problem.n))
    assert gradient.M.nnz == result.problem.M.nnz
    d = np.cos(np.arange(result.problem.n))
    assert gradient.q @ d == pytest.approx(result.derivative(dq=d).z.sum(), rel=1e-9)


def test_projection_on_a_simplex_has_its_known_derivative() -> None:
    """x is the point next to p: dx = dp - mean(dp) on the support of x, else 0 (J. Duchi and others 2008)."""
    p, d = np.array([0.9, 0.5, -0.2, 0.3, 0.1]), np.array([1.0, -2, 3, 4, -5])
    result = lcpcli.run(lcpcli.from_qp(np.eye(5), -p, np.ones((1, 5)), row_lower=1, row_upper=1, lower=0))
    support = result.answer.x > 0
    assert support.tolist() == [True, True, False, True, False]
    known = np.where(support, d - d[support].mean(), 0.0)
    change = np.zeros(result.problem.n)
    change[:5] = -d
    assert result.derivative(dq=change).z[:5] == pytest.approx(known, abs=1e-14)
    g = np.zeros(result.problem.n)
    g[:5] = [3.0, 1, 4, 1, 5]
    assert -result.gradient(g).q[:5] @ d == pytest.approx(g[:5] @ known, abs=1e-13)
