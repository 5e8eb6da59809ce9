"""Derivatives of solutions: against differences of exact solutions, reverse against forward, at kinks, and where there
are none."""

from __future__ import annotations

import pickle
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Result
from lcpcli.errors import DerivativeError, ProblemError
from lcpcli.gallery import families
from lcpcli.linalg.matrices import dense
from lcpcli.typing import Matrix, Vector

from .. import mixed_problems

DATA = ("M", "q", "lower", "upper")
SCALE = 64  # data and changes are multiples of 1 / SCALE: with a STEP that is a power of 2, nothing is rounded
STEP = 2.0**-24


def rounded(values: Vector) -> Vector:
    return np.rint(SCALE * values) / SCALE


def random_problem(n: int, random: Generator, mixed: bool) -> Problem:
    """M is positive definite, not symmetric; if mixed with bounds of all kinds, fixed and free variables too."""
    M, q = mixed_problems.monotone(n, random)
    if not mixed:
        return Problem(rounded(M) + np.eye(n), rounded(q))
    lower, upper = map(rounded, mixed_problems.with_all_bounds(n, random))
    return Problem(rounded(M) + np.eye(n), rounded(q), lower=lower, upper=upper)


def random_change(problem: Problem, random: Generator) -> dict[str, Vector]:
    """A direction for all data; bounds that do not exist stay, and those of fixed variables move together."""
    n, (low, high) = problem.n, problem.box.vectors(problem.n)
    moves = rounded(random.normal(size=(2, n)))
    moves[1, low == high] = moves[0, low == high]
    moves[np.isinf((low, high))] = 0.0
    return {"dM": rounded(random.normal(size=(n, n))), "dq": rounded(random.normal(size=n))} | {
        "dlower": moves[0],
        "dupper": moves[1],
    }


def exact_z(problem: Problem, change: dict[str, Vector], h: float) -> list[Fraction]:
    """The solution in fractions of the problem with its data plus h times the change, which doubles represent."""
    data = dict(zip(DATA, (dense(problem.M), problem.q, *problem.box.vectors(problem.n)), strict=True))
    z = lcpcli.exact(Problem(**{name: data[name] + h * change.get(f"d{name}", 0.0) for name in DATA})).exact
    assert z is not None
    assert z.z is not None
    return z.z


def exact_derivative(problem: Problem, change: dict[str, Vector], h: float = STEP) -> Vector:
    """The central difference of exact solutions: exact for changes of q and of bounds, else with an error of h^2."""
    ends = zip(exact_z(problem, change, h), exact_z(problem, change, -h), strict=True)
    return np.array([float((a - b) / Fraction(2 * h)) for a, b in ends])


def pairing(gradient: Any, change: dict[str, Any]) -> float:
    """The sum of the products of all derivatives with the changes."""
    return sum(float(np.sum(dense(getattr(gradient, name[1:])) * dense(move))) for name, move in change.items())


@pytest.mark.parametrize(("seed", "mixed"), [*product(range(20), (False, True))])
def test_derivatives_by_all_data_are_those_of_the_exact_solutions(seed: int, mixed: bool) -> None:
    random = np.random.default_rng(seed)
    problem = random_problem(int(random.integers(1, 9)), random, mixed)
    change = random_change(problem, random)
    result = lcpcli.run(problem)
    for one in ({name: move} for name, move in change.items() if name in ("dM", "dq")):
        found, known = result.derivative(**one).z, exact_derivative(problem, one)
        assert np.abs(found - known).max() <= 1e-12 * np.abs(known).max()
    found, known = result.derivative(**change), exact_derivative(problem, change)
    assert found.kinks == []
    assert found.strongly_regular
    assert np.abs(found.z - known).max() <= 1e-12 * np.abs(known).max()


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_fifty_unknowns_are_the_differences_of_exact_solutions(seed: int) -> None:
    random = np.random.default_rng(seed)
    problem = random_problem(50, random, mixed=seed > 0)
    change = random_change(problem, random)
    result = lcpcli.run(problem)
    by_q = {"dq": change["dq"]}
    known = exact_derivative(problem, by_q)
    assert np.abs(result.derivative(**by_q).z - known).max() <= 1e-12 * np.abs(known).max()
    known = exact_derivative(problem, change)
    assert np.abs(result.derivative(**change).z - known).max() <= 1e-11 * np.abs(known).max()
