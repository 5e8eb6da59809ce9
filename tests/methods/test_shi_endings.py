"""How `shi` ends: at the solution, at rounding, where it cannot go on, or before it begins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from lcpcli import Problem, Status, read
from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.methods.shi import shi
from lcpcli.methods.smoothing import Smoothed, SmoothedPoint
from lcpcli.methods.stages import Breakdown
from lcpcli.options import Limits
from lcpcli.solving.driver import run

from .stages import through

Vector = NDArray[np.float64]
EXAMPLE_1 = read(contents.shipped_path("paper-example-1.json"))


def test_small_p_ends_at_the_smoothing_error_and_says_so() -> None:
    result = run(EXAMPLE_1, "shi", p=3.0, limits=Limits(max_iterations=2000))
    assert result.status is Status.STALLED
    bound = math.log(3) / 3 * np.abs(EXAMPLE_1.M - np.eye(4)).sum(axis=1).max()
    assert 1e-3 < result.residual <= bound
    told = f"smoothing error, in F at most (ln 3 / p) |M - I| = {bound:.2g} for p = 3 "
    assert f"what is left is the {told}" in result.message


def test_direction_that_cannot_descend_gives_way_to_steepest_descent() -> None:
    """A positive definite problem on which the plane of F~ and the last step becomes orthogonal to d."""
    generator = np.random.default_rng([12, 3])
    factor = generator.standard_normal((12, 12))
    problem = Problem(factor @ factor.T + 12 * np.eye(12), generator.standard_normal(12))
    for k_star in (5, 10, 100, 1000):
        result = run(problem, "shi", k_star=k_star, limits=Limits(max_iterations=5000))
        assert result.status in (Status.SOLVED, Status.ITERATION_LIMIT)


def test_most_positive_definite_problems_are_solved_from_the_origin() -> None:
    """Random ones, symmetric and not, with unit diagonal, as the method wants them; n = 2, 4 and 8."""
    solved = 0
    for seed in range(60):
        generator = np.random.default_rng(seed)
        n = (2, 4, 8)[seed % 3]
        factor, skew = generator.standard_normal((2, n, n))
        M = factor @ factor.T + 0.5 * np.eye(n) + seed % 2 * (skew - skew.T)
        scale = 1 / np.sqrt(np.diag(M))
        problem = Problem(scale[:, None] * M * scale, generator.standard_normal(n))
        solved += run(problem, "shi", limits=Limits(max_iterations=3000)).solved
    assert solved >= 54


def test_positive_definite_problem_on_which_descent_stalls_at_a_kink_is_solved_with_another_k_star() -> None:
    problem = Problem([[1.0, -3.0], [4.0, 2.0]], [-1.0, 1.0])
    assert run(problem, "shi", k_star=10).solved


def test_evaluations_of_a_search_in_vain_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    done = 0
    real = Smoothed.at

    def counting(self: Smoothed, x: Vector) -> SmoothedPoint:
        nonlocal done
        done += 1
        return real(self, x)

    monkeypatch.setattr(Smoothed, "at", counting)
    result = run(Problem([[2.0, -5.0], [5.0, 2.0]], [-1.0, 1.0]), "shi", limits=Limits(max_iterations=200))
    assert result.evaluations == done


def test_underflow_is_a_breakdown_that_says_so() -> None:
    result = run(Problem([[2.0]], [-1e-200]), "shi")
    assert result.status is Status.BREAKDOWN
    assert "underflows" in result.message


def test_default_p_solves_a_degenerate_problem() -> None:
    """z* = w* = 0 in the second component, where the smoothing error is ln 3 / p itself."""
    result = run(Problem([[2.0, 1.0], [1.0, 2.0]], [-2.0, -1.0], solutions=[[1.0, 0.0]]), "shi")
    assert result.solved
    assert result.error is not None
    assert result.error <= 1e-9


def test_start_at_the_solution_stops_at_once() -> None:
    result = run(EXAMPLE_1, "shi", np.array([0.5, -0.5, 0.5, -0.5]))
    assert result.solved
    assert result.iterations == 0
    assert result.evaluations == 0


def test_stationary_point_that_is_no_zero_is_a_breakdown() -> None:
    """M = -1, q = -1 has no solution; f is stationary at x = 0 where phi' = 0 makes J = M + 1 = 0."""
    iterates, ending = through(shi(Problem([[-1.0]], [-1.0]), np.zeros(1)))
    assert iterates == []
    assert isinstance(ending, Breakdown)
    assert "stationary" in ending.reason


def test_overflow_is_a_breakdown_not_a_warning() -> None:
    result = run(Problem(EXAMPLE_1.M, EXAMPLE_1.q * 1e200), "shi", np.zeros(4))
    assert result.status is Status.BREAKDOWN
    assert "overflow" in result.message


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("p", 0.0),
        ("p", math.inf),
        ("p", math.nan),
        ("k_star", 0),
        ("rho", 0.5),
        ("rho", 0.0),
        ("sigma", 1.0),
        ("sigma", 1e-4),
    ],
)
def test_options_out_of_range_are_refused_before_any_work(option: str, value: float) -> None:
    with pytest.raises(OptionError, match=option):
        run(EXAMPLE_1, "shi", **{option: value})  # type: ignore[arg-type]
