"""Matrices in compressed rows that are made of arrays, beside those that scipy makes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, random_array

from lcpcli import Problem, from_qp
from lcpcli.linalg import compressed_rows
from lcpcli.linalg.compressed_rows import of_columns, of_entries, principal
from lcpcli.linalg.entries import BLOCK_ROWS
from lcpcli.linalg.stencils import Operator
from lcpcli.typing import Matrix

from ..methods.grids import line, plane, space, stream


@pytest.fixture(params=["unchecked", "public"], autouse=True)
def routines(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once with scipy's routines without checks, and once as where they are not found."""
    if request.param == "public":
        monkeypatch.setattr(compressed_rows, "unchecked", None)
        monkeypatch.setattr(compressed_rows, "EMPTY", None)


def same(made: Matrix, expected: Any) -> bool:
    """Whether both have the same entries, and scipy accepts the arrays of the first one."""
    made.check_format(full_check=True)
    return bool(made.has_canonical_format and made.shape == expected.shape and not (made != csr_array(expected)).nnz)


def test_columns_become_rows_whatever_their_order_and_the_type_of_indices() -> None:
    for shape in ((7, 7), (3, 9), (9, 3), (1, 1), (4, 0)):
        A = csc_array(random_array(shape, density=0.4, rng=1))
        assert same(of_columns(A), A)
        wide = A.copy()
        wide.indptr, wide.indices = wide.indptr.astype(np.int64), wide.indices.astype(np.int64)
        assert same(of_columns(wide), A)
    A = csc_array((np.array([1.0, 2, 4]), np.array([2, 0, 2]), np.array([0, 3, 3, 3])), shape=(3, 3))
    assert same(Problem(A, np.ones(3)).M, np.array([[2.0, 0, 0], [0, 0, 0], [5, 0, 0]]))


def test_entries_in_any_order_are_summed_where_they_meet() -> None:
    random = np.random.default_rng(2)
    rows, columns = random.integers(0, 6, (2, 40))
    values = random.integers(-3, 4, 40).astype(float)
    parts = np.split(rows, [13]), np.split(columns.astype(np.int64), [13]), np.split(values, [13])
    assert same(of_entries((6, 8), *parts), coo_array((values, (rows, columns)), shape=(6, 8)).tocsr())


def test_principal_submatrices_are_those_of_scipy() -> None:
    A = csr_array(random_array((30, 30), density=0.15, rng=3))
    for indices in (np.arange(30), np.arange(0, 30, 3), np.array([29]), np.arange(0)):
        assert same(principal(A, indices), A[indices][:, indices])


def test_programs_by_columns_and_by_rows_have_the_same_conditions() -> None:
    A, Q = random_array((5, 8), density=0.5, rng=4), csr_array(np.diag(np.arange(8.0)))
    ends = {"row_lower": [0.0, -1, -np.inf, 2, 3], "row_upper": [1.0, np.inf, 2, 2, 4]}
    made = [from_qp(form(Q), np.ones(8), form(A), **ends) for form in (csr_array, csc_array, coo_array)]
    dense = from_qp(Q.toarray(), np.ones(8), A.toarray(), **ends)
    for problem in made:
        assert same(problem.M, dense.M)
        assert not problem.M.data.flags.writeable
        assert np.array_equal(problem.q, dense.q)


def with_other_rows(M: Matrix) -> Matrix:
    """M with other numbers in a few rows, and with an entry more or fewer in others."""
    M = M.tolil()
    M[M.shape[0] // 2, 3] = 7.0
    M[M.shape[0] // 3, M.shape[0] // 3] = 5.0
    M[M.shape[0] // 4, M.shape[0] // 4 + 1] = 0.0
    return csr_array(M)


MATRICES = {
    "line": line(2 * BLOCK_ROWS + 5),
    "plane": plane(150, 0.1) / 3,
    "space": space(25),
    "stream": stream(130, 50),
    "other rows": with_other_rows(plane(130)),
    "small": plane(9),
    "variable": csr_array(plane(110) @ diags_array(np.linspace(1, 2, 12_100))),
    "diagonal": csr_array(diags_array(np.full(10_000, 3.0))),
    "zero": csr_array((9000, 9000)),
    "empty": csr_array((0, 0)),
}
STENCILS = {"line", "plane", "space", "stream", "other rows", "diagonal"}


@pytest.mark.parametrize("name", MATRICES)
def test_products_are_those_of_the_matrix(name: str) -> None:
    M = MATRICES[name]
    x, b, factors = np.random.default_rng(0).standard_normal((3, M.shape[0]))
    operator = Operator(M)
    assert np.allclose(operator(x), M @ x, rtol=0, atol=1e-13)
    assert np.allclose(operator(x, factors), factors * (M @ x), rtol=0, atol=1e-13)
    residual = factors * (b - M @ x)
    assert np.allclose(operator.residual(x, b, factors, np.empty_like(x)), residual, rtol=0, atol=1e-13)
    assert np.allclose(operator.relaxed(x, b, factors, 0.5), x + 0.5 * residual, rtol=0, atol=1e-13)
    image = operator.in_single_precision()(x.astype(np.float32))
    assert image.dtype == np.float32
    assert np.allclose(image, M @ x, rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", MATRICES)
def test_rows_that_repeat_are_not_read(name: str) -> None:
    M = MATRICES[name].copy()
    x = np.ones(M.shape[0])
    operator, before = Operator(M), M @ x
    M.data[:] = np.nan
    assert np.array_equal(operator(x), before) == (name in STENCILS or not M.nnz)
