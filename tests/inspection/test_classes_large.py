"""Classes of matrices too large for exact arithmetic alone, and semidefiniteness in floating point: no claim that
rounding has decided."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from lcpcli.gallery import families
from lcpcli.inspection.definite import semidefinite_rank
from lcpcli.inspection.verdict import NO, YES, classify
from lcpcli.interrupts import within
from lcpcli.rational.elimination import definiteness
from lcpcli.rational.numbers import integers


@pytest.mark.slow("exact arithmetic with large matrices")
def test_what_is_definite_but_for_a_singular_direction_is_never_called_definite() -> None:
    """A A' with one column too few is singular, exactly so in whole numbers; 2^-20 on the diagonal decides."""
    words = []
    for n, seed in ((70, 0), (210, 1), (210, 2), (300, 3)):
        A = np.random.default_rng(seed).integers(-3, 4, (n, n - 1)).astype(float)
        A *= np.random.default_rng(seed).random(A.shape) < 0.1
        for change in (0.0, 2.0**-20, -(2.0**-20)):
            M = A @ A.T + change * np.eye(n)
            skew = np.triu(A @ A.T, 1)
            for matrix in (M, M + skew - skew.T, sparse.csr_array(M)):
                found = classify(matrix)
                assert found["positive_definite"].word != (NO if change > 0 else YES)
                assert found["positive_semidefinite"].word != (YES if change < 0 else NO)
                words.append(found["positive_definite"].word)
    assert words.count(YES) >= 10
    assert words.count(NO) >= 10


def obstacle(m: int) -> Any:
    T = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(m, m))
    identity = sparse.eye_array(m)
    return (sparse.kron(T, identity) + sparse.kron(identity, T)).tocsr()


def test_large_sparse_matrices_are_classified_without_becoming_dense() -> None:
    L = obstacle(100)
    H = sparse.eye_array(L.shape[0])
    found = classify(L)
    assert (found["m_matrix"].word, found["positive_definite"].word) == (YES, YES)
    saddle = classify(sparse.block_array([[H, -L.T], [L, None]]).tocsr())
    assert (saddle["positive_semidefinite"].word, saddle["positive_definite"].word) == (YES, NO)
    unbalanced = classify(sparse.block_array([[H, -L.T], [2 * L, None]]).tocsr())
    assert unbalanced["positive_semidefinite"].word == NO
    assert classify((L @ L + H).tocsr())["positive_definite"].word == YES
    shifted = classify((L - 0.001 * H).tocsr())
    assert (shifted["positive_definite"].word, shifted["m_matrix"].word) == (YES, YES)
    shifted = classify((L @ L - 0.5 * H).tocsr())
    assert (shifted["positive_definite"].word, shifted["positive_semidefinite"].word) == (NO, NO)


def test_singular_matrix_without_negative_minors_is_not_excluded_by_a_null_vector() -> None:
    """A triangular one, whose principal minors are products of diagonal entries, some of which are 0."""
    M = np.diag(np.arange(20.0) % 3) + np.diag(np.full(19, 5.0), 1)
    for matrix in (M, sparse.csr_array(M)):
        found = classify(matrix)
        assert found["p_matrix"].word == NO
        assert found["p0_matrix"].word != NO


@pytest.mark.parametrize("as_matrix", [np.asarray, sparse.csr_array])
def test_matrix_of_contact_with_friction_is_copositive_in_any_order(as_matrix: Any) -> None:
    problem = families.make("contact", 48, 1)
    order = np.random.default_rng(0).permutation(problem.n)
    M = problem.M.toarray()[order][:, order] if sparse.issparse(problem.M) else problem.M[order][:, order]
    found = classify(as_matrix(M), last="copositive")
    assert (found["copositive"].word, found["positive_semidefinite"].word) == (YES, NO)
    slacks = np.flatnonzero(M.diagonal() == 0)
    assert f"no negative entry in the {slacks.size} rows where its diagonal is 0" in found["copositive"].evidence
    worse = M.copy()
    rest = np.flatnonzero(M.diagonal())[:2]
    worse[np.ix_(rest, rest)] = [[1.0, -3.0], [-3.0, 1.0]]
    with within(1.0):
        assert classify(as_matrix(worse), last="copositive")["copositive"].word == NO


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
