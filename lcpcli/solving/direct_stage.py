"""The attempts of `direct_run` as the first iterates of a loop, for runs whose steps
somebody sees: a trace, a callback, or an observer of the progress."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from itertools import chain
from typing import TypeVar

import numpy as np

from lcpcli.methods.newton import iterate_of
from lcpcli.methods.stages import Finished, Iterate, Stage
from lcpcli.solving.direct_run import Quick, Session, Steps, attempts
from lcpcli.solving.result import Result
from lcpcli.typing import Vector

End = TypeVar("End")


def shown(session: Session, others: Callable[[], Stage]) -> Stage:
    """Pass on the steps of the direct attempts on the problem of a session, and if none
    reaches a solution, the stage that `others` sets up. Steps that this stage or a
    later attempt repeats are passed on once."""
    session.is_compiled = False  # no kernel shows its steps
    quick = attempts(session)
    first = next(quick, None)
    return others() if first is None else _shown(session, chain([first], quick), others)


def _shown(
    session: Session, quick: Iterable[Quick], others: Callable[[], Stage]
) -> Stage:
    seen = list[Vector]()
    for attempt in quick:
        steps = _iterates(attempt.steps(session), session)
        result = yield from _once(steps, seen)
        if result is not None:
            return Finished()
    return (yield from _once(others(), seen))


def _once(
    steps: Generator[Iterate, None, End], seen: list[Vector]
) -> Generator[Iterate, None, End]:
    """Pass on the steps, without those that have been seen, which come again in the
    same order."""
    again = deque(seen)
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            ending: End = end.value
            return ending
        if again and np.array_equal(again[0], step.x):
            again.popleft()
            continue
        seen.append(step.x)
        yield step


def _iterates(
    steps: Steps, session: Session
) -> Generator[Iterate, None, Result | None]:
    """Yield the steps of an attempt as iterates, the last one, if it reaches a
    solution, with the z of its result."""
    number = 0
    last: Iterate | None = None
    while True:
        try:
            step = next(steps)
        except StopIteration as end:
            result: Result | None = end.value
            break
        number += 1
        last = step if isinstance(step, Iterate) else iterate_of(step, number)
        yield last
    if result is None or not result.iterations:
        return result
    z = result.z
    w = session.problem.w(result.z)
    box = session.problem.box
    if number < result.iterations or last is None:
        answer = session.answer
        if answer is not None and answer.method == "newton":
            last = iterate_of((z, w, answer.is_single), number + 1)
        else:
            last = Iterate(z, None, "", number + 1, result.route[-1])
    elif np.array_equal(box.z_of(last.x), z):
        return result
    basis = box.basis_at(z) if result.end is None else result.end
    x = box.x_within(z, w, basis)  # whose z is this one, bit for bit
    yield last._replace(x=x, F=None, signs_final=True, basis=result.end)
    return result
