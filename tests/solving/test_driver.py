"""The loop: it trusts residuals, not methods; it stops at its limits; it says how it ended."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from lcpcli import Problem, Status, Trace, read
from lcpcli.errors import ProblemError
from lcpcli.files import contents
from lcpcli.methods import registry as methods
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.solving.trace import TraceRow
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion

from .liars import Liar

EXAMPLE = read(contents.shipped_path("paper-example-1.json"))
ANSWER = np.array([0.5, -0.5, 0.5, -0.5])
STEPPING = {"iterates": True, "uses_start": True}


class Clock:
    """A clock that a script sets forward."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def iterate(x: Vector | float, F: float | None = None) -> Iterate:
    return Iterate(np.broadcast_to(x, 4) * 1.0, None if F is None else np.full(4, F), "", 0)


def test_best_iterate_is_reported_not_the_last_and_a_solution_even_if_the_method_breaks_down(liar: Liar) -> None:
    steps = [iterate(1.0, F=10.0), iterate(2.0, F=1.0), iterate(3.0, F=5.0)]
    result = liar.run(EXAMPLE, steps, Stalled("for a test"), STEPPING)
    assert result.message == "stalled: for a test; the best iterate is reported, not the last"
    assert (result.z.tolist(), result.iterations) == ([4.0] * 4, 3)
    result = liar.run(EXAMPLE, [iterate(1.0), iterate(ANSWER, F=1.0)], Breakdown("something"), STEPPING)
    assert (result.status, result.residual) == (Status.SOLVED, 0.0)


def test_seconds_are_the_methods_own_and_set_up_is_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()

    def stage() -> Stage:
        for seconds in (1.0, 2.0, 4.0):
            clock.now += seconds
            yield iterate(1.0, F=10.0)
        return Finished()

    def method(problem: Problem, x0: Vector, **_: object) -> Stage:  # noqa: ARG001
        clock.now += 100.0
        return stage()

    monkeypatch.setattr(methods, "load", lambda name: method)  # noqa: ARG005
    trace = Trace()
    result = run(EXAMPLE, "newton", trace=trace, clock=clock)
    assert [row.seconds for row in trace.rows] == [0.0, 101.0, 103.0, 107.0]
    assert (result.setup_seconds, result.solve_seconds) == (100.0, 7.0)


@pytest.mark.parametrize(("own", "measuring", "expected"), [(1.0, 0.0, (5, 5.0)), (0.0, 1.0, (4, 0.0))])
def test_time_limit_counts_iterations_and_what_it_takes_to_measure_them(
    own: float, measuring: float, expected: tuple[int, float], liar: Liar
) -> None:
    clock = Clock()

    class Slow(Trace):
        def add(self, row: TraceRow, criterion: Criterion) -> None:
            clock.now += measuring
            super().add(row, criterion)

    def steps() -> Iterator[Iterate]:
        while True:
            clock.now += own
            yield iterate(1.0, F=10.0)

    liar.register(EXAMPLE, steps(), iterates=True)
    result = run(EXAMPLE, "liar", limits=Limits(time_limit=5.0), clock=clock, trace=Slow())
    assert result.status is Status.TIME_LIMIT
    assert (result.iterations, result.solve_seconds) == expected


def test_interrupted_run_reports_its_best_iterate_and_overflow_inside_a_method_is_a_breakdown(liar: Liar) -> None:
    def steps() -> Iterator[Iterate]:
        yield iterate(1.0, F=10.0)
        yield iterate(2.0, F=1.0)
        raise KeyboardInterrupt

    liar.register(EXAMPLE, steps(), iterates=True)
    result = run(EXAMPLE, "liar")
    assert (result.status, result.z.tolist()) == (Status.INTERRUPTED, [4.0] * 4)
    result = liar.run(EXAMPLE, (iterate(x * np.array([1e300]), F=1.0) for x in (1.0, np.array([1e300]))))
    assert result.status is Status.BREAKDOWN
    assert "overflow" in result.message


