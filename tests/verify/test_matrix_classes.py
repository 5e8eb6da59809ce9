"""H+-matrices, d > 0 with <M> d > 0, and least eigenvalues: what floating point proves of them holds exactly."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli.verify.matrix_classes import least_eigenvalue, lower_image, scaling


def image(M: np.ndarray, d: np.ndarray) -> list[Fraction]:
    """<M> d without rounding."""
    factors = [Fraction(value) for value in d.tolist()]
    rows = [[Fraction(a if i == j else -abs(a)) for j, a in enumerate(row)] for i, row in enumerate(M.tolist())]
    return [sum((a * v for a, v in zip(row, factors, strict=True)), Fraction(0)) for row in rows]


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 12), margin=st.sampled_from([0.0, 1e-15, 1e-9, 0.1, -1e-9]))
def test_scaling_that_floating_point_proves_holds_exactly(seed: int, n: int, margin: float) -> None:
    """At the edge of the H+-matrices: <M> u = margin L u for a u that varies by 2^20."""
    random = np.random.default_rng(seed)
    M, u = random.normal(size=(n, n)), np.exp2(random.integers(-10, 11, n))
    np.fill_diagonal(M, 0)
    np.fill_diagonal(M, (1 + margin) * (np.abs(M) @ u) / u + (n == 1))
    for same in (M, csr_array(M)):
        found = scaling(same, lambda d, A=same: bool(lower_image(A, M.diagonal(), d).min() > 0))
        assert found is not None or margin < 1e-3
        assert found is None or (margin >= 0 and min(image(M, found.d)) > 0) or n == 1


def test_scaling_is_found_where_it_varies_by_more_than_the_digits_of_a_double() -> None:
    """For the M with ones on the diagonal and 2 above it, C^-1 e = (3^(n-1), ..., 3, 1), and C d is all rounding."""
    M = np.eye(40) + 2 * np.triu(np.ones((40, 40)), 1)
    found = scaling(M, lambda d: bool(lower_image(M, np.ones(40), d).min() > 0))
    assert found.d.max() > 2.0**53 * found.d.min()
    assert min(image(M, found.d)) > 0


@settings(deadline=None, max_examples=100)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 40), power=st.integers(0, 14))
def test_verified_least_eigenvalue_is_one(seed: int, n: int, power: int) -> None:
    """A'A + mu I for integers A has no eigenvalue below mu, and a column of zeros in A makes mu the least one."""
    A = np.random.default_rng(seed).integers(-4, 5, size=(n, n)) / 16.0
    A[:, 0] = 0
    mu = 2.0**-power
    least = least_eigenvalue(A.T @ A + mu * np.eye(n))
    assert 0.99 * mu <= least <= mu
    assert least_eigenvalue(A.T @ A) is None


@settings(deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8))
def test_product_with_the_comparison_matrix_is_never_overestimated(seed: int, n: int) -> None:
    """At the edge of the H+ matrices, where <M> u is all rounding."""
    random = np.random.default_rng(seed)
    M, u = random.normal(size=(n, n)), random.random(n) + 1e-3
    np.fill_diagonal(M, 0)
    np.fill_diagonal(M, np.abs(M) @ u / u)
    for same in (M, csr_array(M)):
        claimed = lower_image(same, M.diagonal(), u)
        assert all(Fraction(a) <= b for a, b in zip(claimed.tolist(), image(M, u), strict=True))
