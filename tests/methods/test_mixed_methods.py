"""Every method on problems with bounds: the published iterations keep their rates, all others find the solution."""

from __future__ import annotations

from itertools import islice, pairwise
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

import lcpcli
from lcpcli.methods.fixed_point import fixed_point
from lcpcli.methods.shi import shi
from lcpcli.model.changes import shifted
from lcpcli.model.problem import Problem
from lcpcli.typing import Vector

from ..mixed_problems import definite, with_all_bounds
from .grids import plane


def iterates(problem: Problem, method: str, count: int) -> list[Vector]:
    stage = {"fixed-point": fixed_point, "shi": shi}[method](problem, np.zeros(problem.n))
    return [iterate.x for iterate in islice(stage, count)]


def test_fixed_point_converges_on_boxes_at_the_rate_of_the_theory() -> None:
    """By max |1 - lambda| / |1 + lambda| in each step, for M positive definite."""
    for seed in range(30):
        generator = np.random.default_rng(seed)
        M, q = definite(int(generator.integers(2, 30)), generator)
        lower = -generator.uniform(0, 1, q.size)
        problem = Problem(M, q, lower=lower, upper=lower + generator.uniform(0, 2, q.size))
        exact = lcpcli.run(problem)
        x = problem.box.x_of(exact.z, problem.w(exact.z))
        eigenvalues = np.linalg.eigvalsh(M)
        rate = float(np.max(np.abs(1 - eigenvalues) / (1 + eigenvalues)))
        errors = [float(np.linalg.norm(each - x)) for each in (np.zeros(q.size), *iterates(problem, "fixed-point", 60))]
        floor = 1e-12 * (1 + float(np.linalg.norm(x)))
        assert all(after <= rate * before * (1 + 1e-6) + floor for before, after in pairwise(errors))


def test_shi_solves_as_many_boxes_as_complementarity_problems() -> None:
    solved = {"LCP": 0, "box": 0}
    for seed in range(30):
        generator = np.random.default_rng(seed)
        M, q = definite(int(generator.integers(2, 12)), generator)
        lower = -generator.uniform(0, 1, q.size)
        bounds = {"lower": lower, "upper": lower + generator.uniform(0, 2, q.size)}
        for kind, given in (("LCP", {}), ("box", bounds)):
            solved[kind] += lcpcli.run(Problem(M, q, **given), "shi", tol=1e-9).solved
    assert solved["box"] >= solved["LCP"] > 25, solved


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_iterates_of_the_mixed_spelling_are_those_of_the_complementarity_problem(method: str) -> None:
    M, q = definite(12, np.random.default_rng(5))
    spelt = Problem(M, q, lower=np.zeros(12), upper=[None] * 12)
    assert all(map(np.array_equal, iterates(Problem(M, q), method, 40), iterates(spelt, method, 40)))


def with_bounds(seed: int) -> dict[str, Any]:
    """The data of a positive definite problem with all kinds of bounds."""
    generator = np.random.default_rng(seed)
    M, q = definite(10, generator)
    lower, upper = with_all_bounds(10, generator)
    return {"M": M, "q": q, "lower": lower, "upper": upper}


GUARANTEED = [name for name, own in lcpcli.inspect(Problem(**with_bounds(0))).guarantees.items() if own.word == "yes"]


def test_methods_that_are_guaranteed_to_solve_positive_definite_problems_with_bounds_are_all_of_the_package() -> None:
    assert {"auto", "shi", "fixed-point", "newton", "interior", "lemke", "milp"} <= {*GUARANTEED}


@pytest.mark.parametrize("method", GUARANTEED)
def test_every_guaranteed_method_solves_problems_with_all_kinds_of_bounds(method: str) -> None:
    for seed in range(8):
        data = with_bounds(seed)
        result, reference = (lcpcli.solve(**data, method=name) for name in (method, "newton"))
        assert (result.solved, reference.solved) == (True, True)
        assert np.abs(result.z - reference.z).max() <= 1e-6 * (1 + np.abs(reference.z).max())
        assert ((data["lower"] <= result.z) & (result.z <= data["upper"])).all()


@pytest.mark.parametrize("sparse", [False, True])
def test_larger_problems_take_the_routes_of_auto(sparse: bool) -> None:
    M, generator = plane(30), np.random.default_rng(0)
    lower, upper = with_all_bounds(900, generator)
    q = 0.3 * generator.standard_normal(900)
    result = lcpcli.solve(M if sparse else M.toarray(), q, lower=lower, upper=upper)
    assert result.solved
    inside = (result.z > lower) & (result.z < upper)
    assert np.abs((M @ result.z + q)[inside]).max() <= 1e-8
    assert {"lower", "basic", "upper"} == set(result.basis)


@pytest.mark.parametrize("fixed", [False, True])
def test_a_problem_that_is_mostly_evident_is_solved_without_that(fixed: bool) -> None:
    generator, n = np.random.default_rng(2), 300
    M, q = definite(n, generator)
    lower, upper = with_all_bounds(n, generator)
    evident = generator.random(n) < 0.7
    if fixed:
        lower[evident] = upper[evident] = 0.25
    else:
        M[evident] = 2 * np.eye(n)[evident]
    result = lcpcli.solve(csr_array(M), q, lower=lower, upper=upper)
    reference = lcpcli.solve(M, q, "newton", lower=lower, upper=upper)
    assert result.solved
    assert np.abs(result.z - reference.z).max() <= 1e-8


def test_point_at_a_bound_is_there_exactly_once_the_reference_point_is_moved_back() -> None:
    """u - l + l is not always u in doubles: here for some of the unknowns."""
    generator = np.random.default_rng(0)
    lower, upper = generator.random(500), 1 + 9 * generator.random(500)
    assert ((upper - lower) + lower < upper).any()
    problem = Problem(np.eye(500), generator.standard_normal(500), lower=lower, upper=upper)
    change = shifted(problem)
    for moved, given in ((change.problem.lower, lower), (change.problem.upper, upper)):
        assert np.array_equal(problem.box.z_of(change.back(moved / 2)), given)
