"""Arithmetic beyond doubles, for stiff problems: sums of two doubles, products of a
matrix with them, bands in doubles and in fixed-point numbers, and systems refined with
these; all beside rational arithmetic."""

import threading
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array, diags_array, eye_array, random_array

from lcpcli.gallery.families import make
from lcpcli.interrupts import owned
from lcpcli.linalg.banded import Banded
from lcpcli.linalg.definite_systems import (
    DefiniteSystems,
    condition,
    is_nearly_definite,
)
from lcpcli.linalg.double_double import AccurateProduct, DoubleDouble
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import row_errors

from ..methods import bands

EPS = float(np.finfo(float).eps)


def exact(x):
    return [
        Fraction(float(a)) + Fraction(float(b))
        for a, b in zip(x.high, x.low, strict=True)
    ]


def of_seed(seed, n=30):
    random = default_rng(seed)
    highs = random.normal(size=(2, n)) * 10.0 ** random.uniform(-8, 8, (2, n))
    lows = highs * random.uniform(-0.5, 0.5, (2, n)) * EPS
    return DoubleDouble(highs[0], lows[0]), DoubleDouble(highs[1], lows[1])


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_sums_and_products_of_two_doubles_have_twice_the_digits(seed):
    x, y = of_seed(seed)
    for found, of_one in (
        (x + y, lambda a, b: (a + b, abs(a) + abs(b))),
        (x - y, lambda a, b: (a - b, abs(a) + abs(b))),
        (x * y, lambda a, b: (a * b, abs(a * b))),
    ):
        for value, a, b in zip(exact(found), exact(x), exact(y), strict=True):
            right, size = of_one(a, b)
            assert abs(value - right) <= 8 * Fraction(EPS) ** 2 * size


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["band", "rows", "long"]))
def test_products_with_a_matrix_lose_nothing_to_cancellation(seed, kind):
    """q is chosen such that M z + q all but vanishes."""
    random, n = np.random.default_rng(seed), 30
    z, _ = of_seed(seed, n)
    M = random_array((n, n), density=0.1, format="csr", rng=random)
    if kind == "band":
        M = csr_array(np.triu(np.tril(random.normal(size=(n, n)), 2), -2))
    if kind == "long":
        M = csr_array(np.vstack((M.toarray()[1:], random.normal(size=n))))
    q = -(M @ z.high)
    w = AccurateProduct(M)(z, q)
    products = bands.product(M, exact(z))
    right = [a + Fraction(b) for a, b in zip(products, q.tolist(), strict=True)]
    terms = abs(M) @ abs(z.high) + abs(q)
    for found, value, size in zip(w, right, terms, strict=True):
        error = abs(Fraction(float(found)) - value)
        assert error <= 4 * EPS * abs(value) + n * Fraction(EPS) ** 2 * float(size)


def band_of(seed, is_symmetric, is_shuffled):
    random, n = default_rng(seed), 40
    M = np.triu(np.tril(random.normal(size=(n, n)), 2), -2)
    M = (M + M.T if is_symmetric else M) + 12 * np.eye(n)
    order = random.permutation(n) if is_shuffled else np.arange(n)
    return csr_array(M[order][:, order])


@pytest.mark.parametrize("is_symmetric", [True, False])
@pytest.mark.parametrize("is_shuffled", [True, False])
def test_bands_solve_what_dense_matrices_do(is_symmetric, is_shuffled):
    M, random = band_of(5, is_symmetric, is_shuffled), default_rng(6)
    n = M.shape[0]
    band = Banded(M)
    assert band.is_symmetric == is_symmetric
    assert band.width <= 4
    d, b, basic = random.random(n), random.normal(size=n), random.random(n) < 0.6
    b_of_basis = np.where(basic, b, 0.0)
    whole, B = M.toarray(), np.ix_(basic, basic)
    x = np.linalg.solve(whole + np.diag(d), b)
    x_of_basis = np.zeros(n)
    x_of_basis[basic] = np.linalg.solve(whole[B], b[basic])
    band.factorize(d)
    found = band.solve(b)
    band.factorize(None, basic)
    found_of_basis = band.solve(b_of_basis)
    solve, is_definite = band.fixed_point(d)
    assert is_definite
    of_basis, _ = band.fixed_point(None, basic)
    for own, expected in (
        (found, x),
        (found_of_basis, x_of_basis),
        (solve(b).high, x),
        (of_basis(b_of_basis).high, x_of_basis),
    ):
        np.testing.assert_allclose(own, expected, rtol=1e-12, atol=1e-14)


