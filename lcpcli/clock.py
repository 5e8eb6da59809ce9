"""The clock of every run: seconds that a user waits for a solution, in which imports do
not count."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PARTS = ("setup", "solve", "verify")


class _Imports(threading.local):
    """The context in which modules are loaded, whose time does not count: the clock of
    the thread leaves it out.

    It stands around each import in a function that a run may call, also of what a
    library loads at its first use.
    """

    # Of all imports of the thread; of the one under way.
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
    """Return the seconds since a moment that is arbitrary, and another one in each
    thread, without those of imports."""
    return time.perf_counter() - imports.seconds


class Stopwatch:
    """The seconds of one run, divided among its PARTS, which take turns.

    clock : the clock. began : the start of the run, by that clock. parts : the seconds
        of each part.
    """

    def __init__(self, clock: Callable[[], float], began: float) -> None:
        self._clock, self._began, self._last = clock, began, began
        self.parts = dict.fromkeys(PARTS, 0.0)

    def count(self, part: str) -> None:
        """Count the time since the last call as part of the run."""
        now = self._clock()
        self.parts[part] += now - self._last
        self._last = now

    def skip(self) -> None:
        self._last = self._clock()

    def pause(self) -> None:
        """Leave out the time since the last call, also of what has elapsed."""
        last = self._last
        self.skip()
        self._began += self._last - last

    def elapsed(self) -> float:
        return self._clock() - self._began

    @property
    def total(self) -> float:
        return sum(self.parts.values())
