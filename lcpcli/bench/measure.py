"""Timing of one solver on one problem: a warm-up, then repeats until their median is known accurately enough."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from lcpcli.bench.answer import Answer
from lcpcli.bench.statistics import median_interval, summary
from lcpcli.clock import least_steps
from lcpcli.linalg.matrices import THREADED

LEAST, MOST = 3, 25  # repeats
NARROW = 0.05  # half-width of the median's interval, relative to the median, at which it counts as known
WARM_UP = 0.02  # seconds of untimed runs before brief ones are measured
CURVES = 5  # runs of which each step of the curve has the least time
REST = 0.05  # seconds after which idle BLAS threads have stopped spinning


def rest_before(n: int, threads: int | None) -> float:
    """How long to rest before a run on a problem of n unknowns, with so many BLAS threads, None if that is unknown."""
    return REST if n >= THREADED and threads != 1 else 0.0


def is_stable(times: Sequence[float]) -> bool:
    """Whether the median of the times is known to within NARROW."""
    low, high = median_interval(times)
    return (high - low) / 2 <= NARROW * summary(times).median


def measure(
    solve: Callable[[bool], Answer],
    budget: float,
    rest: float,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> tuple[Answer, list[float]]:
    """An answer with its error curve, and the seconds of each repeat.

    The first run provides the curve and is an untimed warm-up, unless it claims nothing: as times of failures are not
    used, it is then the only run. Brief runs are warmed up for WARM_UP seconds. There are at least LEAST repeats; they
    end when their median is known, after MOST of them, or when the budget of wall-clock time is spent; a repeat longer
    than the whole budget is always the last. Otherwise the curve is recorded again, with the least time of each step in
    CURVES warm runs, as by `clock.least_steps`.

    solve : makes one run; its argument is whether to record the error curve.
    budget : seconds for the repeats.
    rest : seconds to sleep before each run.
    """
    sleep(rest)
    first = solve(True)
    if not first.claim:
        return first, [first.seconds]
    for _ in range(int(WARM_UP / first.seconds) if first.seconds else 0):
        solve(False)
    began = clock()
    times: list[float] = []
    while len(times) < MOST:
        sleep(rest)
        times.append(solve(False).seconds)
        if times[-1] > budget:
            return first, times
        if len(times) >= LEAST and (is_stable(times) or clock() - began >= budget):
            break
    if not first.curve:
        return first, times
    runs = []
    for _ in range(CURVES):
        sleep(rest)
        runs.append(solve(True))
    return runs[0].retimed(least_steps([run.times for run in runs])), times
