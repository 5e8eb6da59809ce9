"""A bound that is claimed holds: against exact solutions, for every class of M and any z."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator
from scipy.sparse import csr_array, diags_array

from lcpcli import Problem, error_bound, read
from lcpcli.errors import ProblemError
from lcpcli.files import contents
from lcpcli.verify import error_theorems, matrix_classes

from .. import exact

SIZES = [10.0**-k for k in range(1, 16)]


def h_plus(random: Generator, n: int, margin: float = 0.1) -> np.ndarray:
    """Diagonally dominant by rows up to the margin, then with columns scaled: H+, no longer dominant."""
    M = random.normal(size=(n, n)) * random.integers(0, 2, size=(n, n))
    np.fill_diagonal(M, 0)
    np.fill_diagonal(M, (1 + margin) * np.abs(M).sum(axis=1) + margin * random.random(n) + 1e-3)
    return M * np.exp2(random.integers(-2, 3, size=n))


def symmetric(random: Generator, n: int, margin: float = 0.1) -> np.ndarray:
    A = random.normal(size=(n, max(1, n - 1)))
    S = A @ A.T
    return 0.5 * (S + S.T) + margin * np.eye(n)


def nonsymmetric(random: Generator, n: int, margin: float = 0.1) -> np.ndarray:
    S = 3 * random.normal(size=(n, n))
    return symmetric(random, n, margin) + S - S.T


FAMILIES = {f.__name__: f for f in (h_plus, symmetric, nonsymmetric)}


def problem_of(kind: str, random: Generator, margin: float = 0.1, scaled: bool = False) -> Problem:
    """A random problem of one of the FAMILIES, of at most 5 unknowns, half of them degenerate."""
    n = int(random.integers(1, 6))
    M = FAMILIES[kind](random, n, margin)
    q = random.normal(size=n) - 0.2
    if random.integers(2):
        q = np.where(random.random(n) < 0.5, 0.0, q)
    problem = Problem(M, q)
    return exact.rescaled(problem, random) if scaled else problem


def solution(problem: Problem) -> list[Fraction]:
    z = exact.solution(problem)
    assert z is not None
    return z


def error(z: np.ndarray, true: list[Fraction]) -> Fraction:
    """|z - z*|_inf without rounding."""
    return max(abs(Fraction(a) - b) for a, b in zip(z.tolist(), true, strict=True))


def dot(a: np.ndarray, b: np.ndarray) -> Fraction:
    """a'b without rounding."""
    return sum((Fraction(x) * Fraction(y) for x, y in zip(a.tolist(), b.tolist(), strict=True)), Fraction(0))


def perturbed(true: list[Fraction], random: Generator, size: float) -> np.ndarray:
    z = np.array([float(v) for v in true])
    return z + size * (np.abs(z).max() or 1.0) * random.normal(size=z.size)


def others(true: list[Fraction], random: Generator) -> list[np.ndarray]:
    """The solution as rounded, 0, something negative, of any sign, huge, tiny."""
    z, noise = np.array([float(v) for v in true]), random.normal(size=len(true))
    return [z, 0 * z, -z - np.abs(noise), 9 * noise, 1e100 * noise, z + 1e-140 * noise]


def every_bound(problem: Problem, z: np.ndarray) -> list[float]:
    """What each of the theorems claims for itself."""
    w = error_theorems.residual(problem, z)
    assert w is not None
    theorems = [*error_theorems.definite_theorems(problem).values(), error_theorems.h_plus_theorem(problem)]
    claims = [theorem(z, w) for theorem in theorems if theorem is not None]
    return [value for value in claims if value < math.inf]


@pytest.mark.slow("100 random problems, each against exact arithmetic")
@settings(deadline=None, max_examples=100)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(sorted(FAMILIES)),
    margin=st.sampled_from([1.0, 0.1, 1e-3, 1e-6, 1e-10, 1e-14]),
    scaled=st.booleans(),
)
def test_every_bound_holds_exactly(seed: int, kind: str, margin: float, scaled: bool) -> None:
    random = np.random.default_rng(seed)
    problem = problem_of(kind, random, margin, scaled)
    true = solution(problem)
    for z in [perturbed(true, random, random.choice(SIZES)), *others(true, random)]:
        bound = error_bound(problem, z)
        assert bound is None or error(z, true) <= Fraction(bound.value)
        near = np.where(np.abs(z) < error_theorems.SMALLEST_ENTRY, 0.0, z)
        for value in every_bound(problem, near):
            assert error(near, true) <= Fraction(value)


