"""The loop: it trusts residuals, not methods; it stops at its limits; it says how it ended."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from lcpcli import Problem, Status, Trace, read
from lcpcli.errors import OptionError, ProblemError
from lcpcli.files import contents
from lcpcli.methods import registry as methods
from lcpcli.methods.stages import Breakdown, Ending, Finished, Iterate, Stage, Stalled
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.solving.trace import TraceRow
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion

EXAMPLE = read(contents.shipped_path("paper-example-1.json"))
ANSWER = np.array([0.5, -0.5, 0.5, -0.5])

Script = Callable[[], Iterator[Iterate]]  # the iterates after the start; it may return how the method ends


@pytest.fixture
def scripted(monkeypatch: pytest.MonkeyPatch) -> Callable[[Script], None]:
    """Let the method `shi` do what a script says."""

    def use(script: Script) -> None:
        def method(problem: Problem, x0: Vector) -> Stage:  # noqa: ARG001
            return ending_well(script())

        monkeypatch.setattr(methods, "load", lambda name: method)  # noqa: ARG005
        monkeypatch.setattr(methods, "options_in_force", lambda *given: {})  # noqa: ARG005

    return use


def ending_well(iterates: Iterator[Iterate]) -> Stage:
    ending: Ending | None = yield from iterates
    return ending or Finished()


class Clock:
    """A clock that a script sets forward."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def iterate(x: Vector | float, F: float | None = None) -> Iterate:
    return Iterate(np.broadcast_to(x, 4) * 1.0, None if F is None else np.full(4, F), "", 0)


def test_solved_is_not_said_because_a_method_claims_a_zero_F(scripted: Callable[[Script], None]) -> None:
    scripted(lambda: iter([iterate(3.0, F=0.0)] * 4))
    result = run(EXAMPLE, "shi")
    assert result.status is Status.STALLED
    assert result.residual == 6.0


def test_solved_is_said_from_the_residual_even_if_the_method_breaks_down(scripted: Callable[[Script], None]) -> None:
    def script() -> Iterator[Iterate]:
        yield iterate(1.0)
        yield iterate(ANSWER, F=1.0)
        return Breakdown("something")

    scripted(script)
    result = run(EXAMPLE, "shi")
    assert result.status is Status.SOLVED
    assert result.residual == 0.0


def test_best_iterate_is_reported_not_the_last(scripted: Callable[[Script], None]) -> None:
    def script() -> Iterator[Iterate]:
        yield iterate(1.0, F=10.0)
        yield iterate(2.0, F=1.0)
        yield iterate(3.0, F=5.0)
        return Stalled("for a test")

    scripted(script)
    result = run(EXAMPLE, "shi")
    assert result.status is Status.STALLED
    assert result.message == "stalled: for a test; the best iterate is reported, not the last"
    assert np.array_equal(result.z, np.full(4, 4.0))
    assert result.iterations == 3


def test_seconds_are_the_methods_own_and_set_up_is_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()

    def script() -> Iterator[Iterate]:
        for seconds in (1.0, 2.0, 4.0):
            clock.now += seconds
            yield iterate(1.0, F=10.0)

    def method(problem: Problem, x0: Vector, **_: object) -> Stage:  # noqa: ARG001
        clock.now += 100.0
        return ending_well(script())

    monkeypatch.setattr(methods, "load", lambda name: method)  # noqa: ARG005
    trace = Trace()
    result = run(EXAMPLE, "newton", trace=trace, clock=clock)
    assert [row.seconds for row in trace.rows] == [0.0, 101.0, 103.0, 107.0]
    assert (result.setup_seconds, result.solve_seconds) == (100.0, 7.0)


def test_time_limit_counts_set_up_and_iterations(scripted: Callable[[Script], None]) -> None:
    clock = Clock()

    def script() -> Iterator[Iterate]:
        while True:
            clock.now += 1.0
            yield iterate(1.0, F=10.0)

    scripted(script)
    result = run(EXAMPLE, "shi", limits=Limits(time_limit=5.0), clock=clock)
    assert result.status is Status.TIME_LIMIT
    assert result.iterations == 5


def test_time_limit_counts_what_it_takes_to_measure_the_iterates(scripted: Callable[[Script], None]) -> None:
    clock = Clock()

    class Slow(Trace):
        def add(self, row: TraceRow, criterion: Criterion) -> None:
            clock.now += 1.0
            super().add(row, criterion)

    def script() -> Iterator[Iterate]:
        while True:
            yield iterate(1.0, F=10.0)

    scripted(script)
    result = run(EXAMPLE, "shi", limits=Limits(time_limit=5.0), clock=clock, trace=Slow())
    assert result.status is Status.TIME_LIMIT
    assert (result.iterations, result.solve_seconds) == (4, 0.0)


def test_interrupted_run_reports_its_best_iterate(scripted: Callable[[Script], None]) -> None:
    def script() -> Iterator[Iterate]:
        yield iterate(1.0, F=10.0)
        yield iterate(2.0, F=1.0)
        raise KeyboardInterrupt

    scripted(script)
    result = run(EXAMPLE, "shi")
    assert result.status is Status.INTERRUPTED
    assert np.array_equal(result.z, np.full(4, 4.0))


def test_overflow_inside_a_method_is_a_breakdown(scripted: Callable[[Script], None]) -> None:
    def script() -> Iterator[Iterate]:
        yield iterate(1.0, F=10.0)
        yield iterate(np.array([1e300]) * np.array([1e300]), F=1.0)

    scripted(script)
    result = run(EXAMPLE, "shi")
    assert result.status is Status.BREAKDOWN
    assert "overflow" in result.message


