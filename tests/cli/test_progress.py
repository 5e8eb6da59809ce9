"""The progress of long steps on a terminal: what is being done, and how much of a
total."""

import sys
import threading
import time
from pkgutil import resolve_name

import pytest

from lcpcli.cli import terminal

from .terminals import Terminal, lines_in

MAX_SECONDS = 60  # that a step waits for its name


def watched(monkeypatch):
    """Standard error, from now on a terminal on which progress is shown at once."""
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(terminal, "PATIENCE", 0.0)
    monkeypatch.setattr(terminal, "INTERVAL", 0.0)
    return stream


LONG_STEPS = {
    "solve good.json --exact": ("lcpcli.solving.proof.prove", "proving"),
    "solve good.json --bound": ("lcpcli.solving.driver.with_bound", "proving"),
    "solve good.json --all": ("lcpcli.enumeration.search.solutions", "searching"),
    "solve good.json --minimize z1": (
        "lcpcli.enumeration.optimum.optimum",
        "searching",
    ),
    "path good.json --direction 1,1 --to 1": (
        "lcpcli.parametric.following.follow",
        "following the path",
    ),
    "check good.json 1,2 --exact": ("lcpcli.solving.checking.lengths", "verifying"),
    "inspect good.json": (
        "lcpcli.files.input_file.InputFile.problem",
        "reading good.json",
    ),
    "convert good.json -o a.csv": (
        "lcpcli.files.input_file.InputFile.problem",
        "reading good.json",
    ),
}


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("line", LONG_STEPS)
def test_long_step_is_named_with_the_time_so_far(line, lcp, monkeypatch):
    """It is as long as it takes until the terminal shows its name."""
    name, text = LONG_STEPS[line]
    others = set(threading.enumerate())  # such as of calls that were abandoned
    stream = watched(monkeypatch)
    step = resolve_name(name)
    named_in_time = []

    def long_step(*given, **named):
        end = time.monotonic() + MAX_SECONDS
        while text not in stream.getvalue() and time.monotonic() < end:
            time.sleep(0.01)
        named_in_time.append(text in stream.getvalue())
        return step(*given, **named)

    monkeypatch.setattr(name, long_step)
    monkeypatch.setattr(terminal, "INTERVAL", 0.01)
    lcp(line)
    assert all(named_in_time)
    assert any(shown.startswith(text) for shown in lines_in(stream))
    assert set(threading.enumerate()) <= others


def test_folder_has_a_bar_with_the_number_of_its_files(lcp, folder, monkeypatch):
    stream = watched(monkeypatch)
    for name in ("M.csv", "q.csv"):
        (folder / name).unlink()
    lcp("solve . -o out.csv")
    assert "1/2" in stream.getvalue()
    assert "2/2" in stream.getvalue()
