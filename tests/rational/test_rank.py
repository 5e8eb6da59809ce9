"""The rank of whole numbers is proved, and a larger one disproved, whatever their
length; and which numbers are rounded."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import qr

from lcpcli.rational.numbers import are_rounded, as_written
from lcpcli.rational.rank import has_rank

from ..exact import reduced


def rank(A):
    """The number of independent rows, in fractions."""
    rows = [[*map(Fraction, row)] for row in A.tolist()]
    return len(reduced(rows, A.shape[1]))


@pytest.mark.parametrize("size", [9, 10**6, 10**12])
@pytest.mark.parametrize("seed", range(8))
def test_a_rank_that_floats_show_is_proved_or_disproved(seed, size):
    random = np.random.default_rng(seed)
    m, n = random.integers(1, 14, 2)
    k = int(random.integers(1, min(m, n) + 1))
    left = random.integers(-size, size + 1, (m, k)).astype(object)
    right = random.integers(-size, size + 1, (k, n)).astype(object)
    A = left @ right
    A[0, 0] += seed % 2  # which floats hardly show
    columns = np.sort(
        qr(left.astype(float) @ right.astype(float), pivoting=True)[2][:k]
    )
    rows = np.sort(qr(A[:, columns].T.astype(float), pivoting=True)[2][:k])
    true, part = map(rank, (A, A[np.ix_(rows, columns)]))
    if part == k:
        assert has_rank(A, rows, columns) is (true == k)
        if size == 9:
            assert has_rank(A.astype(float), rows, columns) is (true == k)


@settings(max_examples=60)
@given(
    st.floats(allow_nan=False, allow_infinity=False)
    | st.builds(lambda m, e: float(f"{m}e{e}"), st.integers(), st.integers(-40, 20))
)
def test_numbers_are_rounded_by_their_decimals(value):
    """Those of 15 digits or more, but whole ones."""
    digits = Decimal(repr(value)).normalize().as_tuple().digits
    is_rounded = len(digits) >= 15 and value != round(value)
    assert are_rounded(np.array([value, 0.25])).tolist() == [is_rounded, False]
    assert are_rounded(np.array([-value])).tolist() == [is_rounded]


@settings(max_examples=30)
@given(st.lists(st.integers(-(10**6), 10**6), min_size=1), st.integers(0, 5))
def test_decimals_are_written_as_whole_numbers(whole, places):
    values = np.array(whole) / 10.0**places
    found, unit = as_written(values)
    assert [Fraction(int(v), int(unit)) for v in found.tolist()] == [
        Fraction(v, 10**places) for v in whole
    ]
    computed = np.array([1 / 3, *whole])
    assert as_written(computed)[0] is computed
