"""The statistics of a bench: against numbers worked out by hand, and by their properties."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lcpcli.bench.statistics import growth, median_interval, performance_ratios, shifted_geometric_mean, summary

TIMES = st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=40)


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
