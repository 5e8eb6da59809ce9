"""Minimizers of programs satisfy the conditions of Karush, Kuhn and Tucker, computed from the program alone; programs
of the literature have the optimal values that it gives."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import from_qp, read, run
from lcpcli.files import contents
from lcpcli.gallery import families as gallery
from lcpcli.model.problem import Problem, conditions_of

FOLDER = Path(contents.shipped_path("programs"))
SHIPPED = sorted(path.name for path in FOLDER.glob("*.json"))

# W. Hock, K. Schittkowski, Test Examples for Nonlinear Programming Codes (1981); E. M. L. Beale, Cycling in the dual
# simplex algorithm (1955); V. Klee, G. J. Minty, How good is the simplex algorithm? (1972), in V. Chvatal's form,
# Linear Programming (1983), chapter 4.
HS_21: dict[str, Any] = {"Q": [[0.02, 0], [0, 2]], "c": [0, 0], "A": [[10, -1]], "b": [10], "constant": -100}
HS_35: dict[str, Any] = {"Q": [[4, 2, 2], [2, 4, 0], [2, 0, 2]], "c": [-8, -6, -4], "A": [[1, 1, 2]], "constant": 9}
HS_76: dict[str, Any] = {
    "Q": [[2, 0, -1, 0], [0, 1, 0, 0], [-1, 0, 2, 1], [0, 0, 1, 1]],
    "c": [-1, -3, 1, -1],
    "A": [[1, 2, 1, 1], [3, 1, 2, -1], [0, 1, 4, 0]],
}
BEALE = None, [-0.75, 150, -0.02, 6], [[0.25, -60, -0.04, 9], [0.5, -90, -0.02, 3], [0, 0, 1, 0]]
KLEE_MINTY = None, [100, 10, 1], [[1, 0, 0], [20, 1, 0], [200, 20, 1]]
LITERATURE = {
    "Hock-Schittkowski 21": (from_qp(**HS_21, lower=[2, -50], upper=[50, 50]), -99.96),
    "Hock-Schittkowski 35": (from_qp(**HS_35, row_upper=[3]), 1 / 9),
    "Hock-Schittkowski 76": (from_qp(**HS_76, row_lower=[None, None, 1.5], row_upper=[5, 4, None]), -4.681818181818182),
    "Beale's cycling example": (from_qp(*BEALE, row_upper=[0, 0, 1]), -0.05),
    "Klee-Minty": (from_qp(*KLEE_MINTY, row_upper=[1, 100, 10000], sense="max"), 10000),
}


def outside(values: Any, lower: Any, upper: Any) -> Any:
    """How far each value is outside its bounds."""
    return np.maximum(np.maximum(lower - values, values - upper), 0.0)


def largest_violation(problem: Problem) -> float:
    """Of the conditions for min x'Qx / 2 + c'x, each relative to its own terms, and the gap relative to its own."""
    origin = problem.origin
    p = origin.program(conditions_of(problem))
    answer = run(problem).answer
    sign = -1.0 if origin.sense == "max" else 1.0
    x, y, own = answer.x, sign * answer.y, sign * answer.bound_multipliers
    Q, A = (np.asarray(M.toarray() if hasattr(M, "toarray") else M) for M in (p.Q, p.A))
    terms = 1.0 + np.abs(Q) @ np.abs(x) + np.abs(p.c) + np.abs(A.T) @ np.abs(y) + np.abs(own)
    stationarity = np.abs(Q @ x + p.c - A.T @ y - own) / terms
    rows = outside(A @ x, p.row_lower, p.row_upper) / (1.0 + np.abs(A) @ np.abs(x))
    bounds = outside(x, p.lower, p.upper)
    gaps = []
    for values, multipliers, low, high in ((A @ x, y, p.row_lower, p.row_upper), (x, own, p.lower, p.upper)):
        bound = np.where(multipliers > 0, low, np.where(multipliers < 0, high, 0.0))
        assert np.isfinite(bound).all()  # no multiplier without a bound
        gaps.append(multipliers * np.where(multipliers == 0, 0.0, values - bound))
    gap = abs(sum(part.sum() for part in gaps)) / (1.0 + abs(answer.objective - origin.constant))
    return float(max(stationarity.max(), rows.max(initial=0.0), bounds.max(), gap))


@pytest.mark.parametrize("name", SHIPPED)
def test_of_the_programs_that_ship(name: str) -> None:
    assert largest_violation(read(FOLDER / name)) < 1e-12


@pytest.mark.parametrize("family", ["portfolio", "control", "transport"])
def test_of_the_families(family: str) -> None:
    for n, seed in (20, 0), (80, 1), (200, 0):
        assert largest_violation(gallery.make(family, n, seed)) < 1e-11


@pytest.mark.parametrize("name", LITERATURE)
def test_optimal_values_are_those_of_the_literature(name: str) -> None:
    problem, value = LITERATURE[name]
    assert run(problem).answer.objective == pytest.approx(value, rel=1e-9)
    assert largest_violation(problem) < 1e-12
