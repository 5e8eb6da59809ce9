"""How long solve_mcp makes other attempts."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli import solve_mcp
from lcpcli.methods import josephy_newton
from lcpcli.typing import Vector


def without_root(z: Vector) -> Vector:
    return 1 + z**2


@pytest.mark.parametrize(("n", "gives_up"), [(3, True), (4, False)])
def test_small_problem_is_given_up_by_counted_work_unless_attempts_are_asked_for(
    n: int, gives_up: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(josephy_newton, "MOST_LINEARIZATIONS", 10)
    monkeypatch.setattr(josephy_newton, "MOST_BRIEF", 3)
    start = np.full(n, 0.5)
    asked = solve_mcp(without_root, lower=None, x0=start, restarts=12)
    by_default, again = (solve_mcp(without_root, lower=None, x0=start) for _ in range(2))
    assert (by_default.iterations < asked.iterations) == gives_up
    assert by_default.iterations == again.iterations
    assert not by_default.solved
