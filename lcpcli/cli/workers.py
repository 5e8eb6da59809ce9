"""Who solves many problems: this process, several of them, or those of a cluster; the records come in order.

Beyond one process the interface is `concurrent.futures.Executor`. A process that is killed costs the problems that it
had another attempt: first those that may have killed it, each by itself; one that does so again has no result.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass, field
from threading import Event
from typing import TypeAlias

from lcpcli.cli.ahead import HELD, Ahead, size_of
from lcpcli.cli.pools import Pool
from lcpcli.cli.records import Record, Task
from lcpcli.files.inputs import Work

SECONDS = 0.1  # of work that is handed over at once
MOST = 256  # problems in it
FOR_EACH = 3  # pieces that each process has or finds next
ATTEMPTS = 2  # of a problem whose process is killed
KILLED = f"the process that solved it was killed, {ATTEMPTS} times"

Works = Sequence[Work]
Outcome: TypeAlias = "Future[tuple[list[Record], float]]"


def here(task: Task, works: Iterable[Work]) -> Iterator[Record]:
    """The records, by this process."""
    for work in works:
        yield from task.records(work)


def elsewhere(task: Task, works: Iterable[Work], pool: Pool) -> Iterator[Record]:
    """The records, by others."""
    try:
        yield from _handed_over(task, works, pool)
    except pool.ends:
        raise pool.gone from None


def _handed_over(task: Task, works: Iterable[Work], pool: Pool) -> Iterator[Record]:
    """The same. Only so many inputs are taken as are needed to keep the processes busy."""
    news = Event()
    inputs, waiting, running = Ahead(works, news), deque[_Piece](), list[_Piece]()
    size, held = 1, 0
    while True:
        news.clear()
        ended = [piece.future for piece in running if piece.future.done()]
        running = [piece for piece in running if not piece.future.done()]
        for future in ended:
            size = _size_after(future, size)
        while len(running) < FOR_EACH * pool.size and held < HELD:
            piece = inputs.take(size)
            if not piece:
                break
            running.append(_Piece(piece, _submitted(task, piece, pool, news)))
            waiting.append(running[-1])
            held += running[-1].bytes
        if waiting and waiting[0].future.done():
            if _is_lost(waiting[0].future, pool):
                _try_again(task, waiting, pool, news)
                running = [*waiting]
            first = waiting.popleft()
            held -= first.bytes
            yield from first.future.result()[0]
        elif waiting or not inputs.ended:
            news.wait()
        else:
            return


def _size_after(future: Outcome, size: int) -> int:
    """How many problems to hand over at once, for what so many have taken."""
    if future.cancelled() or future.exception() is not None:
        return size
    records, seconds = future.result()
    return max(1, min(MOST, 2 * size, int(SECONDS * len(records) / max(seconds, 1e-6))))


@dataclass
class _Piece:
    """Inputs that are handed over together, and what comes back."""

    works: Works
    future: Outcome
    bytes: int = field(init=False)

    def __post_init__(self) -> None:
        self.bytes = sum(map(size_of, self.works))


def _try_again(task: Task, waiting: deque[_Piece], pool: Pool, news: Event) -> None:
    """Hand over again what was lost with a process: what it may have been killed by first, each input by itself."""
    wait([piece.future for piece in waiting])
    lost = [piece for piece in waiting if _is_lost(piece.future, pool)]
    pool.renew()
    for piece in lost[: pool.size]:
        records = [record for work in piece.works for record in _alone(task, work, pool, news)]
        piece.future = Future()
        piece.future.set_result((records, 0.0))
    for piece in lost[pool.size :]:
        piece.future = _submitted(task, piece.works, pool, news)


def _is_lost(future: Outcome, pool: Pool) -> bool:
    return not future.cancelled() and isinstance(future.exception(), pool.lost)


def _submitted(task: Task, works: Works, pool: Pool, news: Event) -> Outcome:
    """What the pool will have made of inputs, which is news; an executor that is already broken fails like that."""
    try:
        future: Outcome = pool.executor.submit(task.all_of, works)
    except pool.lost as error:
        future = Future()
        future.set_exception(error)
    future.add_done_callback(lambda _: news.set())
    return future


def _alone(task: Task, work: Work, pool: Pool, news: Event) -> list[Record]:
    """The records of an input that is handed over while nothing else is."""
    for _ in range(ATTEMPTS):
        try:
            return _submitted(task, [work], pool, news).result()[0]
        except pool.lost:
            pool.renew()
    return task.lost(work, KILLED)
