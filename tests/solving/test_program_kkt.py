"""Minimizers of programs satisfy the conditions of Karush, Kuhn and Tucker, computed from the program alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import read, run
from lcpcli.files import contents
from lcpcli.gallery import families as gallery
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.model.program import Program
from lcpcli.solving.answer import Minimum

FOLDER = Path(contents.shipped_path("programs"))
SHIPPED = sorted(path.name for path in FOLDER.glob("*.json"))
MADE = [(name, n, seed) for name in ("portfolio", "control", "transport") for n in (20, 80, 200) for seed in (0, 1)]


def outside(values: Any, lower: Any, upper: Any) -> Any:
    """How far each value is outside its bounds."""
    return np.maximum(np.maximum(lower - values, values - upper), 0.0)


def largest_violation(problem: Problem) -> float:
    """Of the conditions for min x'Qx / 2 + c'x, each relative to its own terms, and the gap relative to its own."""
    origin = problem.origin
    assert isinstance(origin, Program)
    p = origin.program(conditions_of(problem))
    answer = run(problem).answer
    assert p is not None
    assert isinstance(answer, Minimum)
    assert answer.x is not None
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


@pytest.mark.parametrize(("family", "n", "seed"), MADE)
def test_of_the_families(family: str, n: int, seed: int) -> None:
    assert largest_violation(gallery.make(family, n, seed)) < 1e-11
