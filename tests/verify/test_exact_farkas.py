"""Exact proofs of infeasibility from a Farkas vector in doubles that is one but for rounding."""

from __future__ import annotations

import numpy as np

from lcpcli import Problem
from lcpcli.rational.exact_problem import ExactProblem
from lcpcli.verify.exact_farkas import exact_proof


def test_farkas_vector_is_corrected_where_no_double_fits() -> None:
    """3 y1 = y2 is asked for with a y1 that is no multiple: only the corrected vector has M'y = 0."""
    data = ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 1]))
    y = exact_proof(data, np.array([np.pi, 3 * np.pi * (1 + 1e-12)]))
    assert y is None  # q'y = 2 y1 > 0
    data = ExactProblem.of_floats(Problem([[3, -3], [-1, 1]], [-1, 0.25]))
    y = exact_proof(data, np.array([np.pi, 3 * np.pi * (1 + 1e-12)]))
    assert y is not None
    assert data.refuted_by(y)
    assert y[1] == 3 * y[0]


def test_farkas_vector_is_found_where_rounding_has_made_columns_independent() -> None:
    """10 y1 = y2 in decimals, but as doubles 0.1 and 0.3 make M nonsingular: M'y = 0 has no solution, M'y < 0 has."""
    problem, y = Problem([[1, 3], [-0.1, -0.3]], [-1, 0]), np.array([0.1, 1.0])
    assert exact_proof(ExactProblem.of_decimals(problem), y) == [1, 10]
    data = ExactProblem.of_floats(problem)
    found = exact_proof(data, y)
    assert found is not None
    assert data.refuted_by(found)
