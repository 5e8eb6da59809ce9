"""A callback sees every iterate, and may end the run."""

from __future__ import annotations

import numpy as np
import pytest

import lcpcli
from lcpcli import TraceRow
from lcpcli.errors import LCPError
from lcpcli.solving.trace import Callback

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
