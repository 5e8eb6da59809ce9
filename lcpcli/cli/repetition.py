"""How often a run is made so that its times can be shown: none includes what only a first run costs.

Beyond imports, which never count, a first run in a process waits for memory and caches. So a brief one is made again,
whether there is one problem or many; and runs that are compared are made several times, of which each step counts with
the least.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lcpcli.clock import PARTS, least_steps

if TYPE_CHECKING:
    from lcpcli.solving.result import Result

BRIEF = 0.02  # seconds: a run that is not longer is made again if it is the first of its method
LONG = 1.0  # seconds of a run that is not repeated even if it is compared
ENOUGH, BUDGET = 20, 0.3  # repetitions, and seconds of them, either of which is enough

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
        return seconds[0] <= LONG and len(seconds) <= ENOUGH and sum(seconds[1:]) < BUDGET
    return is_first and len(seconds) == 1 and seconds[0] <= BRIEF


def _least(runs: Sequence[Result]) -> Result:
    """The result of repeated runs, with the least time of each part and each step."""
    parts = {part: min(run.parts[part] for run in runs) for part in PARTS}
    traces = [{name: trace for name in ("trace", "curve") if (trace := getattr(run, name)) is not None} for run in runs]
    times = least_steps([{k: t for trace in own.values() for k, t in trace.times.items()} for own in traces])
    return replace(runs[0], parts=parts, **{name: trace.retimed(times) for name, trace in traces[0].items()})
