"""What is decided of a point in exact arithmetic is worth the time that it takes."""

from functools import partial

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from numpy.random import default_rng

import lcpcli
from lcpcli import Problem, Status, from_qp
from lcpcli.linalg.doubles import ROUNDING
from lcpcli.rational import elimination
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.proof import prove
from lcpcli.verify import farkas
from lcpcli.verify.exact_solution import is_rounded_solution


def linear_program(m, n):
    generator = default_rng(0)
    A = generator.standard_normal((m, n))
    x = np.where(generator.random(n) < m / n / 2, generator.random(n), 0.0)
    y = np.where(generator.random(m) < 0.5, generator.random(m), 0.0)
    b = A @ x - np.where(y > 0, 0, generator.random(m))
    c = A.T @ y + np.where(x > 0, 0, generator.random(n))
    return from_qp(None, c, A, row_lower=b, lower=0)


@pytest.fixture
def sizes(monkeypatch):
    """The sizes of the systems that are solved exactly."""
    found = []
    real = elimination.solve

    def solve(A, right):
        found.append(len(A))
        return real(A, right)

    monkeypatch.setattr(elimination, "solve", solve)
    return found


def test_no_system_is_solved_exactly_for_a_wrong_point(sizes):
    """Hundreds of unknowns took up to minutes: 12 s for a program of 300 rows."""
    problem = linear_program(100, 150)
    z = lcpcli.run(problem).z
    z *= 1 + 1e-9 * default_rng(1).standard_normal(z.size)
    assert not lcpcli.check(problem, z).accepted
    assert sizes == []


def test_what_would_take_long_is_undecided_and_not_refused():
    M = np.array([[3.0, 1.0], [1.0, 7.0]])
    problem = Problem(M, [-1.0, -1.0])
    z = lcpcli.solve(problem.M, problem.q).z
    assert is_rounded_solution(problem, z)
    assert is_rounded_solution(problem, z, Effort(0.0)) is None
    assert is_rounded_solution(problem, 2 * z, Effort(0.0)) is False


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 12), ulps=st.integers(0, 2))
def test_rounded_solutions_are_recognized(seed, n, ulps):
    """M = L L' with small integers, and an integer solution moved by units in the last
    place: the test by a product rules none out."""
    generator = np.random.default_rng(seed)
    L = np.tril(generator.integers(-3, 4, (n, n)), -1) + np.eye(n)
    z = np.where(generator.random(n) < 0.7, generator.integers(1, 9, n), 0.0)
    z[0] = max(z[0], 1.0)
    M, w = L @ L.T, np.where(z > 0, 0, generator.integers(1, 9, n))
    problem = Problem(M, w - M @ z)
    moved = z * (1 + ulps * 2.0**-52)
    assert ulps * 2.0**-52 <= ROUNDING
    assert is_rounded_solution(problem, moved)
    assert not is_rounded_solution(problem, z * (1 + 8 * ROUNDING))


def random_without_solution():
    """The first random problem of 11 unknowns that is feasible and has no solution."""
    for seed in range(1000):
        generator = default_rng(seed)
        problem = Problem(
            generator.integers(-9, 10, (11, 11)), generator.integers(-9, 10, 11)
        )
        if lcpcli.run(problem).status is Status.UNSOLVABLE:
            return problem
    raise AssertionError


def blocks_of(number, seed):
    """A positive definite matrix with blocks of 4 unknowns."""
    generator = default_rng(seed)
    parts = []
    for _ in range(number):
        M = generator.integers(-5, 6, (4, 4)).astype(float)
        parts.append(M @ M.T + np.eye(4))
    return Problem(sp.block_diag(parts).tocsr(), generator.integers(-9, 10, 4 * number))


def test_connected_parts_are_decided_apart(monkeypatch):
    """More unknowns are basic than are solved at once, in parts of 4."""
    monkeypatch.setattr(farkas, "max_exact_unknowns", lambda: 20)
    problem = blocks_of(20, 0)
    assert np.count_nonzero(lcpcli.run(problem).z) > 20
    exact = lcpcli.exact(problem).exact
    assert exact.status is Status.SOLVED
    rounded = np.array([float(value) for value in exact.z])
    assert is_rounded_solution(problem, rounded)
    wrong = rounded.copy()
    wrong[wrong.argmax()] *= 1 + 1e-9
    assert not is_rounded_solution(problem, wrong)


def test_a_part_without_a_solution_decides_the_whole():
    """One of 11 unknowns that is feasible and has none, after 30 that have two
    solutions each."""
    hard = random_without_solution()
    problem = Problem(
        sp.block_diag((-np.eye(30), hard.M)).toarray(),
        np.concatenate((np.ones(30), hard.q)),
    )
    # Which shows nothing.
    run = lcpcli.run(problem, "newton", max_iterations=1)
    found = prove(partial(ExactProblem.of_floats, problem), run)
    assert found.exact.status is Status.UNSOLVABLE
