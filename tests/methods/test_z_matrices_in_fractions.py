"""Chandrasekaran's method in fractions."""

from __future__ import annotations

from lcpcli import Problem
from lcpcli.methods.z_matrix import decided
from lcpcli.rational.elimination import Effort
from lcpcli.rational.exact_problem import ExactProblem


def test_a_proof_is_one_for_rows_of_different_denominators() -> None:
    """No z >= 0 has z1 / 2 - z2 / 4 >= 1 and z2 / 16 - z1 / 5 >= 1 / 10."""
    data = ExactProblem.of_decimals(Problem([[0.5, -0.25], [-0.2, 0.0625]], [-1, -0.1]))
    z, y = decided(data, Effort())
    assert z is None
    assert y is not None
    assert data.refuted_by(y)
