"""Presolve knows whether it may have rounded, and its ways back keep the signs of rows and both bounds."""

from __future__ import annotations

import numpy as np

from lcpcli import Problem
from lcpcli.presolve.presolve import presolved
from lcpcli.presolve.rules import repeated_equations, signs_of_equations
from lcpcli.presolve.system import System
from lcpcli.verify.certificate import proves_infeasible

INF = np.inf


def test_what_is_exact_is_known() -> None:
    for a, is_it in ((1, True), (3, False)):
        problem = Problem([[2, a, 0], [-a, 0, 0], [0, 0, 2]], [-6, 2, 1], lower=[-INF, 0, 0], upper=INF)
        change = presolved(problem, ["rows that are bounds"])
        assert change.is_exact is is_it


def test_what_counts_as_rounding_is_not_exact() -> None:
    """q_1 = 1 counts as rounding of 2^49."""
    size, most = 2.0**20, 2.0**20 - 1
    M = np.eye(4)
    M[0] = [1, 0, 2**9, -(2**9)]
    M[2:, 1] = -size
    change = presolved(Problem(M, [1, -most, 0, 0], lower=[0, -INF, -INF, -INF]))
    assert change.problem.q.tolist() == [0]
    assert not change.is_exact


def test_sums_of_large_entries_are_not_exact() -> None:
    for size, is_it in ((3.0, True), (2.0**20, False)):
        system = System(Problem([[1, 0, 1], [-size, 1, 0], [1, -size, 1]], np.ones(3), lower=[0, -INF, -INF]))
        system.pivot(np.array([1]), np.array([1]), np.ones(1))
        assert system.keeps_all is is_it


def test_entries_that_rounding_moved_from_their_mirror_images_are_not_exact() -> None:
    size = 2.0**20
    for entry, is_it in ((size, True), (size + 2.0**-25, False)):
        system = System(Problem([[0, -size], [entry, 0]], [1, 1], lower=[0, -INF]))
        assert list(signs_of_equations(system)) == []
        assert system.keeps_all is is_it


def test_equations_that_are_repeated_but_for_rounding_are_not_exact() -> None:
    for difference, is_it in ((0.0, True), (1e-12, False)):
        M = [[0, 1, 1], [1, 0, 0], [1, 0, 0]]
        system = System(Problem(M, [1, -3, difference - 3], lower=[0, -INF, -INF]))
        assert len(list(repeated_equations(system))) == 1
        assert system.keeps_all is is_it


def test_a_proof_is_of_the_rows_as_they_were_where_presolve_has_turned_one() -> None:
    """z1 + z2 + 1 = 0 for a free z1 with z1 >= 0 as a row: the sign of the equation is turned before it is refuted."""
    problem = Problem([[1, 1], [1, 0]], [1, 0], lower=[-np.inf, 0], upper=[np.inf, np.inf])
    found = presolved(problem)
    assert found.y.tolist() == [-1, 1]
    assert proves_infeasible(problem, found.y)


def test_a_row_of_its_own_variable_is_solved_within_both_bounds() -> None:
    problem = Problem([[1, 0], [1, 1]], [-5, -4], lower=[0, 0], upper=[2, 9])
    change = presolved(problem, ("rows of their own variable",))
    nothing = np.zeros(change.problem.n)
    z = problem.box.z_of(change.back(change.problem.box.x_of(nothing, nothing)))
    assert z.tolist() == [2, 2]


def test_rows_that_are_multiplied_twice_have_both_factors() -> None:
    system = System(Problem([[2.0, 1.0], [1.0, 3.0]], [1.0, -4.0], lower=-INF))
    system.multiply(np.array([-1.0, 2.0]))
    system.multiply(np.array([4.0, 0.5]))
    assert system.factors.tolist() == [-4.0, 1.0]
    assert system.q.tolist() == [-4.0, -4.0]


def test_several_pivots_at_once_leave_the_schur_complement_and_multipliers_that_cancel_their_columns() -> None:
    M = np.array([[4.0, 3, 1, 2], [1, 5, -2, 3], [0, 2, 7, -1], [8, 0, 3, 5]])
    q, rows, columns = np.array([1.0, -2, 3, -4]), np.array([3, 2]), np.array([0, 1])
    system = System(Problem(M, q, lower=-INF))
    step = system.pivot(rows, columns, M[rows, columns])
    left = np.zeros((4, 4))
    left[system.entries.rows, system.entries.columns] = system.entries.values
    rest, others = np.array([0, 1]), np.array([2, 3])
    factor = M[np.ix_(rest, columns)] / M[rows, columns]
    assert np.allclose(left[np.ix_(rest, others)], M[np.ix_(rest, others)] - factor @ M[np.ix_(rows, others)])
    assert np.allclose(system.q[rest], q[rest] - factor @ q[rows])
    y = np.array([2.0, -3, 0, 0])
    step.carry(y)
    assert np.allclose((M.T @ y)[columns], 0)
