"""Linear programs by HiGHS in its own package and in scipy: the same minimum, multipliers and refusals by both."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from lcpcli.linalg import linear_program
from lcpcli.linalg.linear_program import Optimum, minimized


def by_both(monkeypatch: pytest.MonkeyPatch, *program: object) -> tuple[Optimum | None, Optimum | None]:
    pytest.importorskip("highspy")
    own = minimized(*program)  # type: ignore[arg-type]
    monkeypatch.setattr(linear_program, "find_spec", lambda _: None)
    return own, minimized(*program)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("sparse", [False, True])
def test_both_find_the_same_minimum_and_multipliers(seed: int, sparse: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(seed)
    A, x = random.integers(-3, 4, (7, 12)).astype(float), random.random(12)
    low, high = A @ x - np.array([0, 0, 1, 1, 1, 2, 3]), A @ x + np.array([0, 0, np.inf, np.inf, 1, 2, 3])
    low[4] = -np.inf
    bounds = np.where(random.random(12) < 0.2, -np.inf, 0.0), np.full(12, 5.0)
    bounds[0][bounds[0] == -np.inf] = -5.0
    objective = random.standard_normal(12)
    for found in by_both(monkeypatch, objective, csr_array(A) if sparse else A, (low, high), bounds):
        assert found is not None
        assert found.value == pytest.approx(objective @ found.x)
        ends = np.where(found.y > 0, low, high)[np.abs(found.y) > 1e-9]
        assert A[np.abs(found.y) > 1e-9] @ found.x == pytest.approx(ends)
        reduced = objective - A.T @ found.y
        at = np.where(reduced > 0, bounds[0], bounds[1])[np.abs(reduced) > 1e-9]
        assert found.x[np.abs(reduced) > 1e-9] == pytest.approx(at)


@pytest.mark.parametrize(("c", "high"), [(-1.0, np.inf), (1.0, -1.0)], ids=["unbounded", "infeasible"])
def test_neither_finds_a_minimum_where_there_is_none(c: float, high: float, monkeypatch: pytest.MonkeyPatch) -> None:
    ends, bounds = (np.array([-np.inf]), np.array([high])), (np.zeros(1), np.full(1, np.inf))
    assert by_both(monkeypatch, np.full(1, c), np.eye(1), ends, bounds) == (None, None)
