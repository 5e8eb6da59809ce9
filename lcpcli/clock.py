"""The clock of every run: seconds that a user waits for a solution, in which imports do not count."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.machinery import ExtensionFileLoader, ModuleSpec, SourceFileLoader, SourcelessFileLoader
from itertools import accumulate, pairwise
from types import ModuleType
from typing import Any, TypeVar

PARTS = ("setup", "solve", "verify")
MOST_LAPS = 100_000  # of a run, a few MB: more than any run has that is short enough to be repeated
Lap = tuple[str, float]  # a turn of a part, and its seconds
Key = TypeVar("Key")
LOADERS = (SourceFileLoader, SourcelessFileLoader, ExtensionFileLoader)


class _Imports:
    """The time of all imports from the first reading of the clock on; the clock stands still during an import.

    The object is first in sys.meta_path, where it calls the finders after it, and times them and the loading of modules
    from files. So it also counts imports that scipy, for instance, defers until a function is called.
    """

    def __init__(self) -> None:
        self.seconds, self.watches = 0.0, False
        self.depth, self.began = 0, 0.0  # of the import that is under way, perhaps in another thread

    def watch(self) -> None:
        """Count imports from now on."""
        self.watches = True
        sys.meta_path.insert(0, self)

    def __enter__(self) -> None:
        if not self.depth:
            self.began = time.perf_counter()
        self.depth += 1

    def __exit__(self, *error: object) -> None:
        self.depth -= 1
        if not self.depth:
            self.seconds += time.perf_counter() - self.began

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the module as the finders after this finder find it, with a loader that is timed."""
        finders = sys.meta_path[sys.meta_path.index(self) + 1 :]
        with self:
            found = (finder.find_spec(fullname, path, target) for finder in finders if hasattr(finder, "find_spec"))
            spec = next((spec for spec in found if spec is not None), None)
        loader: Any = None if spec is None else spec.loader
        if isinstance(loader, LOADERS):  # a loader of these classes loads a single module
            for step in ("create_module", "exec_module"):
                setattr(loader, step, self._timed(getattr(loader, step)))
        return spec

    def _timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            with self:
                return function(*arguments)

        return timed


imports = _Imports()


def seconds() -> float:
    """Return the seconds since an arbitrary moment, without the time of imports."""
    if not imports.watches:
        imports.watch()
    return (imports.began if imports.depth else time.perf_counter()) - imports.seconds


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
        if len(self.laps) < self._most_laps:
            self.laps.append((part, now - self._last))
        self._last = now

    def skip(self) -> None:
        """Leave out the time since the last call."""
        self._last = self._clock()

    def elapsed(self) -> float:
        """Return all seconds since the run began."""
        return self._clock() - self._began

    @property
    def total(self) -> float:
        """Return the sum of all counted seconds."""
        return sum(self.parts.values())


def least_laps(runs: Sequence[Sequence[tuple[Key, float]]]) -> list[tuple[Key, float]]:
    """Return the laps of a run, each with its least time in several repetitions of the run.

    The iterates are the same each time, and only the times are disturbed, by pauses that other programs cause: few long
    runs are free of pauses, but most short laps are. Repetitions whose laps differ from the first one's, because a time
    limit has cut them short, do not count.
    """
    keys = [key for key, _ in runs[0]]
    alike = [run for run in runs if [key for key, _ in run] == keys]
    return [(key, min(run[i][1] for run in alike)) for i, key in enumerate(keys)]


def least_steps(runs: Sequence[Mapping[int, float]]) -> dict[int, float]:
    """Return the times at which the steps of a run end, by their numbers: the running sum of `least_laps` of several
    repetitions of the run."""
    ends = [[(0, 0.0), *sorted(run.items())] for run in runs]
    laps = least_laps([[(k, end - begin) for (_, begin), (k, end) in pairwise(run)] for run in ends])
    return dict(zip((k for k, _ in laps), accumulate(seconds for _, seconds in laps), strict=True))