@pytest.mark.parametrize("kind", ["symmetric", "nonsymmetric"])
def test_bound_of_definite_matrices_holds_where_z_and_w_are_both_negative(kind: str) -> None:
    for seed in range(200):
        random = np.random.default_rng(seed)
        problem = problem_of(kind, random, 1.0)
        true, theorems = solution(problem), error_theorems.definite_theorems(problem)
        assert theorems
        for z in 9 * random.normal(size=(4, problem.n)) - 9 * random.random((4, 1)):
            w = error_theorems.residual(problem, z)
            assert w is not None
            assert all(error(z, true) <= Fraction(theorem(z, w)) for theorem in theorems.values())


@settings(deadline=None, max_examples=100)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_bound_of_any_class_of_matrix_is_wrong(seed: int) -> None:
    """Any class at all: where a bound is claimed there is one solution, and z is that close to it."""
    random = np.random.default_rng(seed)
    problem = exact.random_problem(seed % 10**6, largest=4)
    z = random.normal(size=problem.n)
    bound = error_bound(problem, z)
    if bound is not None:
        assert error(z, solution(problem)) <= Fraction(bound.value)


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(sorted(FAMILIES)), scaled=st.booleans())
def test_well_conditioned_matrices_always_have_a_close_bound(seed: int, kind: str, scaled: bool) -> None:
    """Whatever the units; but a nonsymmetric M scaled by rows and columns alike need not be positive definite."""
    problem = problem_of(kind, np.random.default_rng(seed), 1.0, scaled and kind != "nonsymmetric")
    z = np.array([float(v) for v in solution(problem)])
    for M in (problem.M, csr_array(problem.M)):
        bound = error_bound(Problem(M, problem.q), z)
        assert bound is not None
        assert scaled or bound.value <= 1e-11 * max(1, z.max())


def test_neither_class_has_a_bound() -> None:
    for M in (
        [[0.0, 1.0], [-1.0, 0.0]],
        [[1.0, 3.0], [3.0, 1.0]],
        [[1.0, 2.0], [2.0, 4.0]],
        [[-1.0]],
        [[1.0, -1.0]] * 2,
    ):
        problem = Problem(M, -np.ones(len(M)))
        for same in (problem, Problem(csr_array(problem.M), problem.q)):
            assert error_bound(same, np.ones(len(M))) is None


def test_bound_is_what_the_theorem_says_on_an_example() -> None:
    """M = [[2, 1], [1, 2]], q = -(3, 3), z* = (1, 1): at z = (1.1, 1), w = (0.2, 0.1) and |z - z*| <= <M>^-1 w."""
    problem, z = Problem([[2.0, 1.0], [1.0, 2.0]], [-3.0, -3.0]), np.array([1.1, 1.0])
    w = problem.w(z)
    h_plus = error_theorems.h_plus_theorem(problem)
    assert h_plus is not None
    assert h_plus(z, w) == pytest.approx(0.5 / 3, rel=1e-6)
    assert 0.1 <= error_theorems.definite_theorems(problem)[error_theorems.DEFINITE](z, w) <= np.sqrt(0.05) + 1e-12


@pytest.mark.parametrize("n", [3, 10, 30, 100, 300])
@pytest.mark.parametrize("sparse", [False, True])
def test_bound_that_is_attained_is_not_undercut_by_rounding(n: int, sparse: bool) -> None:
    """M = tridiag(-1, 2, -1), z* = 1, z = 1 + i (n + 1 - i) / 2^20: w = M (z - z*) > 0, so that <M>^-1 w = z - z*."""
    i = np.arange(1, n + 1)
    true, M = np.ones(n), 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    z = true + i * (n + 1 - i) * 2.0**-20
    problem = Problem(csr_array(M) if sparse else M, -M @ true)
    h_plus = error_theorems.h_plus_theorem(problem)
    assert h_plus is not None
    value = h_plus(z, problem.w(z))
    assert np.abs(z - true).max() <= value <= (1 + 1e-5) * np.abs(z - true).max()


def test_sources_name_the_theorem_and_the_class() -> None:
    assert_source([[2.0, 0.5], [-0.5, 2.0]], [-1.0, 0.0], "M is ")
    assert_source([[1.0, -4.0], [0.0, 1.0]], [1.0, 3.0], "Chen and Xiang 2006, M is H+")
    assert_source([[1.0, -5.0], [5.0, 1.0]], [-1.0, 0.0], "Mathias and Pang 1990, M is positive definite")


def assert_source(M: list[list[float]], z: list[float], source: str) -> None:
    bound = error_bound(Problem(M, [-1.0, -2.0]), z)
    assert bound is not None
    assert source in bound.source


