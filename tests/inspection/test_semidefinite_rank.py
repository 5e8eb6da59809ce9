"""Semidefiniteness that floating point proves: never where exact arithmetic knows better."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from lcpcli.inspection.definite import semidefinite_rank
from lcpcli.rational.elimination import definiteness
from lcpcli.rational.numbers import integers


@settings(deadline=None)
@given(st.integers(1, 12), st.integers(0, 12), st.integers(0, 2**20), st.sampled_from([0, 2.0**-40, -(2.0**-40)]))
def test_rank_is_claimed_only_of_what_exact_arithmetic_finds_semidefinite(n: int, r: int, seed: int, e: float) -> None:
    """F F' for whole numbers F with rows of zeros, as it is or with a small change of one row's diagonal entry."""
    random = np.random.default_rng(seed)
    F = random.integers(-2, 3, (n, r)) * (random.random((n, 1)) < 0.8)
    S = np.array(F @ F.T, dtype=float)
    S[seed % n, seed % n] += e
    exact = definiteness(integers(S), lambda: None)
    for matrix in (S, sparse.csr_array(S)):
        rank = semidefinite_rank(matrix)
        assert rank is None or exact.negative is None
        assert rank != n or exact.zero is None
        assert e or rank in (None, np.linalg.matrix_rank(F) if r else 0)


@pytest.mark.parametrize("n", [5, 100, 300])
def test_singular_sum_of_squares_is_decided_at_every_size(n: int) -> None:
    """The squares of x_i - x_(i+1): one null vector, of ones, for which elimination in fractions needs n steps."""
    F = np.eye(n) - np.eye(n, k=1)
    S = F[:-1].T @ F[:-1] + 0.0
    assert [semidefinite_rank(matrix) for matrix in (S, sparse.csr_array(S))] == [n - 1, n - 1]
    S[0, 0] -= 2.0**-50
    assert semidefinite_rank(S) is None
