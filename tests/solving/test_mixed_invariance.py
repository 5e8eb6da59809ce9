"""The answer to a mixed problem depends neither on units, nor on order, signs, or where the bounds lie."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem
from lcpcli.typing import Vector

from ..mixed_problems import definite, monotone, with_all_bounds


def near(z: Vector, reference: Vector, size: float = 1.0) -> bool:
    return bool(np.abs(z - reference).max() <= 1e-6 * max(size * 1e-6, 1.0) * (1 + np.abs(reference).max()))


@pytest.mark.parametrize("seed", range(12))
def test_units_order_signs_and_shifts_do_not_matter(seed: int) -> None:
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 30))
    (M, q), (lower, upper) = monotone(n, generator), with_all_bounds(n, generator)
    own = lcpcli.solve(M, q, lower=lower, upper=upper)
    z = own.z
    R, C = 10.0 ** generator.uniform(-8, 8, (2, n))
    result = lcpcli.solve(R[:, np.newaxis] * M * C, R * q, lower=lower / C, upper=upper / C)
    assert own.solved
    assert result.solved
    assert near(C * result.z, z)
    t = 10.0 ** generator.uniform(-100, 100)
    for low, high, expected in ((lower, upper, z), (np.zeros(n), np.full(n, np.inf), lcpcli.solve(M, q).z)):
        scaled = lcpcli.solve(M, t * q, lower=t * low, upper=t * high).z / t
        assert np.allclose(scaled, expected, rtol=1e-12, atol=1e-13)
    P = generator.permutation(n)
    result = lcpcli.solve(M[np.ix_(P, P)], q[P], lower=lower[P], upper=upper[P])
    assert result.solved
    assert near(result.z, z[P])
    mirrored = lcpcli.solve(M, -q, lower=-upper, upper=-lower)
    assert mirrored.solved
    assert near(-mirrored.z, z)
    exchanged = {"lower": "upper", "upper": "lower", "basic": "basic"}
    states = zip(own.basis, mirrored.basis, lower < upper, strict=True)
    assert all(one == exchanged[other] for one, other, is_free in states if is_free)
    for size in (1e2, 1e4, 1e6):
        shift = size * generator.standard_normal(n)
        result = lcpcli.solve(M, q - M @ shift, lower=lower + shift, upper=upper + shift)
        assert result.solved
        assert near(result.z - shift, z, size)
    plain, spelt = lcpcli.solve(M, q), lcpcli.solve(M, q, lower=np.zeros(n), upper=[np.inf] * n)
    assert (plain.z.tobytes(), plain.w.tobytes()) == (spelt.z.tobytes(), spelt.w.tobytes())
    assert plain.relative_residual == spelt.relative_residual


@pytest.mark.parametrize("size", [-1e6, -1e3, 1e3, 1e6, 1e8])
def test_no_shift_makes_a_wrong_answer_right(size: float) -> None:
    """No variable is free: to shift one is to change q as for any linear system, and with it the scale of its row."""
    for seed in range(8):
        generator = np.random.default_rng(seed)
        M, q = definite(8, generator)
        kind = seed % 4
        lower = None if kind == 1 else generator.uniform(-1, 0, 8)
        upper = None if kind == 0 else generator.uniform(0, 1, 8)
        if kind == 3:
            lower, upper = np.where(np.arange(8) % 2, lower, -np.inf), np.where(np.arange(8) % 4 == 1, np.inf, upper)
        z = lcpcli.solve(M, q, lower=lower, upper=upper).z
        wrong = Problem(M, q, lower=lower, upper=upper).box.project(z + 1e-4 * generator.standard_normal(8))
        assert not lcpcli.check(Problem(M, q, lower=lower, upper=upper), wrong).accepted
        shifted = Problem(
            M,
            q - M @ np.full(8, size),
            lower=None if lower is None else lower + size,
            upper=None if upper is None else upper + size,
        )
        assert not lcpcli.check(shifted, wrong + size).accepted
