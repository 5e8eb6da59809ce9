"""Enclosures, exact proofs and checks where rounding, or one wrong sign, would turn them into false ones."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.model.problem import conditions_of
from lcpcli.rational import elimination, numbers
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.solving.no_minimum import Constraints
from lcpcli.verify.certificate import is_clear
from lcpcli.verify.enclosure import enclosure
from lcpcli.verify.farkas import exact_proof, refutes
from lcpcli.verify.measure import Measure, decision
from lcpcli.verify.point import Criterion, Point
from lcpcli.verify.verification import verify

from ..methods.programs import random_program

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
    assert decision(Measure(problem), z, problem.w(z), 1e-10) is False
    assert not Point(Criterion(problem), z).solves()


@pytest.mark.parametrize("seed", range(8))
def test_enclosure_holds_an_exact_solution(seed: int) -> None:
    random = np.random.default_rng(seed)
    k, n = int(random.integers(1, 6)), int(random.integers(6, 12))
    G = random.integers(-9, 10, (k, n)) * np.exp2(random.integers(-30, 30, n))
    y = np.linalg.svd(G)[2][-1]
    d = enclosure(G, y)
    assert d is not None
    changed = np.flatnonzero(d)
    exact = [[Fraction(value) for value in row] for row in G.tolist()]
    residual = [sum(value * Fraction(other) for value, other in zip(row, y.tolist(), strict=True)) for row in exact]
    rows = [[*(row[j] for j in changed), -r] for row, r in zip(exact, residual, strict=True)]
    whole = [numbers.over_one_denominator(row)[0] for row in rows]
    found = elimination.solve([row[:-1] for row in whole], [row[-1] for row in whole]).x
    assert all(abs(change) <= Fraction(d[j]) for change, j in zip(found, changed.tolist(), strict=True))


def test_dependent_equations_and_too_many_have_no_enclosure() -> None:
    assert enclosure(np.array([[1.0, -1.0, 0.0], [2.0, -2.0, 0.0]]), np.array([1.0, 1.0, 1.0])) is None
    assert enclosure(np.ones((3, 2)), np.ones(2)) is None
    none = enclosure(np.ones((0, 2)), np.ones(2))
    assert not none.any()


def constraints_of(seed: int, n: int, kind: str) -> Any:
    problem = random_program(seed, n, kind).problem()
    return problem.origin.program(conditions_of(problem))


@pytest.mark.parametrize("seed", range(6))
def test_no_infeasible_program_is_said_to_have_a_point(seed: int) -> None:
    """Not even near points that violate one constraint by little."""
    sides = Constraints.of(constraints_of(2 * seed, 30, "infeasible"))
    low = np.nan_to_num(sides.low, neginf=0.0)
    x = np.linalg.lstsq(np.asarray(sides.A @ np.eye(sides.A.shape[1])), low, rcond=None)[0]
    assert sides.central_point() is None
    assert not sides.hold_near(x)


def test_point_of_a_program_with_equations_is_shown() -> None:
    data = constraints_of(5, 60, "unbounded")
    assert Constraints.of(data._replace(lower=data.lower - 1.0)).central_point() is not None


def test_farkas_vector_is_corrected_where_no_double_fits() -> None:
    """3 y1 = y2 is asked for with a y1 that is no multiple: only the corrected vector has M'y = 0."""
    y = np.array([np.pi, 3 * np.pi * (1 + 1e-12)])
    assert exact_proof(ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 1])), y) is None  # q'y = 2 y1 > 0
    data = ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 0.25]))
    found = exact_proof(data, y)
    assert data.refuted_by(found)
    assert found[1] == 3 * found[0]


def test_farkas_vector_is_found_where_rounding_has_made_columns_independent() -> None:
    """10 y1 = y2 in decimals, but as doubles 0.1 and 0.3 make M nonsingular: M'y = 0 has no solution, M'y < 0 has."""
    problem, y = Problem([[1, 3], [-0.1, -0.3]], [-1, 0]), np.array([0.1, 1.0])
    assert exact_proof(ExactProblem.of_decimals(problem), y) == [1, 10]
    data = ExactProblem.of_floats(problem)
    found = exact_proof(data, y)
    assert data.refuted_by(found)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_an_enclosure_is_as_wide_as_the_solution_is_far_in_the_units_of_y(size: float) -> None:
    """y1 = y2 takes a change of at least |y1 - y2|."""
    y = size * np.array([1.0, 1.25, 3.0])
    change = enclosure(np.array([[1.0, -1.0, 0.0]]), y)
    assert change is not None
    assert 0.25 * size <= change[:2].sum() <= 0.6 * size
    assert change[2] == 0
