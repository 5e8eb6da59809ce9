"""The loop: it trusts residuals, not methods; it stops at its limits; it says how it
ended. A trace keeps the iterates asked for; a callback sees every iterate, and may end
the run. A run has one route and one result to the bit, whether it keeps iterates or
not, and one deadline for its parts.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import lcpcli
from lcpcli import Problem, Status, Trace, read, solve
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.interrupts import deadline_after, remaining
from lcpcli.methods import registry as methods
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stalled
from lcpcli.options import Limits
from lcpcli.solving import driver
from lcpcli.solving.driver import run

EXAMPLE = read(contents.shipped_path("paper-example-1.json"))
ANSWER = np.array([0.5, -0.5, 0.5, -0.5])
STEPPING = {"iterates": True, "uses_start": True}


class Clock:
    """A clock that a script sets forward."""

    now = 0.0

    def __call__(self):
        return self.now


def iterate(x, F=None):
    return Iterate(
        np.broadcast_to(x, 4) * 1.0, None if F is None else np.full(4, F), "", 0
    )


def test_best_iterate_is_reported_and_a_solution_even_after_a_breakdown(liar):
    steps = [iterate(1.0, F=10.0), iterate(2.0, F=1.0), iterate(3.0, F=5.0)]
    result = liar.run(EXAMPLE, steps, Stalled("for a test"), STEPPING)
    assert (
        result.message
        == "stalled: for a test; the best iterate is reported, not the last"
    )
    assert result.z.tolist() == [4.0] * 4
    assert result.iterations == 3
    result = liar.run(
        EXAMPLE,
        [iterate(1.0), iterate(ANSWER, F=1.0)],
        Breakdown("something"),
        STEPPING,
    )
    assert result.status == Status.SOLVED
    assert result.residual == 0.0


def test_seconds_are_the_methods_own_and_set_up_is_apart(monkeypatch):
    clock = Clock()

    def stage():
        for seconds in (1.0, 2.0, 4.0):
            clock.now += seconds
            yield iterate(1.0, F=10.0)
        return Finished()

    def method(problem, x0, **_):  # noqa: ARG001
        clock.now += 100.0
        return stage()

    monkeypatch.setattr(methods, "load", lambda name: method)  # noqa: ARG005
    trace = Trace()
    result = run(EXAMPLE, "newton", trace=trace, clock=clock)
    assert [row.seconds for row in trace.rows] == [0.0, 101.0, 103.0, 107.0]
    assert result.setup_seconds == 100.0
    assert result.solve_seconds == 7.0
    assert result.seconds == 107.0 + result.verify_seconds


@pytest.mark.parametrize(
    ("own", "measuring", "expected"), [(1.0, 0.0, (5, 5.0)), (0.0, 1.0, (4, 0.0))]
)
def test_time_limit_counts_iterations_and_what_it_takes_to_measure_them(
    own, measuring, expected, liar
):
    clock = Clock()

    class Slow(Trace):
        def add(self, row, criterion):
            clock.now += measuring
            super().add(row, criterion)

    def steps():
        while True:
            clock.now += own
            yield iterate(1.0, F=10.0)

    liar.register(EXAMPLE, steps(), iterates=True)
    result = run(
        EXAMPLE, "liar", limits=Limits(time_limit=5.0), clock=clock, trace=Slow()
    )
    assert result.status is Status.TIME_LIMIT
    assert (result.iterations, result.solve_seconds) == expected


def test_an_interrupt_leaves_the_best_iterate_and_overflow_is_a_breakdown(liar):
    def steps():
        yield iterate(1.0, F=10.0)
        yield iterate(2.0, F=1.0)
        raise KeyboardInterrupt

    liar.register(EXAMPLE, steps(), iterates=True)
    result = run(EXAMPLE, "liar")
    assert result.status == Status.INTERRUPTED
    assert result.z.tolist() == [4.0] * 4
    result = liar.run(
        EXAMPLE,
        (iterate(x * np.array([1e300]), F=1.0) for x in (1.0, np.array([1e300]))),
    )
    assert result.status is Status.BREAKDOWN
    assert "overflow" in result.message


def test_residual_that_has_grown_by_100_decades_is_divergence_and_no_smaller_one(liar):
    """For M = I, q = -1 and x < 0 it is F = 2x - 1."""
    for growth, status in ((0.5e100, Status.STALLED), (2e100, Status.DIVERGED)):
        steps = [iterate(x, F=2 * x - 1) for x in (-1.0, -1.5 * growth, -1.0)]
        result = liar.run(
            Problem(np.eye(4), -np.ones(4)), steps, None, STEPPING, x0=-np.ones(4)
        )
        assert result.status is status


def test_method_that_wants_to_correct_signs_at_a_solution_has_three_iterations_for_it(
    liar,
):
    for final, iterations in ((False, 2 + 3), (True, 2)):
        steps = [
            iterate(1.0),
            *9 * [iterate(ANSWER, F=0.0)._replace(signs_final=final)],
        ]
        result = liar.run(EXAMPLE, steps, None, STEPPING)
        assert result.solved
        assert result.iterations == iterations


def test_start_is_the_problems_own_unless_given_and_displaces_both_of_its_points():
    def rows(problem, *start):
        trace = Trace()
        run(problem, "shi", *start, trace=trace)
        return [row.z.tolist() for row in trace.rows]

    assert rows(EXAMPLE)[0] == [20.0] * 4
    assert rows(Problem(EXAMPLE.M, EXAMPLE.q))[0] == [0.0] * 4
    problem = Problem(EXAMPLE.M, EXAMPLE.q, x0=np.ones(4), x1=2 * np.ones(4))
    assert rows(problem)[1] == [4.0] * 4
    assert rows(problem, -np.ones(4))[1] != [4.0] * 4


@pytest.mark.parametrize("name", list(methods.METHODS))
def test_options_in_force_are_reported_defaults_too(name):
    options = run(EXAMPLE, name).options
    assert set(options) == set(methods.parameters_of(name))
    assert all(value is not None for key, value in options.items() if key != "x1")


def test_trace_keeps_the_start_the_first_every_so_many_and_the_last_three():
    for every in (1, 2, 7, 1000):
        trace = Trace(every=every)
        last = run(EXAMPLE, "fixed-point", trace=trace).iterations
        expected = {0, 1, *range(0, last + 1, every), last - 2, last - 1, last}
        assert [row.k for row in trace.rows] == sorted(expected)


def test_trace_of_many_rows_is_thinned_by_doubling():
    trace = Trace(every=5, most=20)
    last = run(
        EXAMPLE,
        "fixed-point",
        x0=np.full(4, 1e9),
        trace=trace,
        limits=Limits(tol=1e-15),
    ).iterations
    assert last > 40
    assert len(trace.rows) <= 20
    assert trace.every in (5, 10, 20, 40)
    kept = [row.k for row in trace.rows]
    assert kept == sorted(
        {0, 1, *range(0, last + 1, trace.every), last - 2, last - 1, last}
    )


def test_trace_of_a_breakdown_or_a_divergence_shows_how_far_it_came():
    trace = Trace()
    assert (
        run(Problem([[-1.0]], [-1.0]), "fixed-point", trace=trace).status
        is Status.BREAKDOWN
    )
    assert [(row.k, row.z.tolist()) for row in trace.rows] == [(0, [0.0])]
    trace = Trace(residuals=False)
    result = run(Problem([[-0.5]], [-1.0]), "fixed-point", trace=trace)
    assert result.status == Status.DIVERGED
    assert trace.rows[-1].z.max() > 1e90


def test_milestones_are_the_first_iterates_with_a_relative_error_of_each_level():
    problem = Problem(EXAMPLE.M, EXAMPLE.q, x0=EXAMPLE.x0, solutions=EXAMPLE.solutions)
    trace = Trace()
    curve = Trace(every=10**9, residuals=False, levels=(1e-3, 1e-6, 1e-30))
    run(problem, "fixed-point", trace=trace, curve=curve)
    for milestone, level in zip(curve.milestones, (1e-3, 1e-6), strict=True):
        first = next(
            row for row in trace.rows if row.error is not None and row.error <= level
        )
        assert milestone.level == level
        assert milestone.k == first.k
        assert milestone.seconds == first.seconds


def test_trace_measures_what_results_do_and_keeps_the_components_asked_for():
    trace, few = Trace(), Trace(components=np.array([0, 3]))
    result = run(EXAMPLE, "fixed-point", trace=trace)
    assert trace.rows[-1].residual == result.residual
    assert trace.rows[-1].error == result.error
    run(EXAMPLE, "fixed-point", trace=few)
    assert [row.z.tolist() for row in few.rows] == [
        row.z[[0, 3]].tolist() for row in trace.rows
    ]


M, Q = [[2, 1], [1, 2]], [-5, -6]


@pytest.mark.parametrize(
    "method", ["auto", "shi", "fixed-point", "newton", "interior", "lemke"]
)
def test_it_sees_the_rows_of_a_trace_but_the_start(method):
    rows = []
    result = solve(M, Q, method, callback=rows.append, trace=True)
    assert result.solved
    for row, other in zip(rows, result.trace.rows[1:], strict=True):
        for name in ("k", "method", "step", "residual", "error"):
            assert getattr(row, name) == getattr(other, name)
        assert np.array_equal(row.z, other.z)
        assert row.residual == pytest.approx(
            np.abs(np.minimum(row.z, np.array(M) @ row.z + Q)).max()
        )


def _raise(row):
    if row.k == 3:
        raise StopIteration


def test_the_time_of_a_callback_is_none_of_the_run():
    now = [0.0]

    def slow(_):
        now[0] += 3600

    result = run(
        Problem(M, Q), "fixed-point", callback=slow, clock=lambda: now[0], began=0.0
    )
    assert result.iterations > 3
    assert result.seconds == 0


@pytest.mark.parametrize(
    "callback", [lambda row: row.k == 3, _raise], ids=["true", "StopIteration"]
)
def test_it_ends_the_run_with_the_best_iterate_but_for_a_solution(callback):
    result = solve(M, Q, "fixed-point", callback=callback)
    assert result.status.word == "interrupted"
    assert result.iterations == 3
    assert not result.interrupted
    assert result.message.startswith("interrupted: by the callback")
    assert result.residual < 1
    assert solve(M, Q, "newton", x0=[1, 1], callback=lambda row: row.k == 1).solved


@pytest.mark.parametrize("is_pressed", [False, True], ids=["true", "Ctrl-C"])
def test_it_ends_auto_before_its_solution_and_the_trace_ends_there_too(is_pressed):
    def ends(row):
        if is_pressed and row.k == 1:
            raise KeyboardInterrupt
        return row.k == 1

    M, q = [[1, 0, 0], [-2, 1, 0], [0, -2, 1]], [-1, 1, 1]
    assert solve(M, q).iterations > 1
    result = solve(M, q, callback=ends, trace=True, interrupts="return")
    assert result.status.word == "interrupted"
    assert result.iterations == 1
    assert result.interrupted == is_pressed
    assert [row.k for row in result.trace.rows] == [0, 1]


def test_its_exceptions_leave_the_call_and_its_arithmetic_is_its_own():
    def fails(row):
        raise KeyError(row.k)

    with pytest.raises(KeyError):
        solve(M, Q, callback=fails)

    def spoils(row):
        row.z[:] = np.nan

    with pytest.warns(RuntimeWarning, match="divide by zero"):
        assert solve(M, Q, callback=lambda row: np.ones(1) / (0 * row.z[:1]) < 0).solved
    assert solve(M, Q, "fixed-point", callback=spoils).solved, (
        "as it changes a copy of its own"
    )


FAMILIES = [
    ("harker-pang", 25),
    ("contact", 40),
    ("boxes", 10),
    ("degenerate", 40),
    ("qp", 120),
    ("obstacle", 300),
]
SMALL = st.integers(1, 5).flatmap(
    lambda n: st.tuples(
        *(arrays(float, shape, elements=st.integers(-3, 3)) for shape in ((n, n), n))
    )
)


def is_same(one, other):
    fields = ("status", "message", "route", "iterations", "evaluations", "basis")
    return np.array_equal(one.z, other.z) and all(
        getattr(one, name) == getattr(other, name) for name in fields
    )


def check(problem, **given):
    plain, kept = lcpcli.run(problem, **given), lcpcli.run(problem, trace=True, **given)
    assert is_same(plain, kept)
    assert given or is_same(plain, driver.run(problem, "auto", observe=lambda *_: None))
    rows = kept.trace.rows
    if kept.status is lcpcli.Status.SOLVED:
        assert [row.k for row in rows] == list(range(kept.iterations + 1))
        assert np.array_equal(rows[-1].z, kept.z)
    times = [row.seconds for row in rows]
    assert times == sorted(times)
    assert times[-1] <= kept.seconds


@settings(max_examples=20)
@given(SMALL)
def test_small_problems_have_one_run(data):
    check(Problem(*data))


@pytest.mark.parametrize(("family", "n"), FAMILIES)
def test_problems_of_the_gallery_have_one_run_whatever_was_solved_before(family, n):
    problem = families.make(family, n, 0)
    first = lcpcli.run(problem)
    check(problem)
    check(problem, basis=first.basis)
    for _ in range(5):
        solve([[2]], [-1])
    assert is_same(first, lcpcli.run(problem))


def test_ctrl_c_while_iterates_are_kept_leaves_the_result():
    class Pressing(Trace):
        def add(self, row, criterion):
            if row.k == last:
                raise KeyboardInterrupt
            super().add(row, criterion)

    problem = families.make("harker-pang", 25, 0)
    last = lcpcli.run(problem).iterations
    with pytest.raises(lcpcli.Interrupted) as error:
        lcpcli.run(problem, trace=Pressing())
    assert error.value.result.solved


# With faces of solutions.
SWAPS = Problem(np.kron(np.eye(3), [[0, 1], [1, 0]]), -np.ones(6))


def test_a_run_that_is_part_of_another_one_ends_with_it():
    problem = Problem(M, Q)
    for method in ("milp", "fixed-point", "newton"):
        assert run(problem, method).solved
        with deadline_after(-1.0):
            assert run(problem, method).status is Status.TIME_LIMIT


def test_pieces_leave_no_context_open_and_end_with_what_they_are_part_of():
    found = lcpcli.solutions(SWAPS, time_limit=60.0)
    for _ in found:
        assert remaining() == math.inf
    assert found.complete
    found = lcpcli.solutions(SWAPS, time_limit=60.0)
    with deadline_after(-1.0):
        assert not list(found)
    assert found.others is None


def test_digits_have_half_of_the_time_limit(monkeypatch):
    seen = []
    monkeypatch.setattr(
        "lcpcli.verify.digits.digits", lambda *_: seen.append(remaining())
    )
    solved = run(Problem(M, Q), "newton", limits=Limits(time_limit=100.0))
    assert solved.digits is None
    assert 40 < seen[0] <= 50


def test_ctrl_c_in_the_callback_of_the_last_iterate_keeps_the_solution():
    problem = families.make("harker-pang", 9, 0)
    usual = lcpcli.run(problem)

    def late(row):
        if row.k == usual.iterations:
            raise KeyboardInterrupt

    result = lcpcli.run(problem, callback=late, interrupts="return")
    assert result.interrupted
    assert is_same(result, usual)
