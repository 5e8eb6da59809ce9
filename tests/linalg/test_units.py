"""The units that a matrix suggests: those of the measure, which powers of two do not
change, and those of scaling; products, largest entries, and matrices in compressed rows
that are made of arrays, beside those that scipy makes."""

import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csc_array, csr_array, diags_array, random_array

import lcpcli
from lcpcli import Problem
from lcpcli.linalg.matrices import (
    column_maxima,
    dense,
    multiplier,
    norm_inf,
    row_and_column_maxima,
    row_maxima,
    scaled,
)
from lcpcli.linalg.stencils import Operator
from lcpcli.linalg.units import Base, equilibrate, units
from lcpcli.model.arrays import as_matrix

from ..methods.grids import plane, space, stream
from ..seeds import few_of


@settings(max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1),
    spread=st.integers(0, 400),
    density=st.sampled_from([0.2, 0.5, 1.0]),
)
def test_units_of_rows_and_columns_follow_powers_of_two(seed, spread, density):
    generator = np.random.default_rng(seed)
    powers = generator.integers(-spread, spread + 1, (2, 6)).astype(float)
    M = generator.standard_normal((6, 6)) * (generator.random((6, 6)) < density)
    scaled = np.exp2(powers[0])[:, None] * M * np.exp2(powers[1])
    plain, other, sparse = units(M), units(scaled), units(csr_array(scaled))
    for part in range(plain.parts):
        rows, columns = plain.row_part == part, plain.column_part == part
        moved = np.concatenate(
            (
                (other.rows - plain.rows + powers[0])[rows],
                (plain.columns - other.columns - powers[1])[columns],
            )
        )
        assert np.ptp(moved) <= 1e-8
    assert np.allclose(sparse.rows, other.rows, atol=1e-6)
    pairs = set(zip(other.row_part.tolist(), sparse.row_part.tolist(), strict=True))
    ours, theirs = map(set, zip(*pairs, strict=True))
    assert len(pairs) == len(ours) == len(theirs), "the same components"


@pytest.mark.parametrize("shape", ["chain", "tree", "band", "ring"])
@pytest.mark.parametrize("n", [40, 300])
def test_units_are_the_least_squares_however_long_the_graph_is(n, shape):
    random = default_rng(n)
    i = np.arange(1, n)
    above = random.integers(0, i) if shape == "tree" else i - 1
    M = np.eye(n)
    M[i, above] = 10.0 ** random.uniform(-3, 3, n - 1)
    if shape == "band":
        M[i - 1, i] = 10.0 ** random.uniform(-3, 3, n - 1)
    M[0, -1] = 0.3 if shape == "ring" else M[0, -1]
    used, logarithms = M != 0, np.log2(np.where(M != 0, M, 1.0))
    for found in (units(M), units(csr_array(M))):
        left = np.where(
            used, logarithms + found.rows[:, np.newaxis] + found.columns, 0.0
        )
        assert np.abs(left.sum(axis=0)).max() <= 1e-9
        assert np.abs(left.sum(axis=1)).max() <= 1e-9
        assert shape in ("band", "ring") or np.abs(left).max() <= 1e-9


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 40))
def test_equilibrated_rows_and_columns_have_entries_near_one(seed, spread):
    generator = np.random.default_rng(seed)
    powers = generator.integers(-spread, spread + 1, (2, 6)).astype(float)
    units = np.exp2(powers)
    M = units[0][:, None] * generator.standard_normal((6, 6)) * units[1]
    for matrix in (M, csr_array(M)):
        R, C = equilibrate(matrix, np.ones(6))
        scaled = R[:, None] * np.abs(M) * C
        for axis in (0, 1):
            assert (np.abs(scaled.max(axis=axis) - 1.25) <= 0.75).all()
        for factors in (R, C):
            assert (np.frexp(factors)[0] == 0.5).all(), "powers of two"


def test_equilibration_keeps_symmetry():
    M = np.diag([1e-8, 1.0, 1e8]) + 1e-5
    R, C = equilibrate(M, np.ones(3))
    assert np.array_equal(R, C)


@pytest.mark.parametrize("other", [1.0, 2.0**20, 2.0**-30])
def test_rows_and_columns_of_zeros_are_equilibrated_too(other):
    M = np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    for matrix in (M, csr_array(M)):
        R, C = equilibrate(matrix, np.array([1e10, other, 0.0]))
        assert R[1] * other / 2 <= 1e10 * R[0] <= 2 * R[1] * other
        assert R[2] == C[0] == C[2] == 1.0


@pytest.mark.parametrize("form", [np.array, csr_array])
def test_a_scaled_entry_that_overflows_is_the_largest_number(form):
    largest, factors = np.finfo(float).max, np.array([1.0, 1e200])
    made = scaled(form([[1.0, -1e200], [2.0, 0.5]]), factors, factors)
    assert dense(made).tolist() == [[1.0, -largest], [2e200, largest]]


@pytest.mark.parametrize("n", [5, 150])
@pytest.mark.parametrize("form", [np.asarray, csr_array])
def test_largest_entries_are_those_of_absolute_values_whatever_the_size(n, form):
    random = default_rng(n)
    M = random.uniform(-2, 1, (n, n)) * (random.random((n, n)) < 0.5)
    R, C = random.random((2, n))
    given, scaled = form(M), R[:, np.newaxis] * np.abs(M) * C
    assert np.array_equal(row_maxima(given), np.abs(M).max(axis=1))
    assert np.array_equal(column_maxima(given), np.abs(M).max(axis=0))
    for found, axis in zip(row_and_column_maxima(given, R, C), (1, 0), strict=True):
        assert found == pytest.approx(scaled.max(axis=axis), rel=1e-15)
    assert norm_inf(given) == pytest.approx(np.abs(M).sum(axis=1).max(), rel=1e-14)


