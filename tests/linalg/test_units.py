"""The units that a matrix suggests: those of the measure, which powers of two do not change, and those of scaling;
products and largest entries."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli.linalg.logarithms import mean_logarithms
from lcpcli.linalg.matrices import column_maxima, multiplier, norm_inf, row_and_column_maxima, row_maxima
from lcpcli.linalg.units import equilibrate, units


@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 400), density=st.sampled_from([0.2, 0.5, 1.0]))
def test_units_of_rows_and_columns_follow_powers_of_two(seed: int, spread: int, density: float) -> None:
    generator = np.random.default_rng(seed)
    powers = generator.integers(-spread, spread + 1, (2, 6)).astype(float)
    M = generator.standard_normal((6, 6)) * (generator.random((6, 6)) < density)
    scaled = np.exp2(powers[0])[:, None] * M * np.exp2(powers[1])
    plain, other, sparse = units(M), units(scaled), units(csr_array(scaled))
    for part in range(plain.parts):
        rows, columns = plain.row_part == part, plain.column_part == part
        moved = np.concatenate(
            ((other.rows - plain.rows + powers[0])[rows], (plain.columns - other.columns - powers[1])[columns])
        )
        assert np.ptp(moved) <= 1e-8
    assert np.allclose(sparse.rows, other.rows, atol=1e-6)
    pairs = {(a, b) for a, b in zip(other.row_part.tolist(), sparse.row_part.tolist(), strict=True)}
    assert len(pairs) == len({a for a, _ in pairs}) == len({b for _, b in pairs}), "the same components"


@pytest.mark.parametrize("shape", ["chain", "tree", "band", "ring"])
@pytest.mark.parametrize("n", [40, 300])
def test_units_are_the_least_squares_however_long_the_graph_is(n: int, shape: str) -> None:
    random = np.random.default_rng(n)
    i = np.arange(1, n)
    above = random.integers(0, i) if shape == "tree" else i - 1
    M = np.eye(n)
    M[i, above] = 10.0 ** random.uniform(-3, 3, n - 1)
    if shape == "band":
        M[i - 1, i] = 10.0 ** random.uniform(-3, 3, n - 1)
    M[0, -1] = 0.3 if shape == "ring" else M[0, -1]
    used, logarithms = M != 0, np.log2(np.where(M != 0, M, 1.0))
    for found in (units(M), units(csr_array(M))):
        left = np.where(used, logarithms + found.rows[:, np.newaxis] + found.columns, 0.0)
        assert np.abs(left.sum(axis=0)).max() <= 1e-9
        assert np.abs(left.sum(axis=1)).max() <= 1e-9
        assert shape in ("band", "ring") or np.abs(left).max() <= 1e-9


@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 40), is_program=st.booleans())
def test_rows_and_columns_have_the_same_units_where_entries_are_as_large_as_those_of_the_transpose(
    seed: int, spread: int, is_program: bool
) -> None:
    generator = np.random.default_rng(seed)
    A, R = (
        generator.standard_normal((6, 6)) * (generator.random((6, 6)) < 0.6),
        np.exp2(generator.integers(0, spread + 1, 6)),
    )
    Q = np.zeros((6, 6)) if is_program else A + A.T
    M = np.block([[R[:, None] * Q * R, -R[:, None] * A], [A.T * R, np.zeros((6, 6))]])
    sparse, dense = units(csr_array(M)), units(M)
    assert np.array_equal(sparse.rows, sparse.columns)
    assert np.allclose(sparse.rows, dense.rows, atol=1e-6)
    assert np.allclose(sparse.columns, dense.columns, atol=1e-6)
    assert sparse.parts == dense.parts


@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 40))
def test_equilibrated_rows_and_columns_have_entries_near_one(seed: int, spread: int) -> None:
    generator = np.random.default_rng(seed)
    powers = generator.integers(-spread, spread + 1, (2, 6)).astype(float)
    M = np.exp2(powers[0])[:, None] * generator.standard_normal((6, 6)) * np.exp2(powers[1])
    for matrix in (M, csr_array(M)):
        R, C = equilibrate(matrix, np.ones(6))
        scaled = R[:, None] * np.abs(M) * C
        largest = np.concatenate((scaled.max(axis=0), scaled.max(axis=1)))
        assert largest.min() >= 1 / 2
        assert largest.max() <= 2
        assert np.array_equal(np.concatenate((R, C)), np.exp2(np.rint(np.log2(np.concatenate((R, C))))))


def test_equilibration_keeps_symmetry() -> None:
    M = np.diag([1e-8, 1.0, 1e8]) + 1e-5
    R, C = equilibrate(M, np.ones(3))
    assert np.array_equal(R, C)


@pytest.mark.parametrize("other", [1.0, 2.0**20, 2.0**-30])
def test_rows_and_columns_of_zeros_are_equilibrated_too(other: float) -> None:
    M = np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    for matrix in (M, csr_array(M)):
        R, C = equilibrate(matrix, np.array([1e10, other, 0.0]))
        assert R[1] * other / 2 <= 1e10 * R[0] <= 2 * R[1] * other
        assert R[2] == C[0] == C[2] == 1.0


@pytest.mark.parametrize("n", [5, 150])
@pytest.mark.parametrize("form", [np.asarray, csr_array])
def test_largest_entries_are_those_of_absolute_values_whatever_the_size(n: int, form: type) -> None:
    random = np.random.default_rng(n)
    M = random.uniform(-2, 1, (n, n)) * (random.random((n, n)) < 0.5)
    R, C = random.random((2, n))
    given, scaled = form(M), R[:, np.newaxis] * np.abs(M) * C
    assert np.array_equal(row_maxima(given), np.abs(M).max(axis=1))
    assert np.array_equal(column_maxima(given), np.abs(M).max(axis=0))
    for found, axis in zip(row_and_column_maxima(given, R, C), (1, 0), strict=True):
        assert found == pytest.approx(scaled.max(axis=axis), rel=1e-15)
    assert norm_inf(given) == pytest.approx(np.abs(M).sum(axis=1).max(), rel=1e-14)


@given(seed=st.integers(0, 2**32 - 1), spread=st.integers(0, 3))
def test_known_maxima_and_the_diagonal_change_no_units(seed: int, spread: int) -> None:
    generator = np.random.default_rng(seed)
    sizes = np.exp2(generator.uniform(-spread, spread, 6))
    M = generator.uniform(-1, 1, (6, 6)) * sizes
    np.fill_diagonal(M, sizes * generator.choice([-1, 1], 6))
    q = np.ones(6)
    for plain, informed in zip(equilibrate(M, q), equilibrate(csr_array(M), q, np.abs(M).max(axis=1)), strict=True):
        assert np.array_equal(plain, informed)


def test_units_of_a_large_matrix_are_found_by_blocks_of_rows() -> None:
    random = np.random.default_rng(0)
    M = np.exp2(random.integers(-9, 10, 500))[:, None] * random.standard_normal((500, 500))
    found, whole = units(M), units(csr_array(M))
    assert found.parts == whole.parts == 1
    for own, other in ((found.rows, whole.rows), (found.columns, whole.columns)):
        assert np.ptp(own - other) <= 1e-9
    assert np.allclose(mean_logarithms(M[:3]) + found.rows[:3], mean_logarithms(M[:1]) + found.rows[0], atol=1e-9)


@pytest.mark.parametrize("hidden", [False, True], ids=["routine", "operator"])
def test_products_are_those_of_the_operator_of_scipy_with_its_routine_or_without(
    hidden: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if hidden:
        monkeypatch.setitem(sys.modules, "scipy.sparse._sparsetools", None)
    random = np.random.default_rng(0)
    for shape in ((5, 5), (3, 7), (40, 1)):
        A, v = random.standard_normal(shape) * (random.random(shape) < 0.3), random.standard_normal(shape[1])
        for M in (A, csr_array(A)):
            times = multiplier(M)
            assert np.array_equal(times(v), times(v))
            assert times(v) == pytest.approx(A @ v)
