"""How long solve_mcp makes other attempts."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli import solve_mcp
from lcpcli.methods import josephy_newton
from lcpcli.typing import Vector


def without_root(z: Vector) -> Vector:
    return 1 + z**2


def test_small_problem_is_given_up_by_counted_work_unless_attempts_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(josephy_newton, "MOST_LINEARIZATIONS", 10)
    monkeypatch.setattr(josephy_newton, "MOST_BRIEF", 3)
    small, again, larger = (solve_mcp(without_root, lower=None, x0=np.full(n, 0.5)) for n in (3, 3, 4))
    asked = solve_mcp(without_root, lower=None, x0=np.full(3, 0.5), restarts=3)
    assert small.iterations == again.iterations < asked.iterations < larger.iterations
    assert not small.solved
    assert not larger.solved
