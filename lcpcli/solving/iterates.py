"""The iterates of direct runs, for callbacks; and for traces, for which a run that is timed is repeated, untimed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

from lcpcli import clock
from lcpcli.clock import Stopwatch, seconds
from lcpcli.methods.stages import Finished, Iterate, ended
from lcpcli.model.start import Start
from lcpcli.solving.direct_run import Session, solved_directly
from lcpcli.solving.result import Result
from lcpcli.solving.trace import Callback, LateRow, Trace, TraceRow
from lcpcli.verify.point import Criterion


def with_traces(result: Result, start: Start | None, trace: Trace | None, curve: Trace | None) -> Result:
    """Return the result of a direct run with its traces filled, as interrupted if Ctrl-C comes first.

    An iterate has the share of the run's `seconds` that it has in the second run. The last one is that of the result.
    """
    problem, box, interrupted = result.problem, result.problem.box, False
    traces, criterion = [own for own in (trace, curve) if own is not None], Criterion(problem, result.tol)
    began, kept = seconds(), [(Iterate(problem.start if start is None else start.x, None, "", 0), 0.0)]
    again = Session(
        problem, replace(result.limits, time_limit=math.inf), {}, Stopwatch(clock.seconds, clock.seconds()), start=start
    )
    again.keep = lambda iterate: kept.append((iterate, seconds() - began))
    try:
        solved_directly(again)
        factor = result.seconds / (seconds() - began)
        kept[1:] = kept[max(1, len(kept) - result.iterations) :]  # without those of an attempt that was given up
        for row in _rows(result, kept):
            x = box.x_of(result.z, result.w) if row.k == result.iterations else row.x
            for own in traces:
                own.add(replace(row, seconds=factor * row.seconds, x=x), criterion)
        for own in traces:
            own.close(criterion)
    except KeyboardInterrupt:
        interrupted = True
    return replace(result, trace=trace, curve=curve, interrupted=interrupted)


def called(session: Session, result: Result, kept: Sequence[tuple[Iterate, float]], callback: Callback) -> bool:
    """Call the callback with the iterates of a direct run, each with its seconds; return False if it ends the run
    before its end: the session then has what the loop is to repeat up to there."""
    criterion, ctrl_c = Criterion(result.problem, result.tol), None
    iterates = kept[max(0, len(kept) - result.iterations) :]
    for row in _rows(result, iterates):
        ends = row.k < result.iterations
        try:
            ends &= bool(callback(LateRow.of(row, criterion)))
        except StopIteration:
            pass
        except KeyboardInterrupt as interrupt:
            ctrl_c, ends = interrupt, True
        if ends:
            steps = [each for each, _ in iterates[: row.k]]
            if row.k == result.iterations:  # whose x is that of the result
                steps[-1] = steps[-1]._replace(x=result.problem.box.x_of(result.z, result.w))
            session.stopwatch.pause()
            session.replay = partial(ended, Finished(), *steps)
            session.callback = partial(_repeated, row.k, ctrl_c)
            return False
    return True


def _repeated(k: int, ctrl_c: KeyboardInterrupt | None, row: TraceRow) -> bool:
    if row.k == k and ctrl_c is not None:
        raise ctrl_c
    return row.k == k


def _rows(result: Result, kept: Sequence[tuple[Iterate, float]]) -> Iterator[TraceRow]:
    """Yield the rows of the last iterates of a run, with their seconds; the very last one has the z of the result."""
    for k, (step, at) in enumerate(kept, result.iterations + 1 - len(kept)):
        z = result.problem.box.z_of(step.x) if k < result.iterations else result.z
        yield TraceRow(k, z, None, None, at, step.step, step.method or result.method, x=step.x)
