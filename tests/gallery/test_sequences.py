"""Sequences of the gallery: what each step depends on, and what the last one is known to be."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from lcpcli import run
from lcpcli.gallery import sequences
from lcpcli.gallery.sequences import SequenceStep
from lcpcli.model.problem import Problem


def z_of(step: SequenceStep) -> np.ndarray:
    result = run(Problem(step.M, step.q, **step.bounds))
    assert result.solved
    return result.z


def test_a_put_is_worth_what_binomial_trees_say() -> None:
    """6.090 for the price and the strike 100, one year, the rate 0.05 and the volatility 0.2."""
    values: list[np.ndarray] = []
    sequences.put(199, 50, lambda step: values.append(z_of(step)) or values[-1])
    assert values[-1][99] == pytest.approx(6.090, abs=0.05)


def test_the_market_meets_demand_and_electricity_is_dearer_by_day_where_lines_are_full() -> None:
    highest = []

    def solve(step: SequenceStep) -> np.ndarray:
        z = z_of(step)
        outputs, flows, prices = np.split(z, [24, 36])
        assert step.M.shape == (44, 44)
        assert outputs.sum() == pytest.approx(-step.q[36:].sum())
        highest.append((prices.max(), np.count_nonzero(abs(flows) == 30)))
        return z

    sequences.market(24, solve)
    (night, full_by_night), (day, full_by_day) = highest[3], highest[15]
    assert 0 < night < day
    assert full_by_night < full_by_day


@pytest.mark.parametrize(
    "follow",
    [partial(sequences.put, 10, 3), partial(sequences.market, 3), partial(sequences.moving_load, 4, 3)],
    ids=["put", "market", "load"],
)
def test_m_is_the_same_object_where_it_does_not_change(follow: Any) -> None:
    steps: list[SequenceStep] = []
    follow(lambda step: steps.append(step) or z_of(step))
    assert len({id(step.M) for step in steps}) == 1
    assert len({step.q.tobytes() for step in steps}) == 3


def test_a_step_without_a_solution_leaves_the_price_of_the_put_as_it_was() -> None:
    steps: list[SequenceStep] = []
    sequences.put(10, 3, lambda step: steps.append(step) or (z_of(step) if len(steps) == 1 else None))
    assert not np.array_equal(steps[0].q, steps[1].q)
    assert np.array_equal(steps[1].q, steps[2].q)
