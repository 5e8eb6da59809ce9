"""How often a run is made so that its times can be shown: none includes what only a first run costs.

Beyond imports, which never count, a first run in a process waits for memory and caches. So a brief one is made again,
whether there is one problem or many; and runs that are compared are made several times, of which each step counts with
the least.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate
from statistics import median
from typing import TYPE_CHECKING

from lcpcli.clock import PARTS, least_laps

if TYPE_CHECKING:
    from lcpcli.solving.result import Result
    from lcpcli.solving.trace import Trace

BRIEF = 0.02  # seconds: a run that is not longer is made again if it is the first of its method
LONG = 1.0  # seconds of a run that is not repeated even if it is compared
ENOUGH, BUDGET = 20, 0.3  # repetitions, and seconds of them, either of which is enough

ROUNDING = 1e-9  # relative, of sums of seconds

_methods: set[str] = set()  # that have been run in this process


def timed(once: Callable[[], Result], compared: bool) -> Iterator[Result]:
    """The result of a run with times to be shown, or to be compared with those of others.

    Raises KeyboardInterrupt after the result if a repetition was interrupted.
    """
    runs, interrupted = [once()], False
    is_first = runs[0].method not in _methods
    _methods.add(runs[0].method)
    try:
        while not runs[-1].interrupted and _is_repeated([run.seconds for run in runs], compared, is_first):
            runs.append(once())
    except KeyboardInterrupt:
        interrupted = True
    whole = [run for run in runs if not run.interrupted]
    yield _least(whole[1:]) if whole[1:] else runs[0]
    if interrupted or (whole and len(whole) < len(runs)):
        raise KeyboardInterrupt


def _is_repeated(seconds: Sequence[float], compared: bool, is_first: bool) -> bool:
    """Whether another run is to be made after runs of so many seconds, of which the first one is not to count."""
    if compared:
        undisturbed = len(seconds[1:]) * min(seconds)  # the more pauses there are, the more often it is repeated
        return seconds[0] <= LONG and len(seconds) <= ENOUGH and undisturbed < BUDGET
    return is_first and len(seconds) == 1 and seconds[0] <= BRIEF


def _least(runs: Sequence[Result]) -> Result:
    """The result of repeated runs, with the least time of each lap, and the spread of the times."""
    first = runs[0]
    laps = least_laps([run.laps or tuple(run.parts.items()) for run in runs])
    parts = {part: sum(seconds for own, seconds in laps if own == part) for part in PARTS}
    ends, least_ends = (list(accumulate(seconds for _, seconds in each)) for each in (first.laps, laps))

    def retimed(trace: Trace | None) -> Trace | None:
        """The trace, whose iterates end a lap each, but for rounding of the sums."""
        if trace is None:
            return None
        ended = {k: bisect(ends, (1 - ROUNDING) * seconds) for k, seconds in trace.times.items()}
        return trace.retimed({k: least_ends[i] for k, i in ended.items()})

    spread = median(run.seconds for run in runs) / sum(parts.values())
    return replace(first, parts=parts, laps=laps, spread=spread, trace=retimed(first.trace), curve=retimed(first.curve))