@pytest.mark.parametrize(("growth", "status"), [(0.5e100, Status.STALLED), (2e100, Status.DIVERGED)])
def test_residual_that_has_grown_by_100_decades_is_divergence_and_no_smaller_one(
    growth: float, status: Status, liar: Liar
) -> None:
    """For M = I, q = -1 and x < 0 it is F = 2x - 1."""
    steps = [iterate(x, F=2 * x - 1) for x in (-1.0, -1.5 * growth, -1.0)]
    result = liar.run(Problem(np.eye(4), -np.ones(4)), steps, None, STEPPING, x0=-np.ones(4))
    assert result.status is status


@pytest.mark.parametrize("final", [False, True])
def test_method_that_wants_to_correct_signs_at_a_solution_has_three_iterations_for_it(final: bool, liar: Liar) -> None:
    steps = [iterate(1.0), *9 * [iterate(ANSWER, F=0.0)._replace(signs_final=final)]]
    result = liar.run(EXAMPLE, steps, None, STEPPING)
    assert (result.solved, result.iterations) == (True, 2 if final else 2 + 3)


def test_exact_start_is_recognised_though_its_F_is_large() -> None:
    """z = 0 solves any problem with q >= 0, for every negative x that represents it."""
    result = run(Problem([[-5.0, 2.0], [-6.0, 1.0]], [1.0, 2.0]), "shi", [-3.0, -4.0])
    assert (result.solved, result.iterations) == (True, 0)


def test_residual_is_measured_now_and_then_where_its_bound_never_comes_down() -> None:
    """With M singular F stays large along the iteration although z has converged long before."""
    result = run(Problem(np.ones((3, 3)), [-1.0, -2.0, -3.0]), "fixed-point")
    assert result.solved
    assert result.iterations <= 256


def test_start_is_the_problems_own_unless_given_and_displaces_both_of_its_points() -> None:
    def rows(problem: Problem, *start: Vector) -> list[list[float]]:
        trace = Trace()
        run(problem, "shi", *start, trace=trace)
        return [row.z.tolist() for row in trace.rows]

    assert rows(EXAMPLE)[0] == [20.0] * 4
    assert rows(Problem(EXAMPLE.M, EXAMPLE.q))[0] == [0.0] * 4
    problem = Problem(EXAMPLE.M, EXAMPLE.q, x0=np.ones(4), x1=2 * np.ones(4))
    assert rows(problem)[1] == [4.0] * 4
    assert rows(problem, -np.ones(4))[1] != [4.0] * 4


@pytest.mark.parametrize("x1", [[1.0], [1.0, 2.0, 3.0, float("nan")], "x"])
def test_second_point_is_checked_like_the_first(x1: object) -> None:
    with pytest.raises(ProblemError, match="x1"):
        run(EXAMPLE, "shi", x1=x1)


def test_error_is_to_the_nearest_known_solution() -> None:
    problem = read(contents.shipped_path("bimatrix.json"))
    first, _, third = problem.solutions
    for solution in (first, third):
        result = run(problem, "shi", (solution - problem.w(solution)) / 2)
        assert (result.solved, result.iterations) == (True, 0)
        assert result.error <= 1e-15


@pytest.mark.parametrize("name", list(methods.METHODS))
def test_options_in_force_are_reported_defaults_too(name: str) -> None:
    options = run(EXAMPLE, name).options
    assert set(options) == set(methods.parameters_of(name))
    assert all(value is not None for key, value in options.items() if key != "x1")


def test_tolerance_is_what_the_relative_residual_comes_down_to_and_numpy_numbers_are_numbers() -> None:
    for tol in (1e-2, 1e-6, 1e-12):
        limits = Limits(tol=tol, max_iterations=np.int64(500))
        result = run(EXAMPLE, "fixed-point", omega=np.float32(2), limits=limits)
        assert result.solved
        assert tol / 100 < result.relative_residual <= tol
