"""Principal systems of tridiagonal matrices, beside those of numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array, diags_array

from lcpcli.linalg.factors import PrincipalSolver
from lcpcli.linalg.tridiagonal import tridiagonal


@given(st.integers(2, 12), st.integers(0, 2**32 - 1))
def test_principal_systems_are_those_of_the_dense_matrix(n: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    M = csr_array(
        diags_array([random.normal(size=n - 1), random.normal(size=n), random.normal(size=n - 1)], offsets=[-1, 0, 1])
    )
    P = np.flatnonzero(random.random(n) < 0.7)
    if not P.size:
        return
    A, b = M.toarray()[np.ix_(P, P)], random.normal(size=P.size)
    if np.linalg.cond(A) > 1e6:
        return
    expected = np.linalg.solve(A, b)
    assert np.abs(PrincipalSolver(M).at(P)(b) - expected).max() <= 1e-7 * max(1.0, np.abs(expected).max())


def test_only_tridiagonal_matrices_count_as_such() -> None:
    assert tridiagonal(csr_array(np.eye(3))) is not None
    assert tridiagonal(csr_array(np.ones((3, 3)))) is None
    assert tridiagonal(csr_array([[1.0]])) is None


@pytest.mark.parametrize("P", [[0], [0, 1]])
def test_a_singular_block_is_reported(P: list[int]) -> None:
    M = csr_array([[0.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 1.0]])
    with pytest.raises(np.linalg.LinAlgError):
        PrincipalSolver(M).at(np.array(P))(np.ones(len(P)))
