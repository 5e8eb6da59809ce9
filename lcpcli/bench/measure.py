"""How one solver is timed on one problem: a warm-up, then repeats until their median is known well enough."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from lcpcli.bench.answer import Answer
from lcpcli.bench.statistics import median_interval, summary
from lcpcli.products import THREADED

LEAST, MOST = 3, 25  # repeats
NARROW = 0.05  # half-width of the median's interval, relative to the median, at which it counts as known
REST = 0.05  # seconds in which the threads of a BLAS stop spinning


def rest_after(n: int) -> float:
    """How long to rest before a run on a problem of n unknowns."""
    return REST if n >= THREADED else 0.0


def is_stable(times: Sequence[float]) -> bool:
    """Whether there are enough times, and their median is known to within NARROW."""
    low, high = median_interval(times)
    return len(times) >= LEAST and (high - low) / 2 <= NARROW * summary(times).median


def measure(
    solve: Callable[[bool], Answer],
    budget: float,
    rest: float,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> tuple[Answer, list[float]]:
    """An answer with its error curve, and the seconds of each repeat.

    The first run only warms up, unless it claims nothing, as no time of a failure is used, or takes longer than the
    budget: then it is all there is. Repeats end when their median is known, at MOST of them, or when the budget is
    spent, by the clock on the wall. A last run, which is not timed, makes the curve.

    solve : makes one run; its argument is whether the error curve is wanted.
    budget : seconds that the repeats may take.
    rest : seconds to sleep before each run.
    """
    sleep(rest)
    first = solve(True)
    if not first.claim or first.seconds > budget:
        return first, [first.seconds]
    began = clock()
    times: list[float] = []
    while len(times) < MOST:
        sleep(rest)
        times.append(solve(False).seconds)
        if is_stable(times) or clock() - began >= budget:
            break
    return (solve(True) if first.curve else first), times
