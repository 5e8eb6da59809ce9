"""What presolve leaves gets half of the time for milp, and the problem as it is the rest."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lcpcli import clock
from lcpcli.interrupts import TimeIsUp, check, remaining, within
from lcpcli.methods.presolved_stages import _for_half_of_the_time
from lcpcli.methods.stages import Finished, Iterate, OutOfTime, Stage, advance

POINT = Iterate(np.zeros(1), None, "", 0)


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return a list with the time of the clock."""
    time = [0.0]
    monkeypatch.setattr(clock, "seconds", lambda: time[0])
    return time


def looking(seen: list[float]) -> Stage:
    """Note the time that is left, twice, then ask whether there is any."""
    for _ in range(2):
        seen.append(remaining())
        yield POINT
    check()
    return Finished()


def test_the_second_half_is_left_and_no_context_is_open_in_between(now: list[float]) -> None:
    seen: list[float] = []
    with within(100.0):
        stage = _for_half_of_the_time(looking(seen))
        for time, left in ((10.0, 90.0), (50.0, 50.0)):
            assert advance(stage) is POINT
            now[0] = time
            assert remaining() == left
        assert seen == [50.0, 40.0]
        now[0] = 51.0
        assert isinstance(advance(stage), OutOfTime)


@pytest.mark.parametrize(("limit", "time", "half"), [(math.inf, 1e9, math.inf), (100.0, 101.0, 50.0)])
def test_the_end_of_the_whole_time_is_that_of_the_run_and_half_of_no_limit_is_none(
    limit: float, time: float, half: float, now: list[float]
) -> None:
    seen: list[float] = []
    with within(limit):
        stage = _for_half_of_the_time(looking(seen))
        assert [advance(stage), advance(stage)] == [POINT, POINT]
        now[0] = time
        if time < limit:
            assert isinstance(advance(stage), Finished)
        else:
            with pytest.raises(TimeIsUp):
                advance(stage)
    assert seen == [half, half]
