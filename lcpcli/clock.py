"""The clock of every run: the seconds that a user waits for a solution, without the
time for imports.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PARTS = ("setup", "solve", "verify")


class _Imports(threading.local):
    """The context in which modules are loaded, whose time is not counted: the clock of
    the thread leaves it out.

    Every import in a function that a run may call is made in this context, also if a
    library imports a module at its first use.
    """

    # The seconds of all imports of the thread so far; the nesting depth and the start
    # of the current import.
    seconds, _depth, _began = 0.0, 0, 0.0

    def __enter__(self) -> None:
        if not self._depth:
            self._began = time.perf_counter()
        self._depth += 1

    def __exit__(self, *error: object) -> None:
        self._depth -= 1
        if not self._depth:
            self.seconds += time.perf_counter() - self._began


imports = _Imports()


def seconds() -> float:
    """Return the seconds since a fixed moment, without those of imports. The moment is
    arbitrary and differs between threads.
    """
    return time.perf_counter() - imports.seconds


class Stopwatch:
    """The seconds of one run, divided among its PARTS.

    clock : the function that returns the time.
    began : the start of the run, by that clock.
    parts : the seconds of each part.
    """

    def __init__(self, clock: Callable[[], float], began: float) -> None:
        self._clock = clock
        self._began = began
        self._last = began
        self.parts = dict.fromkeys(PARTS, 0.0)

    def count(self, part: str) -> None:
        """Add the time since the last call to a part of the run."""
        now = self._clock()
        self.parts[part] += now - self._last
        self._last = now

    def skip(self) -> None:
        self._last = self._clock()

    def pause(self) -> None:
        """Leave the time since the last call out of all parts and of the elapsed
        time.
        """
        last = self._last
        self.skip()
        self._began += self._last - last

    def elapsed(self) -> float:
        return self._clock() - self._began

    @property
    def total(self) -> float:
        return sum(self.parts.values())
