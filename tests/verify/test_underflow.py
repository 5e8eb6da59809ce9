"""Products that underflow hide no violation: not in the measure, nor where small problems are solved at once."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli import Problem, check, run, solve_many
from lcpcli.linalg.rounding import may_underflow, row_errors
from lcpcli.verify.point import Criterion, Point

from .. import exact_measure


def chain(n: int, small: float = 1e-300) -> Problem:
    """z_0 = 1e-30, and small z_i >= small z_(i-1) for those that follow, but z_n = 0 for the last of n: it only keeps
    the rows moderate. The only solution is (1e-30, ..., 1e-30, 0)."""
    M, q = np.eye(n), np.zeros(n)
    for i in range(1, n - 1):
        M[i, i - 1 : i + 1] = -small, small
        M[i, -1] = 1.0
    q[0], q[-1] = -1e-30, 1.0
    return Problem(M, q)


def solution(n: int) -> list[float]:
    return [1e-30] * (n - 1) + [0.0]


@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
@pytest.mark.parametrize("n", [3, 8])
def test_the_only_solution_is_found(n: int, as_matrix: type) -> None:
    problem = chain(n)
    result = run(Problem(as_matrix(problem.M), problem.q))
    assert result.solved
    assert result.z.tolist() == solution(n)


@pytest.mark.parametrize("n", [3, 30, 120])
@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
def test_point_with_hidden_violations_does_not_solve(n: int, as_matrix: type) -> None:
    M, q = as_matrix(chain(n).M), chain(n).q
    z = np.append(1e-30, np.zeros(n - 1))
    for problem in (Problem(M, q), Problem(M, q, upper=np.full(n, 1e-3))):
        assert not Point(Criterion(problem), z).solves()
        assert not check(problem, z).accepted


@pytest.mark.parametrize("module", ["direct", "compiled"])
def test_small_problems_are_not_solved_at_once_where_a_product_underflows(module: str) -> None:
    found = pytest.importorskip(f"lcpcli.methods.{module}").direct(chain(30), 1e-10)
    assert found is None or not found.is_certain or found.z.tolist() == solution(30)


@pytest.mark.parametrize(("columns", "compiled"), [(3, False), (40, False), (40, True)])
def test_many_right_hand_sides_are_judged_alike(columns: int, compiled: bool) -> None:
    problem = chain(3)
    for result in solve_many(problem.M, np.tile(problem.q[:, np.newaxis], (1, columns)), compiled=compiled):
        assert result.solved
        assert result.z.tolist() == solution(3)


def triangular(random: np.random.Generator) -> tuple[Problem, list[Fraction]]:
    """A lower triangular M with a positive diagonal, numbers of very different sizes, and the only solution."""
    n = int(random.integers(2, 9))
    M = np.tril(random.integers(-2, 3, (n, n)) * 10.0 ** random.choice([0, -150, -300], (n, n)), -1)
    M += np.diag(10.0 ** random.choice([0, -150, -300], n))
    q = -random.integers(0, 3, n) * 10.0 ** random.choice([0, -30, -200], n)
    z: list[Fraction] = []
    for i in range(n):
        w = Fraction(q[i]) + sum(Fraction(M[i, j]) * value for j, value in enumerate(z))
        z.append(max(-w / Fraction(M[i, i]), Fraction(0)))
    return Problem(M, q), z


@pytest.mark.parametrize("seed", range(30))
def test_what_is_solved_is_the_only_solution(seed: int) -> None:
    problem, solution = triangular(np.random.default_rng(seed))
    result = run(problem, time_limit=0.2)
    assert result.solved or any(value and not 1e-250 < value < 1e250 for value in solution)
    if result.solved:
        last_digits = all(abs(Fraction(a) - b) <= b / 2**50 for a, b in zip(result.z.tolist(), solution, strict=True))
        assert last_digits or exact_measure.relative_residual(problem, result.z) <= 1e-10


def test_bounds_on_rounding_errors_count_products_that_underflow() -> None:
    M, z = np.array([[1e-300, 0.0], [1.0, 1.0]]), np.array([1e-30, 0.0])
    terms = np.abs(M) @ z
    assert terms[0] == 0
    errors = row_errors(M, z, terms)
    assert 0 < Fraction(1e-300) * Fraction(1e-30) <= errors[0] < 1e-300
    assert may_underflow(M, z)
    assert not may_underflow(M, np.array([1.0, 0.0]))
    assert row_errors(M, np.array([0.0, 1.0]), np.zeros(2)).tolist() == [0.0, pytest.approx(0.0, abs=1e-307)]


def test_bound_that_underflows_in_other_units_is_a_bound_still() -> None:
    """z_0 has to rise to u_0 = 1e-100; in units in which the other numbers are moderate, u_0 would be 0."""
    M = [[0.0, 0.0, 0.0, -2e-300], [0.0, 1e-300, 0.0, 1e-150], [0.0, 0.0, 0.0, 1.0], [2e-300, -1e-150, -1.0, 0.0]]
    problem = Problem(M, [-1e-200, 1.0, -2e-200, 0.0], lower=0.0, upper=[1e-100, np.inf, np.inf, np.inf])
    assert not check(problem, [0.0, 0.0, 0.0, 2e-200]).accepted
    result = run(problem, time_limit=0.2)
    assert not result.solved or result.z[0] == 1e-100
