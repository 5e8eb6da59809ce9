"""A long run shows how it goes, on a terminal only and on one line; a quick one, a pipe and --quiet show nothing."""

from __future__ import annotations

import itertools
import os
import re
import subprocess
import sys
import time
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from lcpcli import Problem, interrupts
from lcpcli.cli import terminal
from lcpcli.files import writing
from lcpcli.gallery import families as gallery
from lcpcli.methods import registry as methods
from lcpcli.methods.stages import Finished, Iterate, Stage
from lcpcli.options import Limits
from lcpcli.solving.driver import run
from lcpcli.solving.trace import INTERVAL, Observer
from lcpcli.typing import Vector

from .conftest import MAIN

pty = pytest.importorskip("pty")  # there is none on Windows


class Clock:
    """A clock that is set forward."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class Terminal(StringIO):
    """A standard error that is a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(time, "monotonic", clock)
    return clock


def test_observer_reports_by_the_clock_and_not_by_the_iterate(clock: Clock) -> None:
    reports: list[tuple[str, int, float, float]] = []
    observer = Observer(lambda *seen: reports.append(seen), "shi")
    for k in range(1000):
        clock.now = k * INTERVAL / 100
        observer.note("shi", k, 1.0 / (k + 1))
    assert 9 <= len(reports) <= 10
    assert all(later[3] - earlier[3] >= 0.999 * INTERVAL for earlier, later in itertools.pairwise(reports))
    method, k, level, seconds = reports[0]
    assert (method, level) == ("shi", 1.0 / (k + 1))
    assert seconds == pytest.approx(k * INTERVAL / 100)


def test_driver_reports_the_iterate_and_its_level(clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    def method(problem: Problem, x0: Vector, **_: object) -> Stage:  # noqa: ARG001
        for k in range(1, 4):
            clock.now = float(k)
            yield Iterate(np.array([9.0]), np.array([4.0 / 2**k]), "", k, method="inner" if k == 2 else "")
        return Finished()

    monkeypatch.setattr(methods, "load", lambda name: method)  # noqa: ARG005
    reports: list[tuple[str, int, float, float]] = []
    run(Problem([[1.0]], [-1.0]), "newton", observe=lambda *seen: reports.append(seen))
    assert reports == [("newton", 1, 2.0, 1.0), ("inner", 2, 1.0, 2.0), ("newton", 3, 0.5, 3.0)]


def test_a_long_step_in_compiled_code_is_watched_too() -> None:
    looks: list[int] = []
    with interrupts.within(10.0, lambda: looks.append(1)), interrupts.within(9.0):
        assert interrupts.interruptibly(lambda: time.sleep(3.5 * interrupts.WAIT) or "done") == "done"
    assert looks
    assert interrupts.interruptibly(lambda: "unwatched") == "unwatched"


def test_nothing_is_shown_in_the_first_second_and_all_is_gone_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    with terminal.Line() as line:
        line.tell("shi", 3, 0.5, terminal.PATIENCE / 2)
    assert stream.getvalue() == ""
    with terminal.Line() as line:
        line.tell("shi", 1234, 2.5e-5, 1.5)
        line.tell("shi", 2345, float("inf"), 2.5)
    shown = stream.getvalue().split(terminal.ERASE)
    assert shown == ["", "shi  k = 1234  relative residual about 2.5e-05  1.5 s", "shi  k = 2345  2.5 s", ""]
    assert "\n" not in stream.getvalue()


def test_quiet_and_a_terminal_that_cannot_erase_silence_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream, quiet, term, shown in (
        (Terminal(), False, "xterm", True),
        (Terminal(), True, "xterm", False),
        (Terminal(), False, "dumb", False),
        (StringIO(), False, "xterm", False),
    ):
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setenv("TERM", term)
        assert terminal.shows_progress(quiet) is shown


def test_long_solve_shows_its_line_on_standard_error_alone(tmp_path: Path) -> None:
    file = tmp_path / "endless.json"
    infeasible = Problem([[0, -1], [1, 0]], [-1, -1])  # so that the iterates run off for ever
    writing.write(infeasible, str(file))
    program = f"from lcpcli.cli import terminal; terminal.PATIENCE = 0.1; {MAIN}"
    command = [sys.executable, "-c", program, "solve", str(file), "--method", "fixed-point", "--format", "json"]
    command += ["--time-limit", "1.2", "--max-iterations", "1000000000"]
    theirs, ours = pty.openpty()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=ours, env={**os.environ, "TERM": "xterm"})
    os.close(ours)
    shown = os.read(theirs, 1 << 16).decode()
    os.close(theirs)
    assert (done.stdout[:1], done.stdout.count(b"\n")) == (b"{", 1)
    assert re.search(r"fixed-point  k = \d+  relative residual about \d\.\de[-+]\d+  \d\.\d s", shown)
    assert (shown.endswith(terminal.ERASE), "\n" in shown) == (True, False)


def test_observing_changes_nothing_in_the_result() -> None:
    problem = gallery.make("harker-pang", 20)
    plain = run(problem, "shi", limits=Limits(max_iterations=50))
    watched = run(problem, "shi", limits=Limits(max_iterations=50), observe=lambda *seen: None)  # noqa: ARG005
    assert np.array_equal(plain.z, watched.z)
