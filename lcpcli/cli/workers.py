"""Many problems solved by several processes, or by those of a cluster, while the next ones are read.

A process that is killed costs the problems that it had another attempt,
each by itself; one that kills its process again has no result.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future
from threading import Condition, Event, Thread
from typing import TYPE_CHECKING

from lcpcli import interrupts
from lcpcli.files.inputs import QColumns, Work

HELD = 2**25  # bytes of inputs that wait for something
READ = 512  # inputs that are read ahead
AT_ONCE = 2**19  # bytes of inputs that are taken together, if there is more than one
COLUMNS_FOR_ONE = 16  # of one M, which are solved together, for one problem

SECONDS = 0.1  # of work that is handed over at once
MOST = 256  # problems in it, unless the processes are to have fewer
FOR_EACH = 3  # pieces that each process has or finds next
SMALLEST = 500  # bytes of a record besides its text
SECONDS_BETWEEN = 5.0  # looks at the processes while nothing comes
KILLED = "the process that solved it was killed, 2 times"

if TYPE_CHECKING:
    from lcpcli.cli.many import Record, Task
    from lcpcli.cli.pools import Pool


def size_of(work: Work) -> int:
    """The bytes of an input."""
    return work.Q.nbytes if isinstance(work, QColumns) else sum(map(len, work.contents))


class Ahead:
    """Inputs read by a thread of their own, as far as there is room. `news` is set whenever there are more, or no more.

    The thread may wait for standard input for ever; the program ends without it.
    """

    def __init__(self, works: Iterable[Work], news: Event) -> None:
        self._works, self._news = works, news
        self._read: deque[Work] = deque()
        self._bytes = 0
        self._room = Condition()
        self._over = False
        self._fault: BaseException | None = None
        thread = Thread(target=self._run, daemon=True)
        interrupts.reading.append(thread)
        thread.start()

    @property
    def ended(self) -> bool:
        """Whether there are no more. Raises what reading them has raised."""
        if not self._over or self._read:
            return False
        if self._fault is not None:
            raise self._fault
        return True

    def take(self, number: int, most: int) -> list[Work]:
        """Some that have been read, so many and at most `most`; several q for one M come alone, so many times more."""
        taken: list[Work] = []
        total = 0
        with self._room:
            self._room.notify()
            while self._read and len(taken) < min(number, most) and total < AT_ONCE:
                if taken and isinstance(self._read[0], QColumns):
                    break
                work = self._read.popleft()
                self._bytes -= size_of(work)
                if isinstance(work, QColumns):
                    size = COLUMNS_FOR_ONE * number
                    part, rest = work.part(0, size), work.part(size, len(work.names))
                    if rest.names:
                        self._read.appendleft(rest)
                        self._bytes += size_of(rest)
                    return [part]
                taken.append(work)
                total += size_of(work)
        return taken

    def _run(self) -> None:
        try:
            for work in self._works:
                with self._room:
                    self._room.wait_for(lambda: len(self._read) < READ and self._bytes < HELD)
                    self._read.append(work)
                    self._bytes += size_of(work)
                self._news.set()
        except BaseException as error:
            self._fault = error
        self._over = True
        self._news.set()


def elsewhere(task: Task, works: Iterable[Work], pool: Pool, in_order: bool) -> Iterator[Record]:
    """Yield the records, by others, in the order of the problems or each as soon as it is known.

    Only so many inputs are taken as keep the processes busy, and in order only so many as leave room for the records
    that wait for one before them.
    """
    news = Event()
    inputs, waiting, running = Ahead(works, news), deque[_Piece](), list[_Piece]()
    size, held = 1, 0  # of the problems to hand over at once, and of the bytes that are held
    try:
        while True:
            news.clear()
            pool.look()
            done = [piece for piece in running if piece.future.done()]
            running = [piece for piece in running if piece not in done]
            for piece in done:
                held -= piece.bytes
                number, seconds = piece.finish(task, pool)
                size = max(1, min(MOST, 2 * size, int(SECONDS * number / max(seconds, 1e-6))))
                held += piece.bytes
            while len(running) < FOR_EACH * pool.size and held < HELD:
                taken = inputs.take(size, pool.most)
                if not taken:
                    break
                piece = _Piece(taken, pool.submit(task.all_of, taken))
                piece.future.add_done_callback(lambda _: news.set())
                running.append(piece)
                if in_order:
                    waiting.append(piece)
                held += piece.bytes
            ready = [] if in_order else done
            while waiting and waiting[0].is_finished:
                ready.append(waiting.popleft())
            for piece in ready:
                held -= piece.bytes
                yield from piece.records
            if not ready:
                if not running and inputs.ended:
                    return
                news.wait(SECONDS_BETWEEN)
    except pool.ends:
        raise pool.gone from None


class _Piece:
    """Inputs that are handed over together, and what comes back."""

    def __init__(self, works: Sequence[Work], future: Future[tuple[list[Record], float]]) -> None:
        self.works, self.future, self.is_finished = works, future, False
        self.records: list[Record] = []
        self.bytes = sum(map(size_of, works))

    def finish(self, task: Task, pool: Pool) -> tuple[int, float]:
        """Take the records in place of the inputs; return how many there are, and the seconds that they took."""
        try:
            self.records, seconds = self.future.result()
        except pool.lost:
            self.records, seconds = list(_again(task, self.works, pool)), 0.0
        self.works, self.is_finished = [], True
        self.bytes = sum(SMALLEST + len(record.text) for record in self.records)
        return len(self.records), seconds


def _again(task: Task, works: Sequence[Work], pool: Pool) -> Iterator[Record]:
    """Yield the records of inputs whose process was killed, each of which has another attempt by itself."""
    futures = [pool.submit(task.all_of, [work]) for work in works]
    for work, future in zip(works, futures, strict=True):
        try:
            yield from future.result()[0]
        except pool.lost:
            yield from task.lost(work, KILLED)
