"""Who solves many problems: this process, several of them, or those of a cluster.

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
MOST = 256  # problems in it, unless the processes are to have fewer
FOR_EACH = 3  # pieces that each process has or finds next
SMALLEST = 500  # bytes of a record besides its text
SECONDS_BETWEEN = 5.0  # looks at the processes while nothing comes
ATTEMPTS = 2  # of a problem whose process is killed
KILLED = f"the process that solved it was killed, {ATTEMPTS} times"

Works = Sequence[Work]
Outcome: TypeAlias = "Future[tuple[list[Record], float]]"


def here(task: Task, works: Iterable[Work]) -> Iterator[Record]:
    """The records, by this process."""
    for work in works:
        yield from task.records(work)


def elsewhere(task: Task, works: Iterable[Work], pool: Pool, in_order: bool) -> Iterator[Record]:
    """The records, by others, in the order of the problems or each as soon as it is known."""
    try:
        yield from _handed_over(task, works, pool, in_order)
    except pool.ends:
        raise pool.gone from None


def _handed_over(task: Task, works: Iterable[Work], pool: Pool, in_order: bool) -> Iterator[Record]:
    """Yield the records. Only so many inputs are taken as keep the processes busy, and in order only so many as leave
    room for the records that wait for one before them."""
    news = Event()
    inputs, waiting, running = Ahead(works, news), deque[_Piece](), list[_Piece]()
    size, held = 1, 0
    while True:
        news.clear()
        pool.look()
        done = [piece for piece in running if piece.future.done()]
        if any(_is_lost(piece.future, pool) for piece in done):
            _try_again(task, running, pool, news)
            continue
        running = [piece for piece in running if piece not in done]
        for piece in done:
            held -= piece.bytes
            size = _size_after(*piece.finish(), size)
            held += piece.bytes
        while len(running) < FOR_EACH * pool.size and held < HELD:
            taken = inputs.take(size, pool.most)
            if not taken:
                break
            piece = _Piece(taken, _submitted(task, taken, pool, news))
            running.append(piece)
            if in_order:
                waiting.append(piece)
            held += piece.bytes
        ready = _due(waiting) if in_order else done
        for piece in ready:
            held -= piece.bytes
            yield from piece.records
        if not ready:
            if not running and inputs.ended:
                return
            news.wait(SECONDS_BETWEEN)


def _due(waiting: deque[_Piece]) -> list[_Piece]:
    """The pieces whose records are due, as those before them are there; they wait no longer."""
    due = []
    while waiting and waiting[0].is_finished:
        due.append(waiting.popleft())
    return due


def _size_after(number: int, seconds: float, size: int) -> int:
    """How many problems to hand over at once, for what so many have taken."""
    return max(1, min(MOST, 2 * size, int(SECONDS * number / max(seconds, 1e-6))))


@dataclass(eq=False)
class _Piece:
    """Inputs that are handed over together, and what comes back."""

    works: Works
    future: Outcome
    records: list[Record] = field(default_factory=list)
    is_finished: bool = False
    bytes: int = field(init=False)

    def __post_init__(self) -> None:
        self.bytes = sum(map(size_of, self.works))

    def finish(self) -> tuple[int, float]:
        """Take the records in place of the inputs; return how many there are, and the seconds that they took."""
        self.records, seconds = self.future.result()
        self.works, self.is_finished = [], True
        self.bytes = sum(SMALLEST + len(record.text) for record in self.records)
        return len(self.records), seconds


def _try_again(task: Task, running: Sequence[_Piece], pool: Pool, news: Event) -> None:
    """Hand over again what was lost with a process: what it may have been killed by first, each input by itself."""
    wait([piece.future for piece in running])
    lost = [piece for piece in running if _is_lost(piece.future, pool)]
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
