"""The iterates of a run that keeps none while it is timed: the run is repeated, untimed, to fill its traces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lcpcli.clock import seconds
from lcpcli.methods.stages import Iterate
from lcpcli.solving.result import Result
from lcpcli.solving.trace import Trace, TraceRow
from lcpcli.typing import Vector
from lcpcli.verify.point import Criterion

Again = Callable[[Callable[[Iterate], None]], object]


def with_traces(result: Result, start: Vector, again: Again, trace: Trace | None, curve: Trace | None) -> Result:
    """Return the result of a run with its traces filled, as interrupted if Ctrl-C comes first.

    An iterate has the share of the run's `seconds` that it has in the second run. The last one is that of the result.

    start : the x from which it starts, shape (n,). again : makes the run again, and calls its argument with each
    iterate.
    """
    traces = [own for own in (trace, curve) if own is not None]
    criterion, interrupted = Criterion(result.problem, result.tol), False
    try:
        for row in _rows(result, start, again):
            for own in traces:
                own.add(row, criterion)
        for own in traces:
            own.close(criterion)
    except KeyboardInterrupt:
        interrupted = True
    return replace(result, trace=trace, curve=curve, interrupted=interrupted)


def _rows(result: Result, start: Vector, again: Again) -> Iterator[TraceRow]:
    began, kept = seconds(), [(Iterate(start, None, "", 0), 0.0)]
    again(lambda iterate: kept.append((iterate, seconds() - began)))
    factor, box = result.seconds / (seconds() - began), result.problem.box
    kept[1:] = kept[max(1, len(kept) - result.iterations) :]  # without those of an attempt that was given up
    last, at = kept.pop()
    for k, (step, seconds_before) in enumerate(kept):
        method = step.method or result.method
        yield TraceRow(k, box.z_of(step.x), None, None, factor * seconds_before, step.step, method, x=step.x)
    x, method = box.x_of(result.z, result.w), last.method or result.method
    yield TraceRow(len(kept), result.z, None, None, factor * at, last.step, method, x=x)
