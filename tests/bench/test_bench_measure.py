"""How long a measurement is repeated, by a clock that the test moves."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, cycle, repeat

import pytest

from lcpcli.bench.timing import CURVES, LEAST_REPEATS, MOST_REPEATS, SOLUTION, WARM_UP, TimedAnswer, is_stable, measure


class Machine:
    """A solver, a clock and a sleep on one time line; each run takes the next of the given seconds."""

    def __init__(self, seconds: Iterator[float], claim: str = SOLUTION, curve: bool = True) -> None:
        self.now, self.rested, self.curves = 0.0, 0.0, []
        self._seconds, self._claim, self._curve = seconds, claim, curve

    def solve(self, with_curve: bool) -> TimedAnswer:
        taken = next(self._seconds)
        self.now += taken
        self.curves.append(with_curve)
        curve = [(0, taken, 1.0)] if with_curve and self._curve else None
        return TimedAnswer(None, self._claim, "solved", "", taken, curve=curve)

    def sleep(self, seconds: float) -> None:
        self.now += seconds
        self.rested += seconds

    def measure(self, budget: float, rest: float = 0.0) -> tuple[TimedAnswer, list[float]]:
        return measure(self.solve, budget, rest, lambda: self.now, self.sleep)


def wild() -> Iterator[float]:
    return cycle((0.001, 0.003))


@pytest.mark.parametrize("warm_up", [0.9, 5.0])  # longer than the budget too
def test_steady_times_need_the_least_number_of_repeats_besides_warm_up_and_curve(warm_up: float) -> None:
    machine = Machine(chain([warm_up], repeat(0.01)))
    answer, times = machine.measure(budget=1.0)
    assert times == [0.01] * LEAST_REPEATS
    assert machine.curves == [True, *[False] * LEAST_REPEATS, *[True] * CURVES]
    assert answer.curve == [(0, 0.01, 1.0)]


def test_times_that_never_settle_end_at_the_most_repeats() -> None:
    machine = Machine(wild())
    assert len(machine.measure(budget=10.0)[1]) == MOST_REPEATS


def test_budget_ends_the_repeats() -> None:
    machine = Machine(wild())
    _, times = machine.measure(budget=0.0085)
    assert len(times) == 5  # 3 + 1 + 3 + 1 ms have passed before the fifth
    assert sum(times[:-1]) < 0.0085 <= sum(times)


def test_rests_count_towards_the_budget() -> None:
    machine = Machine(wild())
    _, times = machine.measure(budget=0.1, rest=0.06)
    assert len(times) == LEAST_REPEATS
    assert machine.rested == pytest.approx(0.06 * (1 + LEAST_REPEATS + CURVES))


def test_run_longer_than_the_budget_is_repeated_once() -> None:
    machine = Machine(repeat(2.0))
    answer, times = machine.measure(budget=1.0)
    assert times == [2.0]
    assert machine.curves == [True, False]
    assert answer.curve == [(0, 2.0, 1.0)]


def test_failure_is_made_once() -> None:
    machine = Machine(repeat(0.001), claim="")
    assert machine.measure(budget=1.0)[1] == [0.001]
    assert machine.curves == [True]


def test_solver_without_a_curve_is_not_run_for_one() -> None:
    machine = Machine(repeat(1.0), curve=False)
    machine.measure(budget=10.0)
    assert machine.curves == [True, *[False] * LEAST_REPEATS]


def test_brief_runs_are_warmed_up_before_they_count() -> None:
    machine = Machine(repeat(0.0005), curve=False)
    _, times = machine.measure(budget=1.0)
    assert len(machine.curves) == 1 + round(WARM_UP / 0.0005) + len(times)


@pytest.mark.parametrize(
    ("times", "stable"),
    [
        ([1.0, 2.0], False),
        ([1.0, 1.0, 1.0], True),
        ([0.96, 1.0, 1.04], True),
        ([0.94, 1.0, 1.06], False),
        ([0.1, *[1.0] * 9, 9.0], True),  # outliers do not matter to the median of enough repeats
        ([0.1, 0.1, 1.0, 9.0, 9.0], False),
    ],
)
def test_median_is_stable_where_its_interval_is_narrow(times: list[float], stable: bool) -> None:
    assert is_stable(times) is stable
