"""Products by blocks of rows are those of the matrix, whether or not its rows repeat, in both precisions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

from lcpcli.linalg.entries import BLOCK_ROWS
from lcpcli.linalg.stencils import Operator
from lcpcli.typing import Matrix

from ..methods.grids import line, plane, space, stream


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
