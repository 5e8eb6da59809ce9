"""Derivatives where the solutions differ in more than one direction."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli
from lcpcli.errors import DerivativeError

PAIRS = np.kron(np.diag([1.0, 2.0]), np.ones((2, 2)))  # z1 + z2 and z3 + z4 are determined, and no more


@pytest.mark.parametrize("J", [[1, 0, 0, 0], [0, 0, 0, 1], [1, 1, 1, 0]])
def test_J_z_has_a_derivative_only_if_no_direction_changes_it(J: list[float]) -> None:
    result = lcpcli.solve(PAIRS, [-1, -1, -4, -4], "interior")
    assert (result.z > 0.1).all()
    assert result.derivative(dq=[1, 1, 0, 0], J=[[1, 1, 0, 0], [0, 0, 1, 1]]).z == pytest.approx([-1, 0])
    with pytest.raises(DerivativeError, match="several solutions, which differ in J z"):
        result.derivative(dq=[1, 1, 0, 0], J=[J])
