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
from lcpcli.errors import OptionError
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


@pytest.mark.parametrize("seed", range(3))
def test_planted_problems_that_pivoting_does_not_solve_are_solved(seed: int) -> None:
    M, q = planted(60, seed)
    assert solve(M, q, "reflections").solved
    assert not solve(M, q, "newton", max_iterations=500).solved


@pytest.mark.slow("several hundred unknowns")
def test_a_planted_problem_of_several_hundred_unknowns_is_solved() -> None:
    M, q = planted(300, 1)
    assert solve(M, q, "reflections").solved


@pytest.mark.parametrize("seed", range(3))
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


OUT_OF_RANGE = {
    "reflections": {"beta": (2.0, 0.0), "walkers": (0,), "seed": (-1,)},
    "fixed-point": {"omega": (0.0, "best", True), "anderson": (-1, 0.5, "auto")},
    "shi": {"p": (0.0, math.inf, math.nan), "k_star": (0,), "rho": (0.5, 0.0), "sigma": (1.0, 1e-4)},
}


@pytest.mark.parametrize("method", OUT_OF_RANGE)
def test_options_of_this_method_and_others_out_of_range_are_refused(method: str) -> None:
    for option, values in OUT_OF_RANGE[method].items():
        for value in values:
            with pytest.raises(OptionError, match=f"^{option}"):
                solve([[1.0]], [-1.0], method, **{option: value})


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


@given(st.integers(0, 10_000), st.integers(1, 8))
def test_reflected_points_are_projected_onto_the_affine_set(seed: int, n: int) -> None:
    random = np.random.default_rng(seed)
    G, g, X = random.normal(size=(n, n)), random.normal(size=n), random.normal(size=(2 * n, 3)).astype(np.float32)
    iteration = _Iteration(G, g, ORTHANT, 3)
    change = iteration.step(X)
    reflected, projected = 2 * iteration.nearest - X, change + iteration.nearest
    z, w = np.split(projected, 2)
    np.testing.assert_allclose(w, G @ z + g[:, None], atol=1e-3)
    directions = np.vstack((np.eye(n), G))  # along the set
    np.testing.assert_allclose(directions.T @ (reflected - projected), 0, atol=2e-3)
