"""Error bounds and sensitivity of mixed problems: against exact solutions, found by trying all states."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator

from lcpcli import Problem, error_bound, solve
from lcpcli.verify import error_theorems
from lcpcli.verify.digits import sensitivity

from .. import exact
from .test_bounds import FAMILIES, SIZES, error, others, perturbed

LOWER, BASIC, UPPER = range(3)


def random_bounds(random: Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of every kind: none, one, both, the same; around 0 and away from it."""
    low = random.normal(size=n) + random.choice([0.0, 0.0, 5.0, -5.0], n)
    high = low + random.choice([0.0, 1e-3, 1.0, 3.0], n)
    return np.where(random.random(n) < 0.3, -np.inf, low), np.where(random.random(n) < 0.3, np.inf, high)


def mixed(kind: str, random: Generator, margin: float = 0.1) -> Problem:
    n = int(random.integers(1, 7))
    M = FAMILIES[kind](random, n, margin)
    lower, upper = random_bounds(random, n)
    return Problem(M, 3 * random.normal(size=n), lower=lower, upper=upper)


def solution(problem: Problem) -> list[Fraction]:
    """The solution of a mixed problem with a P-matrix, by Gaussian elimination in rational arithmetic."""
    n, rows = problem.n, [[Fraction(value) for value in row] for row in problem.M.tolist()]
    low, high = (np.broadcast_to(bound, n).tolist() for bound in (problem.lower, problem.upper))
    for states in product((LOWER, BASIC, UPPER), repeat=n):
        P = [i for i in range(n) if states[i] == BASIC]
        at = {i: (low, high)[states[i] == UPPER][i] for i in range(n) if states[i] != BASIC}
        if any(math.isinf(value) for value in at.values()):
            continue
        z = [Fraction(at.get(i, 0)) for i in range(n)]
        b = [-Fraction(problem.q[i]) - sum(rows[i][j] * z[j] for j in at) for i in P]
        z_P = exact._regular([[rows[i][j] for j in P] for i in P], b)
        assert z_P is not None
        for i, value in zip(P, z_P, strict=True):
            z[i] = value
        if solves(problem, z):
            return z
    raise AssertionError("a P-matrix has a solution for all bounds")


def solves(problem: Problem, z: list[Fraction]) -> bool:
    n = problem.n
    low, high = (np.broadcast_to(bound, n).tolist() for bound in (problem.lower, problem.upper))
    for i in range(n):
        w = sum(
            (Fraction(m) * value for m, value in zip(problem.M[i].tolist(), z, strict=True)), Fraction(problem.q[i])
        )
        if not low[i] <= z[i] <= high[i] or (w < 0 and z[i] < high[i]) or (w > 0 and z[i] > low[i]):
            return False
    return True


@pytest.mark.slow("100 random problems, each against exact arithmetic")
@settings(deadline=None, max_examples=100)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(sorted(FAMILIES)),
    margin=st.sampled_from([1.0, 0.1, 1e-3, 1e-6, 1e-10]),
)
def test_every_bound_holds_exactly_for_any_bounds(seed: int, kind: str, margin: float) -> None:
    random = np.random.default_rng(seed)
    problem = mixed(kind, random, margin)
    true = solution(problem)
    theorems = [*error_theorems.definite_theorems(problem).values(), error_theorems.h_plus_theorem(problem)]
    for z in [perturbed(true, random, random.choice(SIZES)), *others(true, random)]:
        bound = error_bound(problem, z)
        assert bound is None or error(z, true) <= Fraction(bound.value)
        near = np.where(np.abs(z) < error_theorems.SMALLEST_ENTRY, 0.0, z)
        w = error_theorems.residual(problem, near)
        assert w is not None
        claims = [theorem(near, w) for theorem in theorems if theorem is not None]
        assert all(error(near, true) <= Fraction(value) for value in claims if value < math.inf)


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(sorted(FAMILIES)))
def test_corrections_have_the_signs_on_which_the_proof_rests(seed: int, kind: str) -> None:
    """z - rho is admissible, w - sigma has the signs asked for there, and no rho_i sigma_i is negative."""
    random = np.random.default_rng(seed)
    problem = mixed(kind, random)
    box, z, w = problem.box, 3 * random.normal(size=(problem.n)), 3 * random.normal(size=problem.n)
    sigma, rho = box.corrections(z, w, problem.M.diagonal())
    low, high = (np.broadcast_to(bound, problem.n) for bound in (problem.lower, problem.upper))
    y = np.where(np.isclose(z - rho, low), low, np.where(np.isclose(z - rho, high), high, z - rho))
    assert (low <= y).all()
    assert (y <= high).all()
    assert (box.excess(y, w - sigma) <= 0).all()
    assert (rho * sigma >= 0).all()


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(sorted(FAMILIES)))
def test_solutions_of_well_conditioned_problems_have_a_close_bound(seed: int, kind: str) -> None:
    problem = mixed(kind, np.random.default_rng(seed), margin=1.0)
    z = solve(problem.M, problem.q, lower=problem.lower, upper=problem.upper).z
    bound = error_bound(problem, z)
    assert bound is not None
    assert bound.value <= 1e-10


def test_no_bound_is_claimed_where_no_theorem_holds() -> None:
    multipliers = Problem([[2, -1], [1, 0]], [0, -1], lower=[0, -np.inf])  # semidefinite, with an equation
    assert error_bound(multipliers, [1, 2]) is None
    assert error_bound(Problem([[1]], [1], lower=1e-200), [0]) is None
    assert error_bound(Problem([[1]], [1], lower=1e-100), [0]) is not None


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_sensitivity_is_what_perturbed_data_show(seed: int) -> None:
    """For a basis with variables at both bounds, the worst signs of the changes attain it, to first order."""
    random = np.random.default_rng(seed)
    n = 6
    M, z = exact.positive_definite(random, n), random.uniform(0.5, 2, n)
    w = np.array([0, 0, 0, 1.0, -1.0, 3.0])
    bounds = {"lower": [-np.inf, 0, 0, z[3], -9, z[5]], "upper": [np.inf, np.inf, 3, 9, z[4], z[5]]}
    P, N = np.arange(3), np.arange(3, 6)
    problem = Problem(M, w - M @ z, **bounds)
    predicted = sensitivity(problem, z)
    assert predicted is not None
    inverse, size, largest = np.linalg.inv(M[:3, :3]), 1e-7 / predicted, 0.0
    for row in inverse:
        signs = np.sign(row)[:, np.newaxis]
        worse = M[P] - size * signs * np.abs(M[P])
        q = problem.q[P] - size * signs[:, 0] * np.abs(problem.q[P])
        moved = np.linalg.solve(worse[:, :3], -q - worse[:, N] @ z[N])
        largest = max(largest, float(np.abs(moved - z[P]).max()))
    assert largest == pytest.approx(size * predicted, rel=1e-3)


@pytest.mark.parametrize("n", [6, 70])
def test_sensitivity_does_not_depend_on_the_units_of_rows(n: int) -> None:
    random = np.random.default_rng(n)
    A, B = random.standard_normal((2, n, n))
    M, z, R = A @ A.T / n + np.eye(n) + B - B.T, random.uniform(0.5, 2, n), np.exp2(random.integers(-20, 21, n))
    own = sensitivity(Problem(M, -M @ z), z)
    assert own is not None
    assert sensitivity(Problem(R[:, None] * M, R * (-M @ z)), z) == pytest.approx(own, rel=1e-6)


def test_fixed_variables_are_not_sensitive() -> None:
    assert sensitivity(Problem([[0.0]], [1.0], lower=1, upper=1), np.ones(1)) == 0.0
