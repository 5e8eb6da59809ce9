"""A bound that is claimed holds: against exact solutions, for every class of M, all
bounds of z and any z."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array, diags_array, eye_array, kron

from lcpcli import Problem, error_bound
from lcpcli.verify import error_theorems
from lcpcli.verify.error_theorems import (
    lower_image,
    scaling,
    semidefinite_by_rounding,
)

from .. import exact

SIZES = [10.0**-k for k in range(1, 16)]


def h_plus(random, n, margin=0.1):
    """Diagonally dominant by rows up to the margin, then with columns scaled: H+, no
    longer dominant."""
    M = random.normal(size=(n, n)) * random.integers(0, 2, size=(n, n))
    np.fill_diagonal(M, 0)
    np.fill_diagonal(
        M, (1 + margin) * np.abs(M).sum(axis=1) + margin * random.random(n) + 1e-3
    )
    return M * np.exp2(random.integers(-2, 3, size=n))


def symmetric(random, n, margin=0.1):
    A = random.normal(size=(n, max(1, n - 1)))
    S = A @ A.T
    return 0.5 * (S + S.T) + margin * np.eye(n)


def nonsymmetric(random, n, margin=0.1):
    S = 3 * random.normal(size=(n, n))
    return symmetric(random, n, margin) + S - S.T


FAMILIES = {f.__name__: f for f in (h_plus, symmetric, nonsymmetric)}
FORMS = ("plain", "scaled", "bounded")


def random_bounds(random, n):
    """Bounds of every kind: none, one, both, the same; around 0 and away from it."""
    low = random.normal(size=n) + random.choice([0.0, 0.0, 5.0, -5.0], n)
    high = low + random.choice([0.0, 1e-3, 1.0, 3.0], n)
    return np.where(random.random(n) < 0.3, -np.inf, low), np.where(
        random.random(n) < 0.3, np.inf, high
    )


def problem_of(kind, random, margin=0.1, form="plain"):
    """A random problem of one of the FAMILIES and one of the FORMS, of at most 5
    unknowns, half of them degenerate."""
    n = int(random.integers(1, 6))
    M = FAMILIES[kind](random, n, margin)
    q = random.normal(size=n) - 0.2
    if form == "bounded":
        lower, upper = random_bounds(random, n)
        return Problem(M, 3 * q, lower=lower, upper=upper)
    if random.integers(2):
        q = np.where(random.random(n) < 0.5, 0.0, q)
    problem = Problem(M, q)
    return exact.rescaled(problem, random) if form == "scaled" else problem


def error(z, true):
    """|z - z*|_inf without rounding."""
    return max(abs(Fraction(a) - b) for a, b in zip(z.tolist(), true, strict=True))


def perturbed(true, random, size):
    z = np.array([float(v) for v in true])
    return z + size * (np.abs(z).max() or 1.0) * random.normal(size=z.size)


def others(true, random):
    """The solution as rounded, 0, negative with z and mostly w, of any sign, huge,
    tiny."""
    z, noise = np.array([float(v) for v in true]), random.normal(size=len(true))
    return [
        z,
        0 * z,
        -z - np.abs(noise),
        -9 * np.abs(noise) - 9,
        9 * noise,
        1e100 * noise,
        z + 1e-140 * noise,
    ]


@settings(deadline=None, max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(sorted(FAMILIES)),
    margin=st.sampled_from([1.0, 0.1, 1e-3, 1e-6, 1e-10, 1e-14]),
    form=st.sampled_from(FORMS),
)
def test_every_bound_holds_exactly(seed, kind, margin, form):
    random = np.random.default_rng(seed)
    problem = problem_of(kind, random, margin, form)
    true = exact.solution(problem)
    theorems = [
        *error_theorems.definite_theorems(problem).values(),
        error_theorems.h_plus_theorem(problem),
    ]
    for z in [perturbed(true, random, random.choice(SIZES)), *others(true, random)]:
        bound = error_bound(problem, z)
        assert bound is None or error(z, true) <= Fraction(bound.value)
        near = np.where(np.abs(z) < error_theorems.SMALLEST_ENTRY, 0.0, z)
        w = error_theorems.residual(problem, near)
        claims = [theorem(near, w) for theorem in theorems if theorem is not None]
        assert all(
            error(near, true) <= Fraction(value) for value in claims if value < math.inf
        )


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_bound_of_any_class_of_matrix_is_wrong(seed):
    """Any class at all: where a bound is claimed there is one solution, and z is that
    close to it."""
    random = np.random.default_rng(seed)
    problem = exact.random_problem(seed % 10**6, largest=4)
    z = random.normal(size=problem.n)
    bound = error_bound(problem, z)
    if bound is not None:
        assert error(z, exact.solution(problem)) <= Fraction(bound.value)


@settings(deadline=None, max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(sorted(FAMILIES)),
    form=st.sampled_from(FORMS),
)
def test_well_conditioned_matrices_always_have_a_close_bound(seed, kind, form):
    """Whatever the units; but a nonsymmetric M scaled by rows and columns alike need
    not be positive definite."""
    problem = problem_of(
        kind,
        np.random.default_rng(seed),
        1.0,
        "plain" if kind == "nonsymmetric" else form,
    )
    z = np.array([float(v) for v in exact.solution(problem)])
    for M in (problem.M, csr_array(problem.M)):
        bound = error_bound(replace(problem, M=M), z)
        assert form == "scaled" or bound.value <= 1e-11 * max(1, np.abs(z).max())


@pytest.mark.parametrize("form", [np.array, csr_array])
def test_neither_class_has_a_bound(form):
    for M in ([[0, 1], [-1, 0]], [[1, 3], [3, 1]], [[1, 2], [2, 4]], [[-1]]):
        one = np.ones(len(M))
        assert error_bound(Problem(form(M), -one), one) is None


@pytest.mark.parametrize(("n", "sparse"), [(3, False), (100, False), (100, True)])
def test_bound_that_is_attained_is_not_undercut_by_rounding(n, sparse):
    """M = tridiag(-1, 2, -1), z* = 1, z = 1 + i (n + 1 - i) / 2^20: w = M (z - z*) > 0,
    so that <M>^-1 w = z - z*."""
    i = np.arange(1, n + 1)
    true, M = np.ones(n), 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    z = true + i * (n + 1 - i) * 2.0**-20
    problem = Problem(csr_array(M) if sparse else M, -M @ true)
    h_plus = error_theorems.h_plus_theorem(problem)
    value = h_plus(z, problem.w(z))
    assert np.abs(z - true).max() <= value <= (1 + 1e-5) * np.abs(z - true).max()


def tridiagonal(n, diagonal):
    return diags_array(
        [-1.0, diagonal, -1.0], offsets=[-1, 0, 1], shape=(n, n), format="csr"
    )


@pytest.mark.parametrize("margin", [1e-2, 1e-10])
def test_large_sparse_h_plus_matrix_has_a_bound(margin):
    n = 5000
    M = tridiagonal(n, 2 + margin)
    true = np.maximum(np.sin(np.arange(n) / 100.0), 0.0)
    problem = Problem(M, np.where(true > 0, 0.0, 0.5) - M @ true)
    z = true + 1e-6 * default_rng(0).normal(size=n)
    bound = error_bound(problem, z)
    assert bound.source == "Chen and Xiang 2006, M is H+"
    assert np.abs(z - true).max() <= bound.value <= 1.1 * np.abs(z - true).max()


def test_a_bound_takes_no_factors_of_a_matrix_with_much_fill(monkeypatch):
    monkeypatch.setattr("scipy.sparse.linalg.splu", None)
    k = 20
    second, one = tridiagonal(k, 2.5), eye_array(k)
    M = csr_array(kron(kron(second, one), one) + kron(kron(one, one), second))
    true = np.maximum(np.sin(np.arange(k**3) / 100.0), 0.0)
    bound = error_bound(Problem(M, np.where(true > 0, 0.0, 0.5) - M @ true), true)
    assert bound.value <= 1e-10


def test_no_factors_with_much_fill_are_taken_where_there_is_no_bound(monkeypatch):
    monkeypatch.setattr("scipy.sparse.linalg.splu", None)
    k = 40
    line, one = tridiagonal(k, 0.0), eye_array(k)
    grid = (
        kron(kron(line, one), one)
        + kron(kron(one, line), one)
        + kron(kron(one, one), line)
    )
    M = csr_array(grid + 5.5 * eye_array(k**3))
    assert error_bound(Problem(M, -np.ones(k**3)), np.ones(k**3)) is None


def test_numbers_beyond_range_have_no_bound_and_no_traceback():
    problem = Problem([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    for z in ([math.nan, 1.0], [math.inf, 1.0], [1e300, 1.0]):
        assert error_bound(problem, np.array(z)) is None
    for M in (
        1e300 * np.eye(2),
        np.diag([1.0, 1e-300]),
        np.diag([1e200, 1e-200]),
        [[1.0, 1e-300], [0.0, 1.0]],
    ):
        assert error_bound(Problem(M, [-1.0, -1.0]), np.ones(2)) is None
    assert error_bound(Problem(np.eye(2), [-1e308, 1e308]), np.ones(2)) is None


def test_no_bound_is_claimed_where_no_theorem_holds():
    # Semidefinite, with an equation.
    multipliers = Problem([[2, -1], [1, 0]], [0, -1], lower=[0, -np.inf])
    assert error_bound(multipliers, [1, 2]) is None
    assert error_bound(Problem([[1]], [1], lower=1e-200), [0]) is None
    assert error_bound(Problem([[1]], [1], lower=1e-100), [0]) is not None


def image(M, d):
    """<M> d without rounding."""
    factors = [Fraction(value) for value in d.tolist()]
    rows = [
        [Fraction(a if i == j else -abs(a)) for j, a in enumerate(row)]
        for i, row in enumerate(M.tolist())
    ]
    return [
        sum((a * v for a, v in zip(row, factors, strict=True)), Fraction(0))
        for row in rows
    ]


@pytest.mark.parametrize("power", [0, -161, -480, -530])
def test_an_image_is_bounded_from_below_with_its_rounding_and_underflow(power):
    unit, random = 2.0**power, default_rng(0)
    for n in (2, 5, 9):
        M = unit * random.standard_normal((n, n))
        d = unit * random.random(n)
        np.fill_diagonal(M, 0.0)
        off = np.abs(M) @ d / d
        np.fill_diagonal(M, off * (1 + 2.0**-50 * random.standard_normal(n)))
        bounds = lower_image(M, M.diagonal(), d).tolist()
        assert (np.array(list(map(Fraction, bounds))) <= image(M, d)).all()


def test_scaling_is_found_where_it_varies_by_more_than_the_digits_of_a_double():
    """For the M with ones on the diagonal and 2 above it, C^-1 e = (3^(n-1), ..., 3,
    1), and C d is all rounding."""
    M = np.eye(40) + 2 * np.triu(np.ones((40, 40)), 1)
    found = scaling(M, lambda d: bool(lower_image(M, np.ones(40), d).min() > 0))
    assert found.max() > 2.0**53 * found.min()
    assert min(image(M, found)) > 0


def test_definiteness_depends_on_rounding_only_where_it_is_not_proved():
    B = default_rng(0).random((5, 3))
    assert semidefinite_by_rounding(B @ B.T) is not None
    for definite in (B @ B.T + np.eye(5), np.eye(5)):
        assert semidefinite_by_rounding(definite) is None