@pytest.mark.parametrize("hidden", [False, True], ids=["routine", "operator"])
def test_products_are_those_of_scipy_with_its_routine_or_without(hidden, monkeypatch):
    if hidden:
        monkeypatch.setitem(sys.modules, "scipy.sparse._sparsetools", None)
    M = csr_array([[1.0, 0.0, 2.0], [0.0, 3.0, 0.0]])
    assert multiplier(M)(np.array([1.0, 2.0, 4.0])).tolist() == [9.0, 6.0]


def same(made, expected):
    """Whether both have the same entries, and scipy accepts the arrays of the first
    one."""
    made.check_format(full_check=True)
    return bool(
        made.has_canonical_format
        and made.shape == expected.shape
        and not (made != csr_array(expected)).nnz
    )


def test_columns_become_rows_whatever_their_order_and_the_type_of_indices():
    for shape in ((7, 7), (3, 9), (9, 3), (1, 1)):
        A = csc_array(random_array(shape, density=0.4, rng=1))
        assert same(as_matrix("A", A), A)
        wide = A.copy()
        wide.indptr = wide.indptr.astype(np.int64)
        wide.indices = wide.indices.astype(np.int64)
        assert same(as_matrix("A", wide), A)
    A = csc_array(([1.0, 2, 4], [2, 0, 2], [0, 3, 3, 3]), shape=(3, 3))
    assert same(Problem(A, np.ones(3)).M, np.array([[2.0, 0, 0], [0, 0, 0], [5, 0, 0]]))


def with_other_rows(M):
    """M with other numbers in a few rows, and with an entry more or fewer in others."""
    M = M.tolil()
    M[M.shape[0] // 2, 3] = 7.0
    M[M.shape[0] // 3, M.shape[0] // 3] = 5.0
    M[M.shape[0] // 4, M.shape[0] // 4 + 1] = 0.0
    return csr_array(M)


MATRICES = {
    "space": space(25),
    "stream": stream(130, 50),
    "other rows": with_other_rows(plane(130)),
    "small": plane(9),
    "variable": csr_array(plane(110) @ diags_array(np.linspace(1, 2, 12_100))),
    "zero": csr_array((9000, 9000)),
    "empty": csr_array((0, 0)),
}


@pytest.mark.parametrize("name", MATRICES)
def test_products_are_those_of_the_matrix(name):
    M = MATRICES[name]
    x, b, factors = default_rng(0).standard_normal((3, M.shape[0]))
    operator = Operator(M)
    residual = factors * (b - M @ x)
    for found, expected in (
        (operator(x), M @ x),
        (operator(x, factors), factors * (M @ x)),
        (operator.residual(x, b, factors, np.empty_like(x)), residual),
        (operator.relaxed(x, b, factors, 0.5), x + 0.5 * residual),
    ):
        assert np.allclose(found, expected, rtol=0, atol=1e-13)
    image = operator.in_single_precision()(x.astype(np.float32))
    assert image.dtype == np.float32
    assert np.allclose(image, M @ x, rtol=0, atol=1e-4)


@pytest.mark.parametrize("seed", few_of(range(8), 4))
def test_units_of_the_matrix_before_bound_those_of_one_near_it(seed):
    """Quotients of the factors of two rows in one component, sparse and dense."""
    random = default_rng(seed)
    n = 12
    M = random.normal(size=(n, n)) * 10.0 ** random.integers(-3, 4, (n, n))
    M[random.random((n, n)) < 0.7 * (seed % 2)] = 0.0
    before = Base(M, units(M))
    near = M * (1 + 10.0 ** -random.integers(2, 6) * random.uniform(-1, 1, M.shape))
    digits, of_near = before.digits_to(near), units(near)
    assert 0 < digits < 2
    changes = of_near.rows - before.units.rows
    for part in range(of_near.parts):
        of_part = changes[of_near.row_part == part]
        assert np.ptp(of_part) <= digits if of_part.size else True
    assert before.digits_to(M) == 0
    assert before.digits_to(2 * M) == np.inf
    assert before.digits_to(np.where(M[0, 0] == M, 1.0 - (M != 0), M)) == np.inf


@pytest.mark.parametrize("is_sparse", [False, True])
def test_tails_of_a_gaussian_do_not_decide_the_units_of_its_rows(is_sparse):
    t = np.linspace(0.0, 1.0, 60)
    M = np.exp(-((t[:, np.newaxis] - t) ** 2) / 0.002)
    assert M.min() < 1e-200
    cut = np.where(M < 1e-40, 0.0, M)
    R, C = np.exp2(np.arange(60) % 7 - 3.0), np.exp2(np.arange(60) % 5 - 2.0)
    as_given, scaled, without_tails = (
        units(csr_array(A) if is_sparse else A)
        for A in (M, R[:, np.newaxis] * M * C, R[:, np.newaxis] * cut * C)
    )
    assert np.ptp(as_given.rows) <= 8.0
    for other in (scaled, without_tails):
        change = as_given.rows - other.rows - np.log2(R)
        np.testing.assert_allclose(change, change[0], atol=1e-5)


def test_a_column_that_decays_does_not_decide_the_units_of_the_others():
    """A fit of four exponentials, one of which soon leaves no number that counts."""
    times = np.arange(20.0)
    A = np.exp(-np.multiply.outer(times, [0.2, 0.4, 0.6, 12.0]))
    b = A @ [1.0, 0.5, 0.2, 15.0]
    problem = lcpcli.from_lsq(A, b, lower=1e-8)
    result = lcpcli.run(problem)
    assert result.solved
    np.testing.assert_allclose(A @ result.answer.x, b, rtol=1e-6)
