"""Relaxed reflections: their projections are the nearest points, and they find solutions that pivoting does not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli import Status, solve
from lcpcli import run as run_method
from lcpcli.methods.reflections import _Iteration
from lcpcli.model.box import ORTHANT, Box
from lcpcli.typing import Vector

from .planted import solvable

INFINITY = math.inf


def planted(n: int, seed: int, density: float = 1.0) -> tuple[Vector, Vector]:
    """A normal M, or one with a share of its entries, and q for which z and w have half of their entries each."""
    random = np.random.default_rng(seed)
    M = random.standard_normal((n, n))
    M *= random.random((n, n)) < density
    basic = random.random(n) < 0.5
    z, w = np.where(basic, random.random(n) + 0.1, 0), np.where(basic, 0, random.random(n) + 0.1)
    return M, w - M @ z


@pytest.mark.parametrize(
    ("n", "seed"), [(60, 0), (60, 1), pytest.param(300, 1, marks=pytest.mark.slow("many unknowns"))]
)
def test_planted_problems_that_pivoting_does_not_solve_are_solved(n: int, seed: int) -> None:
    M, q = planted(n, seed)
    assert solve(M, q, "reflections").solved
    assert n > 60 or not solve(M, q, "newton", max_iterations=500).solved


@pytest.mark.parametrize("seed", range(2))
def test_sparse_problems_and_those_with_bounds_and_free_variables_are_solved(seed: int) -> None:
    M, q = planted(60, seed, 0.15)
    assert solve(csr_array(M), q, "reflections").solved
    assert run_method(solvable("any", 40, np.random.default_rng(seed)), "reflections").solved


@pytest.mark.parametrize(("rows", "columns", "q"), [(2.0**20, 1.0, 1.0), (1.0, 2.0**-20, 1.0), (1.0, 1.0, 2.0**20)])
def test_planted_problems_in_other_units_are_solved(rows: float, columns: float, q: float) -> None:
    M, given = planted(40, 1)
    one = np.random.default_rng(0).random(40) < 0.5
    R, C = np.where(one, rows, 1.0), np.where(one, columns, 1.0)
    assert solve(R[:, None] * M * C, q * R * given, "reflections").solved


@pytest.mark.parametrize("option", [{"beta": 0.3}, {"walkers": 3}, {"seed": 5}])
def test_each_option_has_an_effect(option: dict[str, float]) -> None:
    M, q = planted(60, 3)
    assert solve(M, q, "reflections", **option).evaluations != solve(M, q, "reflections").evaluations


def test_nothing_is_claimed_where_there_is_no_solution_or_there_are_no_units_in_which_to_search() -> None:
    result = solve([[-1.0, 0.0], [0.0, 1.0]], [-1.0, -1.0], "reflections", max_iterations=50)
    assert (result.status, result.certificate) == (Status.ITERATION_LIMIT, None)
    assert solve([[0.0]], [-1.0], "reflections").status is Status.BREAKDOWN


BOXES = {
    "orthant": (0.0, INFINITY),
    "box": (-1.0, 0.5),
    "free": (-INFINITY, INFINITY),
    "upper": (-INFINITY, 0.25),
    "fixed": (0.5, 0.5),
}


@pytest.mark.parametrize("kind", BOXES)
@settings(max_examples=50)
@given(z=st.floats(-3, 3, width=32), w=st.floats(-3, 3, width=32))
def test_the_nearest_complementary_point_is_nearer_than_all_others(kind: str, z: float, w: float) -> None:
    lower, upper = BOXES[kind]
    box = ORTHANT if kind == "orthant" else Box(np.array([lower]), np.array([upper]))
    iteration = _Iteration(np.eye(1), np.zeros(1), box, 1)
    iteration.step(np.array([[z], [w]], np.float32))
    found = iteration.nearest[:, 0]
    free_w = lower == upper
    others = [(min(max(z, lower), upper), 0.0)]
    others += [(lower, w if free_w else max(w, 0.0))] * (lower > -INFINITY)
    others += [(upper, w if free_w else min(w, 0.0))] * (upper < INFINITY)
    assert any(np.allclose(found, other) for other in others)
    least = min(np.hypot(z - a, w - b) for a, b in others)
    assert np.hypot(z - found[0], w - found[1]) <= least + 1e-5
