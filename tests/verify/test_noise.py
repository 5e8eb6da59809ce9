"""What rounding left of zeros, in z and in q, keeps no solution from being one; numbers that matter always count."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, check, run
from lcpcli.typing import Vector
from lcpcli.verify.measure import FEW_UNKNOWNS
from lcpcli.verify.point import Criterion, Point

N = 40


def with_noise_in_q(noisy: int = 2, n: int = N, size: float = 2.0**-52) -> Problem:
    """A program in whose last rows, equations of variables that are 0, the right-hand side is rounding of 0."""
    M = np.eye(n)
    M[0, 1:] = 1.0
    q = -np.arange(3.0, n + 3)
    q[0] = -1000.0
    for i in range(n - noisy, n):
        M[i] = 0.0
        M[i, 1], M[1, i] = -1.0, 1.0
        q[i] = -size
    q[1] = 2.0
    lower = np.zeros(n)
    lower[n - noisy :] = -np.inf
    return Problem(M, q, lower=lower)


@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
def test_rounding_of_zero_in_q_is_named_where_it_alone_stands_in_the_way(as_matrix: type) -> None:
    given = with_noise_in_q()
    problem = Problem(as_matrix(given.M), given.q, lower=given.lower)
    result = run(problem, time_limit=10.0)
    assert result.solved
    assert list(result.negligible_q) == [N - 2, N - 1]
    assert result.message == f"solved: counting q{N - 1} = -2.2e-16 and q{N} = -2.2e-16 as 0"
    assert json.loads(result.to_json())["negligible_q"] == [N - 2, N - 1]
    verification = check(problem, result.z)
    assert verification.accepted
    assert f"counting q{N - 1} = -2.2e-16 and q{N} = -2.2e-16 as 0" in verification.message


def test_message_names_three_entries_and_counts_the_others_if_there_are_any() -> None:
    result = run(with_noise_in_q(noisy=6), time_limit=10.0)
    assert len(result.negligible_q) == 6
    assert result.message.endswith("and 3 more of q as 0")
    result = run(Problem([[2.0]], [-1.0]))
    assert (result.message, list(result.negligible_q)) == ("solved", [])


def solution_but_for_noise(problem: Problem) -> Vector:
    result = run(Problem(problem.M, np.where(np.abs(problem.q) < 1e-6, 0.0, problem.q), lower=problem.lower))
    assert result.solved
    return result.z


def test_entries_of_q_that_may_matter_count() -> None:
    few = with_noise_in_q(n=FEW_UNKNOWNS)  # which exact arithmetic decides
    for problem in (few, with_noise_in_q(size=1e-11)):  # which is not as small as rounding
        point = Point(Criterion(problem), solution_but_for_noise(problem))
        assert point.relative_residual == 1.0
        assert point.solution() is None


def test_entry_of_q_counts_beside_other_terms_of_its_row() -> None:
    problem = with_noise_in_q()
    M = problem.M.copy()
    M[N - 1, 5] = 1e-14
    z = solution_but_for_noise(problem)
    assert z[5] > 1.0
    assert Point(Criterion(Problem(M, problem.q, lower=problem.lower)), z).solution() is None


@pytest.mark.parametrize(("size", "many"), [(1e8, 1), (1e12, 5), (1e20, 1)])
def test_a_few_large_numbers_do_not_make_rounding_of_the_others(size: float, many: int) -> None:
    """z = max(-q, 0) solves M = I; one component is wrong altogether."""
    q = np.full(N, -5.0)
    q[:many] = -size
    z = -q
    z[N - 1] = 0.0
    assert Point(Criterion(Problem(np.eye(N), q)), z).solution() is None


@pytest.mark.parametrize(("method", "n"), [("auto", 12), ("newton", 40), ("milp", 21)])
def test_no_row_is_solved_by_the_size_of_another(method: str, n: int) -> None:
    """M_00 asks for a large z_0; two rows, w_1 = z_2 - 1 and w_2 = z_1 + 1, exclude each other."""
    M, q = np.eye(n), np.full(n, -5.0)
    M[0, 1:] = 1.0
    M[1:3, 1:3] = [[0.0, 1.0], [1.0, 0.0]]
    q[:3] = -1e16, -1.0, 1.0
    assert not run(Problem(M, q), method, time_limit=0.1).solved
    z = np.full(n, 5.0)
    z[:3] = 1e16, 0.0, 1.0
    assert not check(Problem(M, q), z).accepted


def test_rows_of_noise_are_cleaned_one_by_one() -> None:
    """w_2 = -z_1 is violated by a z_1 that is rounding of 0; z_5 is as small, and matters."""
    n = 24
    M, q = np.eye(n), -np.full(n, 7.0)
    M[0, 1:], M[1:3] = 1.0, 0.0
    M[2, 1], q[0], q[1], q[2], q[5] = -1.0, -4e4, 0.0, 0.0, -1e-10
    z = np.maximum(-q, 0.0)
    z[0] -= z[3:].sum()
    z[1] = 1e-11
    point = Point(Criterion(Problem(M, q)), z)
    assert not point.solves()
    solution = point.solution()
    assert (solution.z[1], solution.z[5], list(solution.negligible)) == (0.0, 1e-10, [])
