"""H+-matrices: d > 0 with <M> d > 0, found in one place and proved in the arithmetic of who asks."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from lcpcli.verify.matrix_classes import lower_image, scaling


def is_exactly_dominant(M: np.ndarray, d: np.ndarray) -> bool:
    rows, factors = [[Fraction(a) for a in row] for row in M.tolist()], [Fraction(v) for v in d.tolist()]
    sums = [sum((abs(a) * v for a, v in zip(row, factors, strict=True)), Fraction(0)) for row in rows]
    return all(2 * row[i] * factors[i] > sums[i] for i, row in enumerate(rows))


@settings(deadline=None)
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
        assert found is None or (margin >= 0 and is_exactly_dominant(M, found.d)) or n == 1


def test_scaling_is_found_where_it_varies_by_more_than_the_digits_of_a_double() -> None:
    """For the M with ones on the diagonal and 2 above it, C^-1 e = (3^(n-1), ..., 3, 1), and C d is all rounding."""
    M = np.eye(40) + 2 * np.triu(np.ones((40, 40)), 1)
    found = scaling(M, lambda d: bool(lower_image(M, np.ones(40), d).min() > 0))
    assert found is not None
    assert found.d.max() > 2.0**53 * found.d.min()
    assert is_exactly_dominant(M, found.d)
