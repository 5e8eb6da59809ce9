"""Products with one matrix: those of scipy's operator, with its routine or without."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli.linalg.multiplier import multiplier


@pytest.mark.parametrize("hidden", [False, True], ids=["routine", "operator"])
def test_products_are_those_of_the_operator(hidden: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if hidden:
        monkeypatch.setitem(sys.modules, "scipy.sparse._sparsetools", None)
    random = np.random.default_rng(0)
    for shape in ((5, 5), (3, 7), (40, 1)):
        A, v = random.standard_normal(shape) * (random.random(shape) < 0.3), random.standard_normal(shape[1])
        for M in (A, csr_array(A)):
            times = multiplier(M)
            assert np.array_equal(times(v), times(v))
            assert times(v) == pytest.approx(A @ v)
