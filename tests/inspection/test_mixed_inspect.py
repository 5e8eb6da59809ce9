"""lcp inspect on mixed problems: what is said to be guaranteed or evident is so."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from scipy.sparse import eye_array

from lcpcli import Problem, run
from lcpcli.inspection.inspection import inspect
from lcpcli.inspection.theory import smoothing
from lcpcli.report import inspection_text

Lcp = Callable[..., Any]

INF = math.inf
COPOSITIVE = [[1, 4], [4, 1]]  # strictly, but neither row sufficient nor a P-matrix
SWAPPED = [[0, 1], [1, 0]]  # copositive, but not copositive-plus


def random_problem(kind: str, random: Generator) -> Problem:
    """Small integers, with bounds of every kind."""
    n = int(random.integers(1, 6))
    A = random.integers(-2, 3, size=(n, n)).astype(float)
    half, S = A[:, : (n + 1) // 2], np.triu(A, 1) - np.triu(A, 1).T
    M = {
        "semidefinite": half @ half.T + S,
        "definite": A @ A.T + 0.5 * np.eye(n) + S,
        "nonnegative": np.abs(A) + np.eye(n),
    }[kind]
    lower = np.where(random.random(n) < 0.3, random.choice([-INF, 0.0]), random.integers(-3, 3, n))
    upper = np.where(np.isinf(lower), 1, lower) + random.choice([0, 1, 3, INF], n)
    return Problem(M, random.integers(-5, 6, n).astype(float), lower=lower, upper=upper)


@pytest.mark.parametrize("kind", ["semidefinite", "definite", "nonnegative"])
def test_methods_said_to_be_guaranteed_solve_the_problem_or_prove_that_it_has_no_solution(kind: str) -> None:
    guaranteed = set()
    for seed in range(10):
        problem = random_problem(kind, np.random.default_rng(seed))
        for method, guarantee in inspect(problem, INF).guarantees.items():
            if guarantee.word == "yes" and method != "shi":  # which rounding may stall
                guaranteed.add(method)
                assert run(problem, method).status.word in ("solved", "infeasible", "unsolvable")
    assert {"auto", "lemke", "milp"} <= guaranteed


SADDLE, TRIANGULAR = [[2, -1], [1, 0]], [[1, 3], [0, 1]]
FREE = {"lower": [0, -INF]}
LARGE = eye_array(2600, format="csr")
GUARANTEED: list[tuple[Any, dict[str, Any], dict[str, str]]] = [
    (COPOSITIVE, {"lower": 0}, {"lemke": "yes"}),
    (COPOSITIVE, {"lower": -1, "upper": [INF, 2]}, {"lemke": "yes"}),
    (COPOSITIVE, {"lower": [-INF, 0], "upper": [3, INF]}, {"lemke": "no"}),  # the standard form has -4
    (COPOSITIVE, FREE, {"lemke": "no"}),
    (SADDLE, FREE, {"lemke": "yes", "newton": "no"}),  # free variables need a semidefinite matrix for lemke
    (TRIANGULAR, FREE, {"lemke": "no", "newton": "yes"}),  # and a P-matrix for newton
    (LARGE, {"upper": 0.5}, {"lemke": "yes"}),  # upper bounds do not count towards its limit
    (eye_array(6000, format="csr"), {"lower": 0}, {"lemke": "no"}),
]


@pytest.mark.parametrize(("M", "bounds", "words"), GUARANTEED, ids=range(len(GUARANTEED)))
def test_what_is_guaranteed_depends_on_bounds_and_size(M: Any, bounds: Any, words: dict[str, str]) -> None:
    found = inspect(Problem(M, -np.ones(np.shape(M)[0]), **bounds), 0.1 if M is LARGE else INF)
    assert {method: found.guarantees[method].word for method in words} == words
    assert M is not COPOSITIVE or found.classes["strictly_copositive"].word == "yes"


def test_evident_solutions_are_said_for_the_bounds() -> None:
    def obvious(q: Any, M: Any = SWAPPED, **bounds: Any) -> str:
        return inspect(Problem(M, q, **bounds), INF).obvious

    assert obvious([-1, -2], lower=0, upper=1) == "there is a solution, as all bounds are finite"
    assert obvious([-1, -2], lower=0, upper=[1, INF]) == ""
    assert obvious([-1, -2], lower=2).startswith("the z within the bounds nearest to 0 is a solution")
    for bounds in ({"lower": None}, {"lower": 1, "upper": 2}):
        assert "exactly one solution, for these and all other bounds" in obvious([-9, -2], np.eye(2) * 3, **bounds)


def test_json_counts_the_kinds_of_variables() -> None:
    mixed = Problem(np.eye(3), np.ones(3), lower=[None, 0, 1], upper=[None, 2, 1])
    shown = json.loads(inspection_text.render(inspect(mixed), "json"))
    assert shown["bounds"] == {"free": 1, "boxed": 1, "fixed": 1}
    assert json.loads(inspection_text.render(inspect(Problem([[1]], [1])), "json"))["bounds"] is None


def test_smoothing_parameter_is_the_one_that_shi_uses() -> None:
    problem = Problem([[2, 1], [1, 2]], [1e-3, 2e-3], lower=1e6)
    assert smoothing(problem).p == run(problem, "shi", max_iterations=1).options["p"]


def test_a_contradiction_that_is_rounding_is_not_stated() -> None:
    """3 * 0.1 is rounded, so that the second row is no multiple of the first one."""
    problem = Problem([[1, 0.1, 1], [3, 3 * 0.1, 3], [1, 2, 4]], [-1, 0, 1], lower=-INF)
    assert run(problem).solved
    found = inspect(problem)
    assert found.presolve is None
    assert json.loads(inspection_text.render(found, "json"))["presolve"] is None
    assert "cannot have its sign" not in repr(found)


def test_presolve_ends_with_the_time_of_an_inspection() -> None:
    problem = Problem([[2, 0], [0, 1]], [1, -1], lower=[0, -INF])
    assert inspect(problem).presolve is not None
    assert inspect(problem, 0).presolve is None
