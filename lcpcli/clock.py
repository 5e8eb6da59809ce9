"""The clock of every run: seconds that a user waits for a solution, in which imports do not count."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

PARTS = ("setup", "solve", "verify")
MOST_LAPS = 100_000  # of a run, a few MB: more than any run has that is short enough to be repeated
Lap = tuple[str, float]  # a turn of a part, and its seconds
Key = TypeVar("Key")


class _Imports(threading.local):
    """The context in which modules are loaded, whose time does not count: the clock of the thread leaves it out.

    It stands around each import in a function that a run may call, also of what a library loads at its first use.
    """

    seconds, _depth, _began = 0.0, 0, 0.0  # of all imports of the thread; of the one under way

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
    """Return the seconds since a moment that is arbitrary, and another one in each thread, without those of imports."""
    return time.perf_counter() - imports.seconds


class Stopwatch:
    """The seconds of one run, divided among its PARTS, which take turns.

    clock : the clock. began : the start of the run, by that clock. most_laps : the largest number of turns kept.
    parts : the seconds of each part. laps : the first turns.
    """

    def __init__(self, clock: Callable[[], float], began: float, most_laps: int = 0) -> None:
        self._clock, self._began, self._last, self._most_laps = clock, began, began, most_laps
        self.parts = dict.fromkeys(PARTS, 0.0)
        self.laps: list[Lap] = []

    def count(self, part: str) -> None:
        """Count the time since the last call as part of the run."""
        now = self._clock()
        self.parts[part] += now - self._last
        if self._most_laps and len(self.laps) < self._most_laps:
            self.laps.append((part, now - self._last))
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


def least_laps(runs: Sequence[Sequence[tuple[Key, float]]]) -> list[tuple[Key, float]]:
    """Return the laps of a run, each with its least time in several repetitions of the run.

    Other programs cause pauses: few long runs are free of them, but most short laps are. Repetitions whose laps differ
    from the first one's, because a time limit has cut them short, do not count.
    """
    keys = [key for key, _ in runs[0]]
    alike = [run for run in runs if [key for key, _ in run] == keys]
    return [(key, min(run[i][1] for run in alike)) for i, key in enumerate(keys)]
