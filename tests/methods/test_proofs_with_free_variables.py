"""Rays of Lemke's method that prove that there is no solution, where some variables are free."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli


@pytest.mark.parametrize(
    ("M", "q", "y"),
    [
        ([[1, 1], [1, -1]], [0, -1], [-1, 1]),
        ([[1, 1], [-2, -3]], [-1, -1], [2, 1]),
        ([[2, 1], [4, 1]], [0, -1], [-2, 1]),
    ],
)
def test_the_multipliers_of_equations_have_the_sign_that_leaves_out_the_free_variables(
    M: list[list[float]], q: list[float], y: list[float]
) -> None:
    result = lcpcli.solve(M, q, "lemke", lower=[-np.inf, 0])
    assert result.status is lcpcli.Status.INFEASIBLE
    assert result.certificate is not None
    assert result.certificate.vector == pytest.approx(y)
