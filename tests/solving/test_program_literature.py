"""Programs of the literature, with the optimal values that it gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lcpcli import from_qp, run
from lcpcli.solving.answer import Minimum

# W. Hock, K. Schittkowski, Test Examples for Nonlinear Programming Codes (1981); E. M. L. Beale, Cycling in the dual
# simplex algorithm (1955); V. Klee, G. J. Minty, How good is the simplex algorithm? (1972), in V. Chvatal's form,
# Linear Programming (1983), chapter 4.
PROGRAMS: dict[str, tuple[dict[str, Any], float]] = {
    "Hock-Schittkowski 21": (
        {
            "Q": [[0.02, 0], [0, 2]],
            "c": [0, 0],
            "A": [[10, -1]],
            "b": [10],
            "lower": [2, -50],
            "upper": [50, 50],
            "constant": -100,
        },
        -99.96,
    ),
    "Hock-Schittkowski 35": (
        {
            "Q": [[4, 2, 2], [2, 4, 0], [2, 0, 2]],
            "c": [-8, -6, -4],
            "A": [[1, 1, 2]],
            "row_upper": [3],
            "constant": 9,
        },
        1 / 9,
    ),
    "Hock-Schittkowski 76": (
        {
            "Q": [[2, 0, -1, 0], [0, 1, 0, 0], [-1, 0, 2, 1], [0, 0, 1, 1]],
            "c": [-1, -3, 1, -1],
            "A": [[1, 2, 1, 1], [3, 1, 2, -1], [0, 1, 4, 0]],
            "row_lower": [None, None, 1.5],
            "row_upper": [5, 4, None],
        },
        -4.681818181818182,
    ),
    "Beale's cycling example": (
        {
            "Q": None,
            "c": [-0.75, 150, -0.02, 6],
            "A": [[0.25, -60, -0.04, 9], [0.5, -90, -0.02, 3], [0, 0, 1, 0]],
            "row_upper": [0, 0, 1],
        },
        -0.05,
    ),
    "Klee-Minty": (
        {
            "Q": None,
            "c": [100, 10, 1],
            "A": [[1, 0, 0], [20, 1, 0], [200, 20, 1]],
            "row_upper": [1, 100, 10000],
            "sense": "max",
        },
        10000,
    ),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_optimal_values_are_those_of_the_literature(name: str) -> None:
    given, value = PROGRAMS[name]
    answer = run(from_qp(**given)).answer
    assert isinstance(answer, Minimum)
    assert answer.objective == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("name", PROGRAMS)
def test_duality_proves_the_optimal_values(name: str) -> None:
    given, value = PROGRAMS[name]
    answer = run(from_qp(**given)).answer
    assert isinstance(answer, Minimum)
    assert answer.x is not None
    assert answer.y is not None
    assert answer.bound_multipliers is not None
    x, k = answer.x, len(given["c"])
    A, Q = np.array(given["A"]), np.zeros((k, k)) if given["Q"] is None else np.array(given["Q"])
    assert Q @ x + given["c"] == pytest.approx(A.T @ answer.y + answer.bound_multipliers, abs=1e-9)
    low = given.get("row_lower", given.get("b", [None] * len(A)))
    sign = -1 if given.get("sense") == "max" else 1
    y, own = sign * answer.y, sign * answer.bound_multipliers
    rows = dual(y, low, given.get("row_upper", [None] * len(A)))
    bounds = dual(own, given.get("lower", [0] * k), given.get("upper", [None] * k))
    assert sign * (rows + bounds) - x @ Q @ x / 2 + given.get("constant", 0) == pytest.approx(value, rel=1e-9)


def dual(multipliers: Any, lower: Any, upper: Any) -> float:
    """The multipliers times the bounds that their signs belong to."""
    pairs = zip(multipliers.tolist(), lower, upper, strict=True)
    return sum(u * (low if u > 0 else high) for u, low, high in pairs if u)
