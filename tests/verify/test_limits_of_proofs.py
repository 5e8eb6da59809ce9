"""Proofs and checks at the limits where rounding, or one wrong sign, would turn them into false ones."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from lcpcli import Problem
from lcpcli.verify.certificate import is_clear
from lcpcli.verify.cheap_bounds import surely_solve
from lcpcli.verify.enclosure import enclosure
from lcpcli.verify.farkas import refutes
from lcpcli.verify.matrix_classes import lower_image
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.verification import verify

INF = np.inf


def test_a_contradiction_by_less_than_rounding_is_not_clear() -> None:
    problem = Problem([[0, 0], [1, 0]], [0, -2 - 1e-12], lower=[0, 0], upper=[2, INF])  # z1 >= 2 + 1e-12
    assert not is_clear(problem, np.array([0.0, 1.0]))


def test_an_enclosure_covers_what_doubles_lose_in_a_sum() -> None:
    G, y = np.array([[1.0, 2.0**-60, -1.0]]), np.ones(3)  # G y is 2^-60, and 0 in doubles
    d = enclosure(G, y)
    covered = sum(abs(Fraction(g)) * Fraction(e) for g, e in zip(G[0].tolist(), d.tolist(), strict=True))
    assert covered >= Fraction(1, 2**60)


def test_a_vector_that_nearly_annihilates_the_columns_of_free_variables_refutes_nothing() -> None:
    e = 2.0**-29  # both columns vanish for (1, 1.9, -1) alone, and nearly for (1, 1.9, 1)
    first, second = np.array([1.0, 1.0]), np.array([-1 / 1.9 + e, -1 / 1.9 - e])
    M = np.column_stack((np.array([first, second, first + 1.9 * second]), [-1.0, -1.0, 0.0]))
    problem = Problem(M, [-1, -1, 0], lower=[-INF, -INF, 0], upper=[INF] * 3)
    z = np.append(np.linalg.solve(M[:2, :2], [1, 1]), 0.0)
    assert problem.w(z)[2] > 1  # it is feasible
    assert not refutes(problem.M, problem.q, np.array([1.0, 1.9, 1.0]), problem.box)


def test_a_free_variable_may_exploit_the_least_deviation_of_its_column() -> None:
    d = 2.0**-52
    problem = Problem([[1, 1], [-1 - d, -1]], [-1, 0], lower=[-INF, 0], upper=[INF, INF])
    z = np.array([1 - 2.0**53, 2.0**53])  # it satisfies the inequalities, as (M'y)_1 is -d
    w = [sum(map(Fraction.__mul__, map(Fraction, row), map(Fraction, z))) for row in problem.M.tolist()]
    assert w[0] - 1 == 0
    assert w[1] > 0
    assert not refutes(problem.M, problem.q, np.ones(2), problem.box)


def test_a_variable_with_a_far_bound_may_exploit_what_doubles_lose() -> None:
    M = np.zeros((4, 4))  # (M'y)_1 is 2^-60 for y = (0, 1, 1, 1), 0 in doubles, and z1 goes up to 2^66
    M[1:, 0], M[1:, 1], M[1:, 2] = (1, 2.0**-60, -1), (1, -1, 0), (-1, 0, 1)
    problem = Problem(M, [0, -1, 0, 0], lower=[0] * 4, upper=[2.0**66, INF, INF, INF])
    z = np.array([2.0**61, 1, 2.0**61, 0])
    assert (problem.M[1:] @ z + problem.q[1:] >= 0).all()
    assert not refutes(problem.M, problem.q, np.array([0.0, 1, 1, 1]), problem.box)


def test_a_positive_z_beside_a_positive_w_is_refused_however_small_it_is() -> None:
    assert not verify(Problem([[1]], [1]), np.array([1e-6]), 1e-10).accepted


def test_rows_of_another_part_of_the_problem_are_no_measure() -> None:
    M, q = np.eye(22), np.full(22, -1e12)
    M[:2, :2], q[:2] = [[1, -1], [-1, 1]], -1.0  # these two have no solution, and are no part of the rest
    problem, z = Problem(M, q), np.full(22, 1e12)
    assert not surely_solve(problem, z, problem.w(z), 1e-10)
    assert not Point(Criterion(problem), z).solves()


def test_the_lower_image_of_a_comparison_matrix_is_rounded_down() -> None:
    M = np.array([[1.0, -1.0, -(2.0**-60)]] * 3)
    M[[1, 2]] = np.eye(3)[[1, 2]]
    exact = Fraction(1) - 1 - Fraction(1, 2**60)  # row 1 of <M> d for d = (1, 1, 1)
    assert Fraction(lower_image(M, M.diagonal(), np.ones(3))[0]) <= exact
