"""How long a bench repeats a measurement, by a clock that the test moves, and the statistics of the times, against
numbers worked out by hand and by their properties."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import chain, cycle, repeat

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli.bench.statistics import growth, median_interval, performance_ratios, shifted_geometric_mean, summary
from lcpcli.bench.timing import CURVES, LEAST_REPEATS, MOST_REPEATS, SOLUTION, WARM_UP, TimedAnswer, is_stable, measure

TIMES = st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=40)


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


def test_median_and_quartiles_by_hand() -> None:
    found = summary([5.0, 1.0, 2.0, 4.0, 3.0])
    assert (found.lower, found.median, found.upper, found.repeats) == (2.0, 3.0, 4.0, 5)
    assert found.spread == pytest.approx(1 / 3)
    found = summary([1.0, 2.0, 3.0, 4.0])
    assert (found.lower, found.median, found.upper) == (1.75, 2.5, 3.25)
    assert summary([2.5]).spread is None


@pytest.mark.parametrize(
    ("n", "ranks"),
    # The largest rank with P(Bin(n, 1/2) < rank) <= 0.025, as tables of the sign test have it.
    [(1, (1, 1)), (3, (1, 3)), (5, (1, 5)), (6, (1, 6)), (8, (1, 8)), (9, (2, 8)), (12, (3, 10)), (25, (8, 18))],
)
def test_interval_of_the_median_has_the_ranks_of_the_sign_test(n: int, ranks: tuple[int, int]) -> None:
    assert median_interval([float(i) for i in range(n, 0, -1)]) == ranks


@given(TIMES)
def test_interval_holds_the_median(times: list[float]) -> None:
    low, high = median_interval(times)
    assert low <= summary(times).median <= high


def test_shifted_geometric_mean_by_hand() -> None:
    assert shifted_geometric_mean([0.001, 0.007], shift=0.001) == pytest.approx(0.003)  # sqrt(2 * 8) = 4, less 1
    assert shifted_geometric_mean([0.0, 0.099], shift=0.001) == pytest.approx(0.009)


@given(TIMES)
def test_shifted_geometric_mean_lies_between_the_times_and_below_their_mean(times: list[float]) -> None:
    mean = shifted_geometric_mean(times)
    slack = 1e-9 * max(times) + 1e-12
    assert min(times) - slack <= mean <= sum(times) / len(times) + slack


def test_performance_ratios_by_hand() -> None:
    times = {
        "a": {"one": 1.0, "two": 4.0, "three": math.inf},
        "b": {"one": 2.0, "two": 2.0, "three": math.inf},
        "c": {"two": 3.0},
    }
    assert performance_ratios(times) == {"a": [1.0, 2.0, math.inf], "b": [1.0, 2.0, math.inf], "c": [1.5]}


@given(
    st.dictionaries(st.sampled_from("abc"), st.dictionaries(st.sampled_from("xyz"), st.floats(1e-6, 1e3)), min_size=1)
)
def test_every_problem_that_is_solved_has_a_fastest_solver(times: dict[str, dict[str, float]]) -> None:
    ratios = performance_ratios(times)
    problems = {problem for own in times.values() for problem in own}
    assert all(ratio >= 1 for own in ratios.values() for ratio in own)
    assert sum(own.count(1.0) for own in ratios.values()) >= len(problems)
    assert {solver: len(own) for solver, own in ratios.items()} == {solver: len(own) for solver, own in times.items()}


@given(st.floats(0.1, 4), st.floats(1e-9, 1e-3))
def test_exact_power_is_found_exactly(exponent: float, coefficient: float) -> None:
    fit = growth([(n, coefficient * n**exponent) for n in (1000, 2000, 4000, 8000)])
    assert fit is not None
    assert fit.exponent == pytest.approx(exponent)
    assert fit.coefficient == pytest.approx(coefficient)
    assert fit.margin == pytest.approx(0, abs=1e-5)
    assert fit.r_squared == pytest.approx(1)


def test_growth_by_hand() -> None:
    # x = 0, 1, 2, 3 and y = 0, 3, 3, 6 in units of ln 2: slope 1.8, residuals -0.3, 0.9, -0.9, 0.3, total 18.
    fit = growth([(1, 1.0), (2, 8.0), (4, 8.0), (8, 64.0)])
    assert fit is not None
    assert fit.exponent == pytest.approx(1.8)
    assert fit.coefficient == pytest.approx(2**0.3)
    assert fit.margin == pytest.approx(4.302653 * math.sqrt(1.8 / 2 / 5))  # Student's t, two degrees of freedom
    assert fit.r_squared == pytest.approx(1 - 1.8 / 18)


def test_three_sizes_give_no_growth() -> None:
    assert growth([(10, 1.0), (20, 2.0), (20, 2.1), (10, 1.1), (40, 4.0)]) is None
    assert growth([]) is None
