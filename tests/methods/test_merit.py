"""The merit function of Fischer and Burmeister, and its smoothed form."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli.methods.smoothing import phi, slopes
from lcpcli.model.box import Box

BOX = Box(np.array([0.0, -np.inf, 1.0, -np.inf, 2.0]), np.array([np.inf, 3.0, 4.0, np.inf, 2.0]))


@pytest.mark.parametrize("mu", [0.0, 1e-3, 1.0])
def test_slopes_are_the_derivatives(mu: float) -> None:
    random = np.random.default_rng(0)
    J, z, F, step = random.normal(size=(5, 5)), np.array([0.3, 2.5, 1.7, -1.0, 2.0]), random.normal(size=5), 1e-6
    G = slopes(BOX, z, F, J, mu)
    for j in range(4):  # the last variable is fixed
        ends = [phi(BOX, z + t * np.eye(5)[j], F + t * J[:, j], mu) for t in (step, -step)]
        assert np.abs((ends[0] - ends[1]) / (2 * step) - G[:, j]).max() <= 1e-6


def test_zeros_are_the_solutions_and_smoothed_ones_tend_to_them() -> None:
    z, F = np.array([0.0, 3.0, 1.5, -7.0, 2.0]), np.array([2.0, -1.0, 0.0, 0.0, 5.0])
    assert not phi(BOX, z, F).any()
    sizes = [np.abs(phi(BOX, z, F, mu)).max() for mu in (1e-2, 1e-4, 1e-6)]
    assert sizes[0] > sizes[1] > sizes[2] > 0
    assert sizes[2] <= 1e-5


def test_smoothed_zeros_lie_inside_the_bounds() -> None:
    orthant = Box(np.zeros(1), np.full(1, np.inf))
    assert phi(orthant, np.array([1e-3]), np.array([2.0]), 2e-3)[0] == pytest.approx(0.0, abs=1e-15)  # z F = mu