def test_iteration_limit_is_kept() -> None:
    result = run(EXAMPLE, "fixed-point", limits=Limits(max_iterations=7))
    assert result.status is Status.ITERATION_LIMIT
    assert result.iterations == 7


def test_no_iteration_may_be_asked_for() -> None:
    assert run(EXAMPLE, "shi", limits=Limits(max_iterations=0)).iterations == 0


@pytest.mark.parametrize(("growth", "status"), [(0.5e100, Status.STALLED), (2e100, Status.DIVERGED)])
def test_residual_that_has_grown_by_100_decades_is_divergence_and_no_smaller_one(
    growth: float, status: Status, scripted: Callable[[Script], None]
) -> None:
    """For M = I, q = -1 and x < 0 it is F = 2x - 1."""
    scripted(lambda: iter([iterate(x, F=2 * x - 1) for x in (-1.0, -1.5 * growth, -1.0)]))
    result = run(Problem(np.eye(4), -np.ones(4)), "shi", -np.ones(4))
    assert result.status is status


@pytest.mark.parametrize("final", [False, True])
def test_method_that_wants_to_correct_signs_at_a_solution_has_three_iterations_for_it(
    final: bool, scripted: Callable[[Script], None]
) -> None:
    scripted(lambda: iter([iterate(1.0), *9 * [iterate(ANSWER, F=0.0)._replace(signs_final=final)]]))
    result = run(EXAMPLE, "shi")
    assert (result.solved, result.iterations) == (True, 2 if final else 2 + 3)


def test_diverging_iteration_is_called_so_and_keeps_a_finite_z() -> None:
    result = run(Problem([[-0.5]], [-1.0]), "fixed-point")
    assert result.status is Status.DIVERGED
    assert np.isfinite(result.z).all()


def test_exact_start_is_recognised_though_its_F_is_large() -> None:
    """z = 0 solves any problem with q >= 0, for every negative x that represents it."""
    result = run(Problem([[-5.0, 2.0], [-6.0, 1.0]], [1.0, 2.0]), "shi", [-3.0, -4.0])
    assert result.solved
    assert result.iterations == 0


def test_residual_is_measured_now_and_then_where_its_bound_never_comes_down() -> None:
    """With M singular F stays large along the iteration although z has converged long before."""
    result = run(Problem(np.ones((3, 3)), [-1.0, -2.0, -3.0]), "fixed-point")
    assert result.solved
    assert result.iterations <= 256


def test_start_that_is_given_displaces_both_points_of_the_problem() -> None:
    problem = Problem(EXAMPLE.M, EXAMPLE.q, x0=np.ones(4), x1=2 * np.ones(4))
    trace = Trace()
    run(problem, "shi", trace=trace)
    assert np.array_equal(trace.rows[1].z, np.full(4, 4.0))
    trace = Trace()
    run(problem, "shi", -np.ones(4), trace=trace)
    assert not np.array_equal(trace.rows[1].z, np.full(4, 4.0))


@pytest.mark.parametrize("x1", [[1.0], [1.0, 2.0, 3.0, float("nan")], "x"])
def test_second_point_is_checked_like_the_first(x1: object) -> None:
    with pytest.raises(ProblemError, match="x1"):
        run(EXAMPLE, "shi", x1=x1)


def test_numpy_numbers_are_numbers() -> None:
    assert run(EXAMPLE, "fixed-point", omega=np.float32(2), limits=Limits(max_iterations=np.int64(500))).solved


def test_error_is_to_the_nearest_known_solution() -> None:
    problem = read(contents.shipped_path("bimatrix.json"))
    first, _, third = problem.solutions
    for solution in (first, third):
        w = problem.w(solution)
        result = run(problem, "shi", (solution - w) / 2)
        assert result.solved
        assert result.iterations == 0
        assert result.error is not None
        assert result.error <= 1e-15


def test_option_of_another_method_is_refused() -> None:
    with pytest.raises(OptionError, match=r"^omega: has no effect with the method shi"):
        run(EXAMPLE, "shi", omega=2.0)


def test_unknown_method_is_refused_with_the_known_ones() -> None:
    with pytest.raises(OptionError, match="fixed-point"):
        run(EXAMPLE, "nonsense")


@pytest.mark.parametrize("name", list(methods.METHODS))
def test_options_in_force_are_reported_defaults_too(name: str) -> None:
    options = run(EXAMPLE, name).options
    assert set(options) == set(methods.parameters_of(name))
    assert all(value is not None for key, value in options.items() if key != "x1")


def test_start_is_the_problems_own_unless_given() -> None:
    trace = Trace()
    run(EXAMPLE, "shi", trace=trace)
    assert np.array_equal(trace.rows[0].z, np.full(4, 20.0))
    trace = Trace()
    run(Problem(EXAMPLE.M, EXAMPLE.q), "shi", trace=trace)
    assert np.array_equal(trace.rows[0].z, np.zeros(4))


def test_tolerance_is_what_the_relative_residual_comes_down_to() -> None:
    for tol in (1e-2, 1e-6, 1e-12):
        result = run(EXAMPLE, "fixed-point", limits=Limits(tol=tol))
        assert result.solved
        assert tol / 100 < result.relative_residual <= tol


@pytest.mark.parametrize(
    ("name", "value"), [("tol", 0.0), ("tol", 1.0), ("max_iterations", -1), ("time_limit", 0.0), ("tol", math.nan)]
)
def test_limits_out_of_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(OptionError, match=name):
        Limits(**{name: value})  # type: ignore[arg-type]
