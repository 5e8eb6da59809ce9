"""Processes of their own for solvers that cannot be interrupted: a crash or the time limit ends only the process."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Sequence

from lcpcli import clock


def run(arguments: Sequence[str], time_limit: float) -> tuple[str, float]:
    """Run a command that prints a line when everything is loaded; return how it failed, "" if it did not, and for how
    many seconds it ran after that line."""
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            began = clock.seconds()
            code = process.wait(None if time_limit == float("inf") else time_limit)
        except subprocess.TimeoutExpired:
            return "stopped at the time limit", clock.seconds() - began
        finally:
            process.kill()
        seconds = clock.seconds() - began
    if code < 0:
        return f"killed by {signal.Signals(-code).name}", seconds
    return f"failed with exit code {code}" if code else "", seconds
