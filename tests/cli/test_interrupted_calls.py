"""Ctrl-C in a call from Python raises with the best iterate, or returns it."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from typing import Any

import pytest

import lcpcli
from lcpcli import Status
from lcpcli.solving.loop import Loop

from .conftest import interrupt, python

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")


def interrupt_iterations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Loop, "_take", interrupt)
    monkeypatch.setattr("lcpcli.solving.direct_run.result_of", interrupt)


def test_ctrl_c_is_not_lost_although_the_last_iterate_is_a_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    interrupt_iterations(monkeypatch)
    solved = lcpcli.run(lcpcli.Problem([[2, 1], [1, 2]], [5, 6]), interrupts="return")
    assert (solved.status, solved.interrupted) == (Status.SOLVED, True)
    open_still = lcpcli.run(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]), interrupts="return")
    assert (open_still.status, open_still.interrupted) == (Status.INTERRUPTED, True)


CALLS: dict[str, Callable[..., Any]] = {
    "run": lcpcli.run,
    "solve": lambda problem, **options: lcpcli.solve(problem.M, problem.q, **options),
    "solve_many of problems": lambda problem, **options: next(lcpcli.solve_many([problem], **options)),
    "solve_many of columns": lambda problem, **options: next(lcpcli.solve_many(problem.M, [[-5], [-6]], **options)),
    "exact": lcpcli.exact,
}


@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c_raises_with_the_best_iterate_or_returns_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("flint")
    call, problem = CALLS[name], lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    interrupt_iterations(monkeypatch)
    with pytest.raises(lcpcli.Interrupted, match="interrupted") as ending:
        call(problem)
    assert isinstance(ending.value, KeyboardInterrupt)
    assert (ending.value.result.status, ending.value.result.z.tolist()) == (Status.INTERRUPTED, [0, 0])
    assert call(problem, interrupts="return").interrupted
    with pytest.raises(lcpcli.errors.OptionError, match='interrupts: \'ignore\' is unknown; give "raise" or "return"'):
        call(problem, interrupts="ignore")
    assert isinstance(pickle.loads(pickle.dumps(ending.value)), lcpcli.Interrupted)


def test_ctrl_c_after_the_iteration_raises_with_the_best_iterate(monkeypatch: pytest.MonkeyPatch) -> None:
    once, real = iter([interrupt]), Loop._verified
    monkeypatch.setattr(Loop, "_verified", lambda *given: next(once, real)(*given))
    problem = lcpcli.from_qp(None, [1, 1], [[1, 1]], row_lower=[1])
    with pytest.raises(lcpcli.Interrupted) as ending:
        lcpcli.run(problem, trace=True)
    assert ending.value.result.interrupted
    assert ending.value.result.z.size == problem.n


def test_ctrl_c_while_a_conclusion_is_worked_out_leaves_it_to_the_next_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    result = lcpcli.run(lcpcli.from_qp(None, [1, 1], [[1, 1]], row_lower=[1]))
    with monkeypatch.context() as patched:
        patched.setattr("lcpcli.solving.minimum.has_other_minimum", interrupt)
        with pytest.raises(KeyboardInterrupt):
            result.answer.statement  # noqa: B018
    assert result.answer.proved == "several_optima"


def test_loop_of_a_user_ends_with_ctrl_c() -> None:
    code = """
import os, signal, lcpcli
from lcpcli.solving.loop import Loop
Loop._take = lambda *_: os.kill(os.getpid(), signal.SIGINT)
for i in range(2):
    print(i, flush=True)
    lcpcli.solve([[2, 1], [1, 2]], [-5, -6], "newton")
"""
    done = python(code)
    assert done.stdout == "0\n"
    assert done.stderr.splitlines()[-1] == "lcpcli.Interrupted: interrupted"
