"""Enclosures hold exact solutions, and what they show of programs is true."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from lcpcli.model.problem import conditions_of
from lcpcli.model.program import Program
from lcpcli.rational import elimination, numbers
from lcpcli.solving.no_minimum import Constraints
from lcpcli.verify.enclosure import enclosure

from ..methods.programs import random_program


@pytest.mark.parametrize("seed", range(20))
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
    assert found is not None
    assert all(abs(change) <= Fraction(d[j]) for change, j in zip(found, changed.tolist(), strict=True))


def test_dependent_equations_and_too_many_have_no_enclosure() -> None:
    assert enclosure(np.array([[1.0, -1.0, 0.0], [2.0, -2.0, 0.0]]), np.array([1.0, 1.0, 1.0])) is None
    assert enclosure(np.ones((3, 2)), np.ones(2)) is None
    none = enclosure(np.ones((0, 2)), np.ones(2))
    assert none is not None
    assert not none.any()


@pytest.mark.parametrize("seed", range(12))
def test_no_infeasible_program_is_said_to_have_a_point(seed: int) -> None:
    """Not even near points that violate one constraint by little."""
    problem = random_program(2 * seed, 30, "infeasible").problem()
    assert isinstance(problem.origin, Program)
    data = problem.origin.program(conditions_of(problem))
    assert data is not None
    sides = Constraints.of(data)
    x = np.linalg.lstsq(np.asarray(sides.A @ np.eye(data.c.size)), np.nan_to_num(sides.low, neginf=0.0), rcond=None)[0]
    assert sides.central_point() is None
    assert not sides.hold_near(x)


def test_point_of_a_program_with_equations_is_shown() -> None:
    problem = random_program(5, 60, "unbounded").problem()
    assert isinstance(problem.origin, Program)
    data = problem.origin.program(conditions_of(problem))
    assert data is not None
    sides = Constraints.of(data._replace(lower=data.lower - 1.0))
    point = sides.central_point()
    assert point is not None
