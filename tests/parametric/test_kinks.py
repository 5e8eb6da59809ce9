"""Derivatives at kinks, where a component is at a bound and w is 0: which components are, one-sided derivatives against
small steps, and solutions that are singular there."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import lcpcli
from lcpcli import Problem, Result
from lcpcli.errors import DerivativeError
from lcpcli.gallery import families

from .. import exact, mixed_problems
from .differences import exact_z


def with_kinks(n: int, kinks: int, random: Generator, mixed: bool) -> Problem:
    """A random problem, of integers, with z and w that are 0 in some components, the bounds apart from 0 if mixed."""
    M = np.rint(4 * mixed_problems.monotone(n, random)[0]) + 4 * np.eye(n)
    lower = random.integers(-3, 3, n).astype(float) if mixed else np.zeros(n)
    upper = lower + random.integers(3, 6, n) if mixed else np.full(n, np.inf)
    states = random.integers(-1, 2 if mixed else 1, n)
    states[:kinks] = np.where(states[:kinks] == 0, -1, states[:kinks])
    z = np.where(states < 0, lower, np.where(states > 0, upper, lower + 1))
    w = -states * random.integers(1, 5, n).astype(float)
    w[:kinks] = 0.0
    order = random.permutation(n)
    M, q, lower, upper = M[order][:, order], (w - M @ z)[order], lower[order], upper[order]
    return Problem(M, q, lower=lower, upper=upper, note=" ".join(map(str, np.flatnonzero(order < kinks))))


@pytest.mark.parametrize(("seed", "mixed"), [*product(range(8), (False, True))])
def test_at_kinks_one_sided_derivatives_are_those_of_small_steps(seed: int, mixed: bool) -> None:
    """But for rounding, unless M changes too."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 9))
    problem = with_kinks(n, int(random.integers(1, n + 1)), random, mixed)
    result, h = lcpcli.run(problem), 2.0**-30
    dq, dM = random.integers(-5, 6, n).astype(float), random.integers(-5, 6, (n, n)).astype(float)
    low, high = random.integers(-2, 3, (2, n)) * np.isfinite(problem.box.vectors(n))
    z = exact_z(problem, {}, 0.0)
    for change in ({"dq": dq}, {"dq": dq, "dlower": low, "dupper": high}, {"dM": dM, "dq": dq}):
        found = result.derivative(**change, one_sided=True)
        assert found.kinks == result.gradient(dq).kinks == [int(i) for i in problem.note.split()]
        assert found.strongly_regular
        known = np.array([float((a - b) / Fraction(h)) for a, b in zip(exact_z(problem, change, h), z, strict=True)])
        error = 1e-6 * np.abs(known).max(initial=1.0) if "dM" in change else 1e-12 * np.abs(known).max()
        assert np.abs(found.z - known).max() <= error


@pytest.mark.parametrize("seed", range(6))
def test_at_kinks_the_derivative_is_that_of_the_piece_on_which_they_stay_at_their_bounds(seed: int) -> None:
    random = np.random.default_rng(seed)
    problem = with_kinks(6, 3, random, mixed=seed % 2 > 0)
    at_bound = lcpcli.run(problem).derivative(dq=np.ones(6))
    kinks = at_bound.kinks
    assert len(kinks) == 3
    assert at_bound.strongly_regular is None
    away = problem.q.copy()  # w of the kinks gets the sign that their bound asks for
    away[kinks] += np.where(lcpcli.run(problem).z == problem.box.vectors(6)[1], -1e-3, 1e-3)[kinks]
    beside = lcpcli.run(Problem(problem.M, away, lower=problem.lower, upper=problem.upper)).derivative(dq=np.ones(6))
    assert beside.kinks == []
    assert np.abs(at_bound.z - beside.z).max() <= 1e-12 * np.abs(beside.z).max()


def solved_at(z: list[float], *given: Any, **bounds: Any) -> Result:
    """The result with this solution of the problem, of which there may be others."""
    problem = Problem(*given, **bounds)
    result = lcpcli.run(problem, z0=z, max_iterations=1) if np.any(z) else lcpcli.run(problem)
    assert result.solved
    assert result.z.tolist() == z
    return result


@pytest.mark.parametrize(
    "given",
    [
        ([0], [[-1]], [0]),  # no solution or several, for nearby data
        ([0], [[0]], [0]),
        ([0, 0], [[1, 1], [1, 1]], [0, 0]),
        ([1, 0], [[1, 1], [1, 0]], [-1, -1]),
        ([1, 1], [[2, 3], [3, 2]], [-5, -5], None, [0, 0], [1, 1]),
    ],
)
def test_solution_that_is_not_strongly_regular_has_no_one_sided_derivative(given: tuple[Any, ...]) -> None:
    """It is not the only one nearby, or for nearby data."""
    z, M, q, *bounds = given
    result = solved_at(z, M, q, **dict(zip(("x0", "lower", "upper"), bounds, strict=False)))
    with pytest.raises(DerivativeError, match="not strongly regular"):
        result.derivative(dq=np.ones(len(z)), one_sided=True)


@pytest.mark.parametrize("singular", ["exactly", "but for rounding"])
def test_singular_solution_has_neither_derivative_nor_gradient(singular: str) -> None:
    if singular == "exactly":
        result = solved_at([0.5, 0.5], [[1, 1], [1, 1]], [-1, -1])
    else:
        result = lcpcli.solve([[0.1, 0.3], [0.3, 0.9]], [-0.1, -0.3], lower=-np.inf)
    for call in (lambda: result.derivative(dq=[1, 0]), lambda: result.gradient([1, 0])):
        with pytest.raises(DerivativeError, match="variables between their bounds is singular"):
            call()


def test_at_many_kinks_whose_matrix_is_not_classified_the_direction_is_not_called_proved() -> None:
    random = np.random.default_rng(0)
    M, d = exact.p_matrix(random, 16), random.normal(size=16)
    found = lcpcli.solve(M, np.zeros(16)).derivative(dq=d, one_sided=True)
    assert found.strongly_regular is None
    assert found.kinks == list(range(16))
    known = lcpcli.solve(M, d).z
    assert np.abs(found.z - known).max() <= 1e-11 * np.abs(known).max()


@pytest.mark.parametrize("scaled", [False, True])
def test_kinks_do_not_depend_on_units(scaled: bool) -> None:
    problem, random = families.make("degenerate", 40), np.random.default_rng(0)
    R, C = np.exp2(random.integers(-33, 34, (2, 40))) if scaled else np.ones((2, 40))
    result = lcpcli.run(Problem(R[:, np.newaxis] * problem.M * C, R * problem.q))
    known = lcpcli.run(problem)
    assert result.derivative().kinks == known.derivative().kinks != []
    found, other = result.derivative(dq=R, one_sided=True), known.derivative(dq=np.ones(40), one_sided=True)
    assert found.strongly_regular
    assert other.strongly_regular
    assert np.abs(found.z * C - other.z).max() <= 1e-9 * np.abs(other.z).max()


@pytest.mark.parametrize("power", [-12, -6])
def test_components_that_are_nearly_at_a_kink_are_not(power: int) -> None:
    problem = families.make("near-degenerate", 40, epsilon=10.0**power)
    found = lcpcli.run(problem).derivative(dq=np.ones(40))
    assert found.kinks == []
    assert found.strongly_regular