@pytest.mark.parametrize("n", [2, 12, 40])
def test_definite_matrix_has_a_bound_after_rows_were_multiplied_by_numbers(n: int) -> None:
    """M = D (A A' + S) with S skew-symmetric: no T makes T M symmetric, and T = D^-1 makes it positive definite."""
    random = np.random.default_rng(n)
    A, S = random.normal(size=(2, n, n))
    M = np.exp2(random.integers(-6, 7, n))[:, np.newaxis] * (A @ A.T + np.eye(n) + 0.3 * (S - S.T))
    true = np.maximum(random.normal(size=n), 0.0)
    problem, z = Problem(M, np.where(true > 0, 0.0, 0.5) - M @ true), true + 1e-6 * random.normal(size=n)
    bound = error_bound(problem, z)
    assert bound is not None
    assert np.abs(z - true).max() <= bound.value <= 1e-2


def test_exact_solution_has_the_bound_zero() -> None:
    for file in ("paper-example-1.json", "tridiagonal-100.json"):
        problem = read(contents.shipped_path(file))
        bound = error_bound(problem, problem.solutions[0])
        assert bound is not None
        assert bound.value == 0


@pytest.mark.parametrize("margin", [1e-2, 1e-6, 1e-10])
def test_large_sparse_h_plus_matrix_has_a_bound(margin: float) -> None:
    n = 5000
    band = np.full(n - 1, -1.0)
    M = diags_array([band, np.full(n, 2 + margin), band], offsets=[-1, 0, 1], format="csr")
    true = np.maximum(np.sin(np.arange(n) / 100.0), 0.0)
    problem = Problem(M, np.where(true > 0, 0.0, 0.5) - M @ true)
    z = true + 1e-6 * np.random.default_rng(0).normal(size=n)
    bound = error_bound(problem, z)
    assert bound is not None
    assert bound.source == "Chen and Xiang 2006, M is H+"
    assert np.abs(z - true).max() <= bound.value <= 1.1 * np.abs(z - true).max()


def test_sparse_and_dense_matrices_have_nearly_the_same_bound() -> None:
    random = np.random.default_rng(4)
    M = h_plus(random, 60)
    problem, z = Problem(M, random.normal(size=60)), random.random(60)
    dense, sparse = error_bound(problem, z), error_bound(Problem(csr_array(M), problem.q), z)
    assert dense is not None
    assert sparse is not None
    assert sparse.value == pytest.approx(dense.value, rel=1e-6)


@settings(deadline=None, max_examples=100)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 40), power=st.integers(0, 14))
def test_verified_least_eigenvalue_is_one(seed: int, n: int, power: int) -> None:
    """A'A + mu I for integers A has no eigenvalue below mu, and a column of zeros in A makes mu the least one."""
    A = np.random.default_rng(seed).integers(-4, 5, size=(n, n)) / 16.0
    A[:, 0] = 0
    mu = 2.0**-power
    least = matrix_classes.least_eigenvalue(A.T @ A + mu * np.eye(n))
    assert least is not None
    assert 0.99 * mu <= least <= mu
    assert matrix_classes.least_eigenvalue(A.T @ A) is None


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8))
def test_product_with_the_comparison_matrix_is_never_overestimated(seed: int, n: int) -> None:
    """At the edge of the H+ matrices, where <M> u is all rounding."""
    random = np.random.default_rng(seed)
    M, u = random.normal(size=(n, n)), random.random(n) + 1e-3
    np.fill_diagonal(M, 0)
    np.fill_diagonal(M, np.abs(M) @ u / u)
    for same in (M, csr_array(M)):
        claimed = matrix_classes.lower_image(same, M.diagonal(), u)
        exactly = [2 * Fraction(M[i, i]) * Fraction(u[i]) - dot(np.abs(M[i]), u) for i in range(n)]
        assert all(Fraction(a) <= b for a, b in zip(claimed.tolist(), exactly, strict=True))


def test_numbers_beyond_range_have_no_bound_and_no_traceback() -> None:
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    for z in ([math.nan, 1.0], [math.inf, 1.0], [1e300, 1.0]):
        assert error_bound(problem, np.array(z)) is None
    for M in (1e300 * np.eye(2), np.diag([1.0, 1e-300]), np.diag([1e200, 1e-200]), [[1.0, 1e-300], [0.0, 1.0]]):
        assert error_bound(Problem(M, [-1.0, -1.0]), np.ones(2)) is None
    assert error_bound(Problem(np.eye(2), [-1e308, 1e308]), np.ones(2)) is None
    with pytest.raises(ProblemError, match="z: has 3 entries"):
        error_bound(problem, np.ones(3))
