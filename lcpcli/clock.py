"""The clock of every run: seconds that a user waits for a solution, in which imports do not count."""

from __future__ import annotations

import time
from collections.abc import Callable

PARTS = ("setup", "solve", "verify")


class _Imports:
    """A context for imports that are put off until they are needed: the clock stands still in it."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self._depth, self._began = 0, 0.0

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
    """Seconds since an arbitrary moment, without those spent in `imports`."""
    return time.perf_counter() - imports.seconds


class Stopwatch:
    """The seconds of one run, divided among its PARTS, which take turns.

    clock : the clock. began : when the run began, by that clock.
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
        """Leave the time since the last call out."""
        self._last = self._clock()

    def elapsed(self) -> float:
        """All that has passed since the run began."""
        return self._clock() - self._began

    @property
    def total(self) -> float:
        """All that was counted."""
        return sum(self.parts.values())
