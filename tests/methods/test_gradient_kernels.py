"""The compiled steps of projected gradients, beside those of numpy."""

from __future__ import annotations

import numpy as np
import pytest

from lcpcli import Problem, run
from lcpcli.gallery import families
from lcpcli.methods.projected_gradient import projected_gradient, single_steps
from lcpcli.methods.stages import Finished, Iterate, advance

from .. import kernels_together  # noqa: F401

compiled = pytest.importorskip("lcpcli.kernels.compiled")


def problem_of(seed: int) -> Problem:
    given = families.make("harker-pang", 120, seed, symmetric=bool(seed % 2))
    z = run(given).z
    if seed < 2:
        return given
    lower, upper = np.where(np.arange(120) % 3, 0.0, -np.inf), np.where(np.arange(120) % 4, np.inf, z.max() / 2)
    return Problem(given.M, given.q, lower=lower, upper=upper)


@pytest.mark.parametrize("seed", range(4))
def test_compiled_steps_are_those_of_numpy_up_to_rounding(seed: int) -> None:
    problem = problem_of(seed)
    units = 1 / np.sqrt(problem.M.diagonal())
    box = problem.box.in_units(units).in_single_precision()
    M, scale, q = (given.astype(np.float32) for given in (problem.M, units, units * problem.q))
    start = box.project(np.zeros(120, dtype=np.float32))
    w = scale * (M @ (scale * start)) + q
    ways = (steps(box, M, scale, q, start.copy(), w.copy()) for steps in (single_steps, compiled.gradient_steps))
    for _, one, other in zip(range(3), *ways, strict=False):
        assert np.allclose(one.z, other.z, rtol=1e-3, atol=1e-4 * np.abs(one.z).max())
        assert np.allclose(one.w, other.w, rtol=1e-3, atol=1e-3 * np.abs(q).max())
        assert abs(one.changes - other.changes) <= 1
        assert one.bounded
        assert other.bounded


def test_they_settle_at_the_states_of_the_solution() -> None:
    problem = problem_of(1)
    stage = projected_gradient(problem, np.zeros(120), compiled.gradient_steps)
    found = advance(stage)
    assert isinstance(found, Iterate)
    assert isinstance(advance(stage), Finished)
    wrong = np.count_nonzero(problem.box.basis_of(found.x) != problem.box.basis_at(run(problem).z))
    assert wrong <= 4
