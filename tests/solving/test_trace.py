"""A trace keeps the iterates asked for, measures no others, and costs next to nothing; a callback sees every iterate,
and may end the run."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, Status, Trace, TraceRow, read
from lcpcli.errors import LCPError
from lcpcli.files import contents
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.solving.trace import MOST_TOGETHER, Callback

EXAMPLE = read(contents.shipped_path("paper-example-1.json"))


def test_trace_keeps_the_start_the_first_every_so_many_and_the_last_three() -> None:
    for every in (1, 2, 7, 1000):
        trace = Trace(every=every)
        last = run(EXAMPLE, "fixed-point", trace=trace).iterations
        expected = {0, 1, *range(0, last + 1, every), last - 2, last - 1, last}
        assert [row.k for row in trace.rows] == sorted(expected)


def test_trace_of_many_rows_is_thinned_by_doubling() -> None:
    trace = Trace(every=5, most=20)
    last = run(EXAMPLE, "fixed-point", x0=np.full(4, 1e9), trace=trace, limits=Limits(tol=1e-15)).iterations
    assert last > 40
    assert len(trace.rows) <= 20
    assert trace.every in (5, 10, 20, 40)
    kept = [row.k for row in trace.rows]
    assert kept == sorted({0, 1, *range(0, last + 1, trace.every), last - 2, last - 1, last})


def test_trace_has_at_most_as_many_rows_as_asked_for() -> None:
    for most in range(5, 16):
        trace = Trace(most=most)
        assert run(EXAMPLE, "fixed-point", trace=trace).iterations > most
        assert most / 2 < len(trace.rows) <= most


def test_trace_of_a_method_that_breaks_down_or_diverges_shows_the_start_and_how_far_it_came() -> None:
    trace = Trace()
    assert run(Problem([[-1.0]], [-1.0]), "fixed-point", trace=trace).status is Status.BREAKDOWN
    assert [(row.k, row.z.tolist()) for row in trace.rows] == [(0, [0.0])]
    trace = Trace(residuals=False)
    result = run(Problem([[-0.5]], [-1.0]), "fixed-point", trace=trace)
    assert (result.status, np.isfinite(result.z).all()) == (Status.DIVERGED, True)
    assert trace.rows[-1].z.max() > 1e90


def test_rows_that_do_not_stay_are_not_measured_and_the_others_together() -> None:
    """One pass over M measures many rows: one for w, one for its terms."""

    class Counting(np.ndarray):  # type: ignore[type-arg]
        passes = columns = 0

        def __matmul__(self, other: np.ndarray) -> np.ndarray:
            Counting.passes += 1
            Counting.columns += other.size // other.shape[0]
            return self.view(np.ndarray) @ other

    def counted(trace: Trace | None) -> tuple[int, int, int]:
        Counting.passes = Counting.columns = 0
        iterations = run(problem, "fixed-point", trace=trace).iterations
        return Counting.passes, Counting.columns, iterations

    problem = Problem(EXAMPLE.M, EXAMPLE.q, x0=EXAMPLE.x0)
    object.__setattr__(problem, "M", problem.M.view(Counting))
    counted(None)
    passes, columns, _ = counted(None)
    trace = Trace(every=50)
    assert counted(trace)[1] == columns + 2 * len(trace.rows)
    more, _, iterations = counted(Trace())
    assert more == passes + 2 * (1 + iterations // MOST_TOGETHER)


def test_milestones_are_the_first_iterates_with_a_relative_error_of_each_level() -> None:
    problem = Problem(EXAMPLE.M, EXAMPLE.q, x0=EXAMPLE.x0, solutions=EXAMPLE.solutions)
    trace, curve = Trace(), Trace(every=10**9, residuals=False, levels=(1e-3, 1e-6, 1e-30))
    run(problem, "fixed-point", trace=trace, curve=curve)
    for milestone, level in zip(curve.milestones, (1e-3, 1e-6), strict=True):
        first = next(row for row in trace.rows if row.error is not None and row.error <= level)
        assert (milestone.level, milestone.k, milestone.seconds) == (level, first.k, first.seconds)


def test_trace_measures_what_the_result_measures_and_keeps_only_the_components_asked_for() -> None:
    trace, few = Trace(), Trace(components=np.array([0, 3]))
    result = run(EXAMPLE, "fixed-point", trace=trace)
    assert (trace.rows[-1].residual, trace.rows[-1].error) == (result.residual, result.error)
    run(EXAMPLE, "fixed-point", trace=few)
    assert [row.z.tolist() for row in few.rows] == [row.z[[0, 3]].tolist() for row in trace.rows]


@pytest.mark.parametrize("method", ["fixed-point", "shi", "newton", "lemke"])
def test_seconds_of_the_iterates_and_the_parts_of_the_run_add_up_to_the_whole(method: str) -> None:
    ticks = itertools.count()
    trace = Trace()
    result = run(EXAMPLE, method, trace=trace, clock=lambda: float(next(ticks)))
    assert [row.seconds for row in trace.rows] == sorted({row.seconds for row in trace.rows})
    assert trace.rows[-1].seconds <= result.seconds
    assert result.seconds == result.setup_seconds + result.solve_seconds + result.verify_seconds
    # each iterate takes a tick to be made, one to be measured before it is kept, and one after it
    spent = [later.seconds - earlier.seconds for earlier, later in itertools.pairwise(trace.rows)]
    assert set(spent[1:]) <= {3.0}


M, Q = [[2, 1], [1, 2]], [-5, -6]


@pytest.mark.parametrize("method", ["auto", "shi", "fixed-point", "newton", "interior", "lemke"])
def test_it_sees_the_rows_of_a_trace_but_the_start(method: str) -> None:
    rows: list[TraceRow] = []
    result = lcpcli.solve(M, Q, method, callback=rows.append, trace=True)
    assert result.solved
    kept = result.trace.rows[1:]
    assert [row.k for row in rows] == [row.k for row in kept] == list(range(1, result.iterations + 1))
    for row, other in zip(rows, kept, strict=True):
        for name in ("method", "step", "residual", "error"):
            assert getattr(row, name) == getattr(other, name)
        assert np.array_equal(row.z, other.z)
        assert row.residual == pytest.approx(np.abs(np.minimum(row.z, np.array(M) @ row.z + Q)).max())


def _raise(row: TraceRow) -> None:
    if row.k == 3:
        raise StopIteration


@pytest.mark.parametrize("callback", [lambda row: row.k == 3, _raise], ids=["true", "StopIteration"])
def test_it_ends_the_run_with_the_best_iterate_but_for_a_solution(callback: Callback) -> None:
    result = lcpcli.solve(M, Q, "fixed-point", callback=callback)
    assert (result.status.word, result.iterations, result.interrupted) == ("interrupted", 3, False)
    assert result.message.startswith("interrupted: by the callback")
    assert result.residual < 1
    assert lcpcli.solve(M, Q, "newton", x0=[1, 1], callback=lambda row: row.k == 1).solved


def test_its_exceptions_leave_the_call_and_its_arithmetic_is_its_own() -> None:
    def fails(row: TraceRow) -> None:
        raise KeyError(row.k)

    with pytest.raises(KeyError):
        lcpcli.solve(M, Q, callback=fails)

    def spoils(row: TraceRow) -> None:
        row.z[:] = np.nan

    with pytest.warns(RuntimeWarning, match="divide by zero"):
        assert lcpcli.solve(M, Q, callback=lambda row: np.ones(1) / (0 * row.z[:1]) < 0).solved
    assert lcpcli.solve(M, Q, "fixed-point", callback=spoils).solved, "as it changes a copy of its own"
    with pytest.raises(LCPError, match="callback: is a number; give a function of one argument"):
        lcpcli.solve(M, Q, callback=3)  # type: ignore[arg-type]


def test_solve_many_calls_it_for_each_problem() -> None:
    rows: list[TraceRow] = []
    results = list(lcpcli.solve_many(M, np.tile(np.reshape(Q, (2, 1)), (1, 6)), callback=rows.append))
    assert [row.k for row in rows if row.k == 1] == [1] * len(results)
