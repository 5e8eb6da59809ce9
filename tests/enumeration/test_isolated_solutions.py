"""Only a piece of one point is an isolated solution."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli


@pytest.mark.parametrize(
    ("M", "q", "lower", "is_point"),
    [
        ([[2]], [-1], 0, True),
        ([[0]], [0], 0, False),
        ([[0]], [0], -np.inf, False),
        ([[1, 1], [1, 1]], [-1, -1], 0, False),
    ],
    ids=["a point", "a ray", "a line", "a segment"],
)
def test_rays_lines_and_segments_are_not_isolated(
    M: list[list[float]], q: list[float], lower: float, is_point: bool
) -> None:
    assert [piece.is_point for piece in lcpcli.solutions(lcpcli.Problem(M, q, lower=lower))] == [is_point]