def test_fixed_point_factors_solve_what_doubles_cannot():
    """Condition 1e17: the solution is right to the last digits of a double."""
    M = csr_array(make("beam", 150, contrast=1e8, support="hinged").M)
    random = default_rng(1)
    b = random.normal(size=150)
    right = bands.solution(M, list(map(Fraction, b)))
    solve, is_definite = Banded(M).fixed_point(None)
    assert is_definite
    for found, value in zip(exact(solve(b)), right, strict=True):
        assert abs(found - value) <= EPS * abs(value)


def test_singular_and_indefinite_bands_are_told_apart():
    B = np.eye(48, 50) - 2 * np.eye(48, 50, k=1) + np.eye(48, 50, k=2)
    M = csr_array(B.T @ B)  # exactly singular
    with pytest.raises(SingularMatrix):
        Banded(M).fixed_point(None)
    _, is_definite = Banded(M).fixed_point(np.full(50, -(2.0**-80)))
    assert not is_definite
    _, is_definite = Banded(M).fixed_point(np.full(50, 2.0**-80))
    assert is_definite


def test_basic_solutions_are_refined_or_factorized_again_as_needed():
    for n, extended in ((100, 0), (15_000, 1)):
        problem = make("beam", n)
        systems = DefiniteSystems(problem.M, None)
        basic = np.ones(n, dtype=bool)
        z, w = systems.basic(problem.q, np.zeros(n), basic)
        assert systems.extended == extended
        left = AccurateProduct(problem.M)(z, problem.q)
        terms = abs(problem.M) @ abs(z.high)
        assert (np.abs(left) <= 1e-28 * terms.max()).all()
        assert not w.any()


def test_condition_and_definiteness_do_not_depend_on_units():
    M = csr_array(make("beam", 200).M)
    U = diags_array([10.0 ** default_rng(0).uniform(-9, 9, 200)], offsets=[0])
    in_units = csr_array(U @ M @ U)
    size = float(np.linalg.cond(M.toarray()))
    assert condition(M) == pytest.approx(size, rel=0.5)
    assert condition(in_units) == pytest.approx(size, rel=0.9)
    assert is_nearly_definite(in_units)
    assert not is_nearly_definite(csr_array(M - 1e-3 * eye_array(200)))


def test_a_value_is_deleted_by_the_thread_that_has_made_it():
    threads = []

    class Value:
        def __init__(self):
            threads.append(threading.current_thread())

        def __del__(self):
            threads.append(threading.current_thread())

    own = owned(Value)
    assert isinstance(own.value, Value)
    made = threads[0]
    assert made is not threading.current_thread()
    del own
    made.join(10)
    assert threads == [made, made]


@pytest.mark.parametrize("power", [0, -500, -515, -525, -530, -537, -540])
def test_bounds_on_rounding_cover_products_that_underflow_in_part(power):
    random = default_rng(0)
    for n in (1, 3, 30):
        M, z = 2.0**power * random.random((n, n)), 2.0**power * random.random(n)
        w = M @ z
        errors = row_errors(M, z, w).tolist()
        numbers = list(map(Fraction, z.tolist()))
        for row, value, error in zip(M.tolist(), w.tolist(), errors, strict=True):
            total = sum(Fraction(a) * b for a, b in zip(row, numbers, strict=True))
            assert abs(Fraction(value) - total) <= Fraction(error)
